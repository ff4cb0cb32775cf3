#!/usr/bin/env python3
"""Our engine in a page beside CesiumJS, on the same ground and flight: ./dev bench web [--keep] [--only NAME] [--no-pictures]

Both fly bench/measure_surfaces/flight.json over the demo with 4097 samples a side, 600 steps, in Chromium at 1280x720 over a line of
40 Mbit/s and 50 ms, with an empty cache. bench/README.md says what is counted.
"""

import argparse
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "support"))
import measuring  # noqa: E402

HERE = Path("bench/web")
FOLDER = Path("build/bench/web")
CAMERAS = Path("build/release/bin/measure_web_cameras")
MODULE = Path("build/web/bin")
PICTURES = Path("docs/pictures/web")
FLIGHT = Path("bench/measure_surfaces/flight.json")
STEPS, STEPS_A_SECOND, WIDTH, HEIGHT = 600, 60, 1280, 720
BYTES_PER_SECOND, LATENCY_MS = 5e6, 50
FINEST_IMAGERY = 13  # 9.4 m a texel here; the picture has 10 m
IMAGERY_QUALITY = 80  # as ours
MERCATOR_HALF = math.pi * 6378137
SHOTS = [0, 120, 300, 480]  # steps: at rest before the flight, and in motion
CRACK_SHOTS = list(range(20, STEPS + 1, 20))
PROGRAMS = ["meshes", "patches", "cesium"]


def require_programs():
    for program in ("node", "npm", "chromium"):
        if not shutil.which(program):
            raise measuring.Failure(f"{program} is missing: ./dev deps browsers")
    for path in (MODULE / "terrane.mjs", measuring.TERRANE, CAMERAS):
        if not path.exists():
            raise measuring.Failure(f"{path} is missing: ./dev build && ./dev build web")


def install():
    """CesiumJS and what drives Chromium, once."""
    lock = HERE / "package-lock.json"
    installed = HERE / "node_modules/.package-lock.json"
    if not installed.exists() or installed.stat().st_mtime < lock.stat().st_mtime:
        print("Installing CesiumJS", file=sys.stderr)
        measuring.run(["npm", "ci", "--prefix", HERE, "--ignore-scripts", "--no-audit", "--no-fund"])
        installed.touch()


def demo():
    """The raster, its picture, and the dataset of them."""
    script = (
        "source bench/support/datasets.sh; demo=$(demo_4097); "
        'bench_dataset demo_web "$demo.tif" --max-error 1 --imagery "${demo}_color.tif" >&2; echo "$demo"'
    )
    demo_path = measuring.run(["bash", "-euc", script]).strip()
    return Path(f"{demo_path}.tif"), Path(f"{demo_path}_color.tif"), measuring.DATA / "demo_web.terrane"


def is_older(made, source):
    return not made.exists() or made.stat().st_mtime < source.stat().st_mtime


class Raster:
    """Where a raster's samples lie. It must be in a UTM zone of the north, on WGS 84."""

    def __init__(self, path):
        self.path = path
        said = json.loads(measuring.run(["gdalinfo", "-json", path]))
        self.cols, self.rows = said["size"]
        west, self.spacing, _, north, _, down = said["geoTransform"]
        self.west, self.north = west + self.spacing / 2, north + down / 2
        code = json.loads(measuring.run(["gdalsrsinfo", "-o", "projjson", path])).get("id", {}).get("code", 0)
        if not 32601 <= code <= 32660 or down != -self.spacing:
            raise measuring.Failure(f"{path} is in no UTM zone of the north")
        self.epsg, self.zone = code, code - 32600
        corners = self.degrees(
            (self.west + col * self.spacing, self.north - row * self.spacing, 0)
            for col in (0, self.cols // 2, self.cols - 1)
            for row in (0, self.rows - 1)
        )
        # West, south, east, north of all of the samples.
        self.bounds = [edge(place[axis] for place in corners) for edge in (min, max) for axis in (0, 1)]

    def degrees(self, places):
        """Longitude, latitude and height of places in the raster's CRS."""
        lines = "".join(f"{east!r} {north!r} {height!r}\n" for east, north, height in places)
        done = subprocess.run(
            ["gdaltransform", "-s_srs", f"EPSG:{self.epsg}", "-t_srs", "OGC:CRS84"],
            input=lines,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise measuring.Failure(f"gdaltransform: {done.stderr.strip()}")
        return [[float(number) for number in line.split()] for line in done.stdout.splitlines()]


def make_terrain(raster):
    """CesiumJS's terrain from the raster."""
    out, part = FOLDER / "terrain", FOLDER / "terrain.part"
    newest = max(raster.path, HERE / "cesium_terrain.mjs", key=lambda path: path.stat().st_mtime)
    if not is_older(out / "layer.json", newest):
        return
    print("Making terrain tiles for CesiumJS: a few minutes", file=sys.stderr)
    heights = FOLDER / "heights.f32"
    measuring.run(["gdal_translate", "-q", "-of", "ENVI", "-ot", "Float32", raster.path, heights])
    description = {
        "file": str(heights),
        "cols": raster.cols,
        "rows": raster.rows,
        "west": raster.west,
        "north": raster.north,
        "spacing": raster.spacing,
        "zone": raster.zone,
        "bounds": dict(zip(("west", "south", "east", "north"), raster.bounds)),
    }
    (FOLDER / "raster.json").write_text(json.dumps(description), encoding="utf-8")
    shutil.rmtree(part, ignore_errors=True)
    print(measuring.run(["node", HERE / "cesium_terrain.mjs", FOLDER / "raster.json", part]).strip(), file=sys.stderr)
    shutil.rmtree(out, ignore_errors=True)
    part.rename(out)
    heights.unlink()


def mercator_row(latitude, tiles):
    return int((1 - math.asinh(math.tan(math.radians(latitude))) / math.pi) / 2 * tiles)


def make_imagery(picture):
    """JPEG tiles of the picture in the web Mercator scheme, each level averaged from the finer one."""
    out, part = FOLDER / "imagery", FOLDER / "imagery.part"
    if not is_older(out / "complete", picture.path):
        return
    print("Making imagery tiles for CesiumJS", file=sys.stderr)
    shutil.rmtree(part, ignore_errors=True)
    west, south, east, north = picture.bounds
    count, size, source = 0, 0, picture.path
    for level in range(FINEST_IMAGERY, -1, -1):
        tiles, meters = 2**level, 2 * MERCATOR_HALF / 2**level
        cols = [int((degrees + 180) / 360 * tiles) for degrees in (west, east)]
        rows = [mercator_row(latitude, tiles) for latitude in (north, south)]
        warped = FOLDER / f"imagery_{level}.tif"
        extent = [cols[0] * meters, -(rows[1] + 1) * meters, (cols[1] + 1) * meters, -rows[0] * meters]
        extent = [edge - MERCATOR_HALF if axis % 2 == 0 else edge + MERCATOR_HALF for axis, edge in enumerate(extent)]
        measuring.run(
            ["gdalwarp", "-q", "-overwrite", "-t_srs", "EPSG:3857", "-te", *extent]
            + ["-ts", 256 * (cols[1] - cols[0] + 1), 256 * (rows[1] - rows[0] + 1)]
            + ["-r", "cubic" if level == FINEST_IMAGERY else "average", source, warped]
        )
        for col in range(cols[0], cols[1] + 1):
            for row in range(rows[0], rows[1] + 1):
                tile = part / str(level) / str(col) / f"{row}.jpg"
                tile.parent.mkdir(parents=True, exist_ok=True)
                corner = [256 * (col - cols[0]), 256 * (row - rows[0])]
                measuring.run(
                    ["gdal_translate", "-q", "-of", "JPEG", "-co", f"QUALITY={IMAGERY_QUALITY}", "-co", "PROGRESSIVE=ON"]
                    + ["--config", "GDAL_PAM_ENABLED", "NO", "-srcwin", *corner, 256, 256, warped, tile]
                )
                count, size = count + 1, size + tile.stat().st_size
        if source != picture.path:
            source.unlink()
        source = warped
    source.unlink()
    print(f"{count} tiles, {size / 1e6:.1f} MB", file=sys.stderr)
    (part / "complete").touch()
    shutil.rmtree(out, ignore_errors=True)
    part.rename(out)


def make_cameras(raster, dataset):
    """The flight's steps, for both: in the dataset's CRS, and in degrees."""
    out = FOLDER / "cameras.json"
    measuring.run([CAMERAS, FLIGHT, dataset, STEPS, STEPS_A_SECOND, WIDTH, HEIGHT, out])
    cameras = json.loads(out.read_text(encoding="utf-8"))
    for place in ("eye", "target"):
        for camera, degrees in zip(cameras, raster.degrees(camera[place] for camera in cameras)):
            camera[f"{place}Degrees"] = degrees
    out.write_text(json.dumps(cameras), encoding="utf-8")
    return out


def make_pages():
    """What terrane serve delivers in the viewer's place: the module, and a page that flies."""
    out = FOLDER / "ours"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    for path in sorted(MODULE.glob("terrane*.mjs")) + sorted(MODULE.glob("terrane*.wasm")):
        shutil.copy(path, out / path.name)
    for name in ("terrane.js", "page.css"):
        shutil.copy(HERE / "pages" / name, out / name)
    shutil.copy(HERE / "pages/terrane.html", out / "index.html")
    return out


class Bench:
    """What all runs share."""

    def __init__(self, raster, dataset, cameras, pages):
        self.dataset, self.cameras, self.pages = dataset, cameras, pages
        self.bounds = ",".join(f"{degrees:.7f}" for degrees in raster.bounds)

    def fly(self, program, **more):
        """One flight of one program in a browser of its own."""
        job = {
            "cameras": str(self.cameras),
            "chromium": shutil.which("chromium"),
            "bytesPerSecond": BYTES_PER_SECOND,
            "latencyMilliseconds": LATENCY_MS,
            **more,
        }
        serving = None
        try:
            if program == "cesium":
                job["url"] = f"/cesium.html?bounds={self.bounds}"
                job["serve"] = {
                    "/cesium/": str(HERE / "node_modules/cesium/Build/Cesium"),
                    "/terrain/": str(FOLDER / "terrain"),
                    "/imagery/": str(FOLDER / "imagery"),
                    "/": str(HERE / "pages"),
                }
            else:
                serving = subprocess.Popen(
                    [measuring.TERRANE, "serve", self.dataset, "--viewer", self.pages, "--port", "0", "-q"],
                    stdout=subprocess.PIPE,
                    text=True,
                )
                url = serving.stdout.readline().strip()
                if not url:
                    raise measuring.Failure("terrane serve did not start")
                samples = 1 if more.get("countsCracks") else 4
                job["url"] = f"{url}?dataset=/d/{self.dataset.stem}/&surface={program}&samples={samples}"
            job_path, result_path = FOLDER / "job.json", FOLDER / "result.json"
            job_path.write_text(json.dumps(job), encoding="utf-8")
            measuring.run(["node", HERE / "run.mjs", job_path, result_path])
            return json.loads(result_path.read_text(encoding="utf-8"))
        finally:
            if serving is not None:
                serving.terminate()
                serving.wait(timeout=30)
