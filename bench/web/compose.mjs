// Lays pictures of two programs side by side, each pair a JPEG of moderate size.
//
// usage: node compose.mjs CHROMIUM JOB.json   where JOB.json: [{ "out", "left", "right": PNG files, "leftText", "rightText" }]
import fs from "node:fs";

import { chromium } from "playwright-core";

const [executablePath, jobFile] = process.argv.slice(2);
const browser = await chromium.launch({ executablePath, headless: true, args: ["--no-sandbox"] });
try {
  const page = await browser.newPage();
  const source = (file) => `data:image/png;base64,${fs.readFileSync(file).toString("base64")}`;
  for (const pair of JSON.parse(fs.readFileSync(jobFile, "utf8"))) {
    const jpeg = await page.evaluate(async ({ left, right, texts }) => {
      const width = 800, height = 450, foot = 28, canvas = document.createElement("canvas");
      Object.assign(canvas, { width: 2 * width + 4, height: height + foot });
      const context = canvas.getContext("2d");
      context.fillStyle = "white";
      context.fillRect(0, 0, canvas.width, canvas.height);
      context.font = "16px sans-serif";
      for (const [i, source] of [left, right].entries()) {
        const image = new Image();
        image.src = source;
        await image.decode();
        const x = i * (width + 4);
        context.drawImage(image, x, 0, width, height);
        context.fillStyle = "black";
        context.fillText(texts[i], x + 8, height + 20);
      }
      return canvas.toDataURL("image/jpeg", 0.82);
    }, { left: source(pair.left), right: source(pair.right), texts: [pair.leftText, pair.rightText] });
    fs.writeFileSync(pair.out, Buffer.from(jpeg.split(",")[1], "base64"));
  }
} finally {
  await browser.close();
}
