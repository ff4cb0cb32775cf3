// What both programs are measured by, put into their pages before anything else runs: counts WebGL's draw calls and their triangles,
// leaves drawing of the picture out where it is told to, and flies.
(() => {
  const measure = {
    /** Draw calls into the picture do nothing; so do clears, blits and reading back. Smaller targets than the picture are part of
     * streaming (textures that are made on the GPU), and always drawn. */
    isStubbed: true,
    calls: 0,
    triangles: 0,
    /** Instances and ranges are drawn without their last triangle: how it is proved that a hole is found. */
    omitsTriangles: false,
    /** The source of every shader passes through. */
    changeShader: (source) => source,
    longTasks: [],
  };
  window.measure = measure;

  const viewports = new WeakMap();
  const isPicture = (gl) => {
    const viewport = viewports.get(gl);
    return viewport === undefined || viewport[0] * viewport[1] >= gl.drawingBufferWidth * gl.drawingBufferHeight;
  };
  const trianglesOf = (gl, mode, count) =>
    mode === gl.TRIANGLES ? count / 3 : mode === gl.TRIANGLE_STRIP || mode === gl.TRIANGLE_FAN ? Math.max(count - 2, 0) : 0;
  const sum = (counts, offset, drawCount) => {
    let total = 0;
    for (let i = 0; i < drawCount; ++i) total += counts[offset + i];
    return total;
  };

  function omitTriangles(args, at) {
    const shorter = (corners) => Math.max(corners - 3, 0);
    if (typeof args[at] === "number") {
      args[at] = shorter(args[at]);
    } else {
      args[at] = args[at].slice(args[at + 1], args[at + 1] + args.at(-1)).map(shorter);
      args[at + 1] = 0;
    }
  }
  /** Replaces a drawing function by one that counts. `shape` gives mode and number of corners, of all instances, from arguments. `shortened`
   * of these is the number of corners: one, or a list with the place where it begins next to it. */
  function count(prototype, name, shape, shortened, context = (self) => self) {
    const draw = prototype[name];
    prototype[name] = function (...args) {
      const gl = context(this);
      if (!isPicture(gl)) return draw.apply(this, args);
      const [mode, corners] = shape(...args);
      ++measure.calls;
      measure.triangles += trianglesOf(gl, mode, corners);
      if (measure.omitsTriangles && shortened !== undefined) omitTriangles(args, shortened);
      if (!measure.isStubbed) return draw.apply(this, args);
    };
  }
  function leaveOut(prototype, name) {
    const work = prototype[name];
    prototype[name] = function (...args) {
      if (!measure.isStubbed || !isPicture(this)) return work.apply(this, args);
    };
  }

  const gl2 = WebGL2RenderingContext.prototype;
  count(gl2, "drawArrays", (mode, first, n) => [mode, n]);
  count(gl2, "drawElements", (mode, n) => [mode, n]);
  count(gl2, "drawRangeElements", (mode, start, end, n) => [mode, n]);
  count(gl2, "drawArraysInstanced", (mode, first, n, instances) => [mode, n * instances], 2);
  count(gl2, "drawElementsInstanced", (mode, n, type, offset, instances) => [mode, n * instances], 1);
  for (const name of ["clear", "clearBufferfv", "clearBufferiv", "clearBufferuiv", "clearBufferfi", "blitFramebuffer", "readPixels"])
    leaveOut(gl2, name);
  const viewport = gl2.viewport;
  gl2.viewport = function (x, y, width, height) {
    viewports.set(this, [width, height]);
    return viewport.call(this, x, y, width, height);
  };
  const shaderSource = gl2.shaderSource;
  gl2.shaderSource = function (shader, source) {
    return shaderSource.call(this, shader, measure.changeShader(source));
  };
  const getExtension = gl2.getExtension, extended = new WeakSet();
  gl2.getExtension = function (name) {
    const extension = getExtension.call(this, name);
    if (extension && name.toLowerCase() === "webgl_multi_draw" && !extended.has(extension)) {
      extended.add(extension);
      const own = () => this;
      count(extension, "multiDrawArraysWEBGL", (mode, f, fo, counts, at, n) => [mode, sum(counts, at, n)], 3, own);
      count(extension, "multiDrawElementsWEBGL", (mode, counts, at, type, o, oo, n) => [mode, sum(counts, at, n)], 1, own);
      const instanced = (counts, at, instances, instancesAt, n) => {
        let total = 0;
        for (let i = 0; i < n; ++i) total += counts[at + i] * instances[instancesAt + i];
        return total;
      };
      count(extension, "multiDrawArraysInstancedWEBGL",
        (mode, f, fo, counts, at, instances, instancesAt, n) => [mode, instanced(counts, at, instances, instancesAt, n)], 3, own);
      count(extension, "multiDrawElementsInstancedWEBGL",
        (mode, counts, at, type, o, oo, instances, instancesAt, n) => [mode, instanced(counts, at, instances, instancesAt, n)], 1, own);
    }
    return extension;
  };

  new PerformanceObserver((list) => {
    for (const task of list.getEntries()) measure.longTasks.push({ begin: task.startTime, ms: task.duration });
  }).observe({ entryTypes: ["longtask"] });

  const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));

  /**
   * Flies one step a frame.
   *
   * program: { canvas, setCamera(camera), frame(seconds): draws, hasGround(): the last frame had ground, isSettled(),
   *   triangles(): of the last frame as the program itself counts, redraw(seconds): the same picture again }
   * options: { cameras, shots: steps that are drawn and given to `onShot(step)`, rests: the end is drawn when all has come, step
   *   "rest"; provesHoles: it is drawn again without some triangles there, patienceSeconds }. onShot answers whether the
   *   picture has a hole.
   */
  measure.fly = async (program, options) => {
    const frames = [], { cameras } = options, shots = new Set(options.shots ?? []);
    let firstPicture = null;
    const drawOne = async (seconds) => {
      measure.calls = measure.triangles = 0;
      const begin = performance.now();
      program.frame(seconds);
      const now = performance.now();
      if (firstPicture === null && program.hasGround()) firstPicture = now;
      return now - begin;
    };
    const shoot = async (step, seconds) => {
      measure.isStubbed = false;
      measure.calls = measure.triangles = 0;
      program.redraw(seconds);
      const hasHole = await options.onShot(step);
      measure.isStubbed = true;
      return hasHole;
    };

    // Stands until all that the first camera needs is there.
    program.setCamera(cameras[0]);
    const patience = 1000 * options.patienceSeconds;
    let quiet = 0;
    for (const begin = performance.now(); quiet < 5; ) {
      await nextFrame();
      await drawOne(0);
      quiet = program.hasGround() && program.isSettled() ? quiet + 1 : 0;
      if (performance.now() - begin > patience) throw new Error("the first picture is never finished");
    }
    const settled = performance.now();
    if (shots.has(0)) await shoot(0, 0);

    performance.mark("flight begins");
    const begin = performance.now();
    for (let step = 1; step < cameras.length; ++step) {
      await nextFrame();
      program.setCamera(cameras[step]);
      const ms = await drawOne(step / 60);
      frames.push({ ms, calls: measure.calls, triangles: measure.triangles, told: program.triangles() });
      if (shots.has(step)) await shoot(step, step / 60);
    }
    const end = performance.now();
    performance.mark("flight ends");
    const atEnd = { settledAtEnd: program.isSettled() };

    // Where it ended, at rest.
    if (options.rests) {
      quiet = 0;
      for (const stood = performance.now(); quiet < 5; ) {
        await nextFrame();
        await drawOne((cameras.length - 1) / 60 + (performance.now() - stood) / 1000);
        quiet = program.isSettled() ? quiet + 1 : 0;
        if (performance.now() - stood > patience) throw new Error("the last picture is never finished");
      }
      await shoot("rest", cameras.length);
    }
    if (options.provesHoles) {
      measure.omitsTriangles = true;
      if (!(await shoot("in part", cameras.length))) throw new Error("holes in the ground are not found");
    }
    return { firstPictureSeconds: firstPicture / 1000, settledSeconds: settled / 1000, flightSeconds: (end - begin) / 1000,
      flightBegin: begin, flightEnd: end, frames, longTasks: measure.longTasks, ...atEnd };
  };
})();
