// Counts cracks in a picture of ours: background where there must be ground. The sky's shader is made to paint one colour that ground
// never has; nothing else of the picture is changed.
(() => {
  const SKY = "oColor = vec4(skyColor(normalize(direction)), 1.0);";
  const cracks = { painted: 0 };
  window.cracks = cracks;

  cracks.paintSky = () => {
    window.measure.changeShader = (source) => {
      if (!source.includes(SKY)) return source;
      ++cracks.painted;
      return source.replace(SKY, "oColor = vec4(1.0, 0.0, 1.0, 1.0);");
    };
  };

  /**
   * { sky: pixels of it, enclosed, beneath }. `enclosed` is sky that does not reach the picture's top over pixels of sky (all eight
   * neighbours). `beneath` is sky with ground above it on the picture's line to the nadir, which no ground of heights can show: four
   * pixels up, and all around there, so that the outline's own pixels are not taken for it.
   */
  cracks.count = (canvas) => {
    if (cracks.painted !== 1) throw new Error(`${cracks.painted} shaders paint the sky, not one`);
    const gl = canvas.getContext("webgl2"), { width, height } = canvas;
    const pixels = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    // Rows from the top. Any share of a pixel that is background counts: magenta has more red and blue than any ground.
    const isSky = (x, y) => {
      const at = 4 * ((height - 1 - y) * width + x);
      return pixels[at] > 250 && pixels[at + 1] < 5 && pixels[at + 2] > 250;
    };
    const state = new Uint8Array(width * height); // 0 ground, 1 sky, 2 sky that reaches the top
    let sky = 0;
    for (let y = 0; y < height; ++y)
      for (let x = 0; x < width; ++x)
        if (isSky(x, y)) {
          state[y * width + x] = 1;
          ++sky;
        }
    const open = [];
    const reach = (x, y) => {
      if (x < 0 || y < 0 || x >= width || y >= height || state[y * width + x] !== 1) return;
      state[y * width + x] = 2;
      open.push([x, y]);
    };
    for (let x = 0; x < width; ++x) reach(x, 0);
    while (open.length > 0) {
      const [x, y] = open.pop();
      for (let dy = -1; dy <= 1; ++dy) for (let dx = -1; dx <= 1; ++dx) reach(x + dx, y + dy);
    }
    const enclosed = state.reduce((sum, value) => sum + (value === 1 ? 1 : 0), 0);

    // All of the flight looks 12 degrees down at 90 degrees: so far below the middle is the nadir.
    const nadirX = width / 2, nadirY = height / 2 + (height / 2) * Math.tan((78 * Math.PI) / 180);
    let beneath = 0;
    for (let y = 6; y < height; ++y)
      for (let x = 2; x < width - 2; ++x) {
        if (state[y * width + x] === 0) continue;
        const lean = (x + 0.5 - nadirX) / (nadirY - y), upX = Math.round(x + 4 * lean);
        let isGround = upX >= 1 && upX < width - 1;
        for (let dy = -1; isGround && dy <= 1; ++dy)
          for (let dx = -1; dx <= 1; ++dx) isGround &&= state[(y - 4 + dy) * width + upX + dx] === 0;
        if (isGround) ++beneath;
      }
    return { sky, enclosed, beneath };
  };
})();
