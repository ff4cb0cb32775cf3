// The flight's page of CesiumJS.
import * as Cesium from "/cesium/index.js";

const rectangle = Cesium.Rectangle.fromDegrees(...new URL(location.href).searchParams.get("bounds").split(",").map(Number));
const terrainProvider = await Cesium.CesiumTerrainProvider.fromUrl("/terrain");
const imagery = new Cesium.UrlTemplateImageryProvider({ url: "/imagery/{z}/{x}/{y}.webp", maximumLevel: 13, rectangle });
const clock = new Cesium.Clock({ currentTime: Cesium.JulianDate.fromIso8601("2026-06-21T10:00:00Z"), shouldAnimate: false });
// Its defaults, but for the stars. The picture is drawn when the flight says so.
const widget = new Cesium.CesiumWidget("view", { terrainProvider, baseLayer: new Cesium.ImageryLayer(imagery), clock, skyBox: false,
  useDefaultRenderLoop: false, creditContainer: "credits", showRenderLoopErrors: false });
const { scene, camera } = widget;
let problem = null;
scene.renderError.addEventListener((_, error) => { problem = error; });

const tiles = () => scene.globe._surface._tilesToRender;
const place = ([longitude, latitude, height]) => Cesium.Cartesian3.fromDegrees(longitude, latitude, height);
const draw = () => {
  widget.resize();
  widget.render();
  if (problem) throw problem;
};
window.program = {
  canvas: widget.canvas, scene,
  name: `CesiumJS ${Cesium.VERSION}`,
  setCamera(wanted) {
    const eye = place(wanted.eyeDegrees);
    const direction = Cesium.Cartesian3.normalize(
      Cesium.Cartesian3.subtract(place(wanted.targetDegrees), eye, new Cesium.Cartesian3()), new Cesium.Cartesian3());
    const up = Cesium.Ellipsoid.WGS84.geodeticSurfaceNormal(eye);
    const right = Cesium.Cartesian3.normalize(Cesium.Cartesian3.cross(direction, up, new Cesium.Cartesian3()), new Cesium.Cartesian3());
    // Cesium's angle is that of the longer side.
    camera.frustum.fov = 2 * Math.atan((Math.tan((wanted.fovy * Math.PI) / 360) * widget.canvas.width) / widget.canvas.height);
    camera.setView({ destination: eye,
      orientation: { direction, up: Cesium.Cartesian3.cross(right, direction, new Cesium.Cartesian3()) } });
  },
  frame: draw,
  redraw: draw,
  hasGround: () => tiles().length > 0,
  isSettled: () => scene.globe.tilesLoaded,
  triangles: () => tiles().reduce((sum, tile) => sum + (tile.data.renderedMesh ?? tile.data.mesh ?? tile.data.fill?.mesh).indices.length / 3, 0),
  about: () => ({ screenSpaceError: scene.globe.maximumScreenSpaceError, samples: scene.msaaSamples,
    levels: tiles().reduce((levels, tile) => ({ ...levels, [tile.level]: (levels[tile.level] ?? 0) + 1 }), {}),
    surfaceTiles: tiles().length, width: widget.canvas.width, height: widget.canvas.height }),
};
window.programReady = true;
