// Flies one program in Chromium and writes down what it took.
//
// usage: node run.mjs JOB.json RESULT.json
//
// JOB.json: { "url", "cameras", "chromium", "bytesPerSecond", "latencyMilliseconds", "work": a folder,
//   "serve": { address's beginning: folder } of a server of this program's own, for url "/...",
//   "shots": steps that are drawn, "rests": the end is drawn too, "pictures": folder for them, or absent,
//   "countsCracks": ground is told from sky in each shot }
import fs from "node:fs";
import http from "node:http";
import path from "node:path";
import { fileURLToPath } from "node:url";
import zlib from "node:zlib";

import { chromium } from "playwright-core";

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".json": "application/json", ".css": "text/css",
  ".wasm": "application/wasm", ".webp": "image/webp", ".png": "image/png", ".terrain": "application/vnd.quantized-mesh" };
const FLAGS = ["--no-sandbox", "--no-first-run", "--disable-quic", "--disable-background-networking", "--disable-component-update",
  "--disable-sync", "--disable-dev-shm-usage", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist"];
const PATIENCE_SECONDS = 120;
const PAGES = fileURLToPath(new URL("pages", import.meta.url));

/** Serves folders, compressed as a web server would: text and code by gzip, tiles as they lie. Answers the port. */
function serve(folders) {
  const packed = new Map();
  const server = http.createServer((request, response) => {
    const asked = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
    const found = Object.keys(folders).find((prefix) => asked.startsWith(prefix));
    const file = found === undefined ? "" : path.join(folders[found], path.normalize("/" + asked.slice(found.length)));
    if (!file || !fs.existsSync(file) || !fs.statSync(file).isFile()) return response.writeHead(404).end();
    const kind = path.extname(file), headers = { "Content-Type": TYPES[kind] ?? "application/octet-stream" };
    let body = fs.readFileSync(file);
    if (kind === ".terrain") headers["Content-Encoding"] = "gzip";
    else if ([".html", ".js", ".json", ".css", ".wasm"].includes(kind)) {
      headers["Content-Encoding"] = "gzip";
      if (!packed.has(file)) packed.set(file, zlib.gzipSync(body, { level: 9 }));
      body = packed.get(file);
    }
    response.writeHead(200, { ...headers, "Content-Length": body.length }).end(body);
  });
  server.keepAliveTimeout = 60000;
  return new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve({ server, port: server.address().port })));
}

/** What a request is for. */
function kindOf(url) {
  const { pathname } = new URL(url);
  if (/elevation/.test(pathname) || pathname.endsWith(".terrain")) return "elevation";
  if (/imagery/.test(pathname)) return "imagery";
  if (/(manifest|layer|datasets)\.json$/.test(pathname)) return "index";
  return "code";
}

/** Main thread time of the flight: all tasks of the page's renderer, from a trace. */
function taskTimes(trace) {
  const { traceEvents: events } = JSON.parse(trace);
  const mark = (name) => events.find((event) => event.name === name && event.cat.includes("user_timing"));
  const begin = mark("flight begins"), end = mark("flight ends");
  const isMain = (event) => event.pid === begin.pid && event.tid === begin.tid && event.ph === "X";
  const tasks = events.filter((event) => isMain(event) && event.name === "ThreadControllerImpl::RunTask" &&
    event.ts + event.dur > begin.ts && event.ts < end.ts);
  // A task may run others within: only the outermost count.
  tasks.sort((a, b) => a.ts - b.ts);
  let reach = 0, wall = 0, cpu = 0;
  const longTasks = [];
  for (const task of tasks) {
    if (task.ts < reach) continue;
    reach = task.ts + task.dur;
    wall += task.dur;
    cpu += task.tdur ?? 0;
    if (task.dur > 50000) {
      const parts = {};
      for (const event of events)
        if (isMain(event) && event.cat.includes("devtools.timeline") && event.ts >= task.ts && event.ts + event.dur <= reach && event.dur > 5000)
          parts[event.name] = Math.max(parts[event.name] ?? 0, event.dur / 1000);
      longTasks.push({ atSeconds: (task.ts - begin.ts) / 1e6, ms: task.dur / 1000, cpuMs: (task.tdur ?? 0) / 1000, parts });
    }
  }
  return { taskMs: wall / 1000, taskCpuMs: cpu / 1000, longTasks };
}

async function run(job) {
  const cameras = JSON.parse(fs.readFileSync(job.cameras, "utf8"));
  const { server, port } = await serve(job.serve ?? {});
  const browser = await chromium.launch({ executablePath: job.chromium, headless: true, args: FLAGS });
  try {
    const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, deviceScaleFactor: 1 });
    const page = await context.newPage();
    const cdp = await context.newCDPSession(page);
    const requests = new Map(), problems = [];
    page.on("pageerror", (error) => problems.push(String(error)));
    page.on("console", (message) => ["error", "warning"].includes(message.type()) && problems.push(`${message.text()} ${message.location().url}`));
    cdp.on("Network.requestWillBeSent", (event) => {
      if (/^https?:/.test(event.request.url)) requests.set(event.requestId,
        { url: event.request.url, range: event.request.headers.Range ?? event.request.headers.range, begin: event.timestamp, bytes: 0, status: "underway" });
    });
    cdp.on("Network.responseReceived", (event) => {
      const request = requests.get(event.requestId);
      if (request) request.status = event.response.status;
    });
    // What a request that is not finished has received counts, too.
    cdp.on("Network.dataReceived", (event) => {
      const request = requests.get(event.requestId);
      if (request) request.bytes += event.encodedDataLength;
    });
    cdp.on("Network.loadingFinished", (event) => {
      const request = requests.get(event.requestId);
      if (request) Object.assign(request, { bytes: event.encodedDataLength, end: event.timestamp });
    });
    cdp.on("Network.loadingFailed", (event) => {
      const request = requests.get(event.requestId);
      if (request) Object.assign(request, { end: event.timestamp, status: event.canceled ? "cancelled" : event.errorText });
    });
    await cdp.send("Network.enable");
    await cdp.send("Network.setCacheDisabled", { cacheDisabled: false });
    await cdp.send("Network.emulateNetworkConditions", { offline: false, latency: job.latencyMilliseconds,
      downloadThroughput: job.bytesPerSecond, uploadThroughput: job.bytesPerSecond });
    await page.addInitScript({ path: path.join(PAGES, "measure.js") });
    await page.addInitScript({ path: path.join(PAGES, "cracks.js") });
    if (job.countsCracks) await page.addInitScript(() => window.cracks.paintSky());
    const shots = [];
    await page.exposeFunction("takeShot", (shot) => { shots.push(shot); });

    const traced = !job.shots;
    if (traced) await browser.startTracing(page, { categories: ["toplevel", "devtools.timeline", "blink.user_timing"] });
    await page.goto(job.url.startsWith("/") ? `http://127.0.0.1:${port}${job.url}` : job.url, { waitUntil: "commit" });
    await page.waitForFunction(() => window.programReady, undefined, { timeout: 1000 * PATIENCE_SECONDS, polling: "raf" }).catch((error) => {
      throw new Error(`the page does not begin: ${problems.join("; ") || error}`);
    });
    const flown = await page.evaluate((options) => window.measure.fly(window.program, { ...options, onShot: async (step) => {
      // In the same task as the drawing, before the browser takes the picture.
      const picture = options.wantsPictures ? window.program.canvas.toDataURL("image/png") : null;
      const cracks = options.countsCracks ? window.cracks.count(window.program.canvas) : null;
      await window.takeShot({ step, picture, cracks, calls: window.measure.calls, triangles: window.measure.triangles,
        about: window.program.about() });
      return cracks !== null && cracks.enclosed + cracks.beneath > 0;
    } }), { cameras, shots: job.shots, rests: job.rests, provesHoles: job.countsCracks, wantsPictures: Boolean(job.pictures), countsCracks: job.countsCracks,
      patienceSeconds: PATIENCE_SECONDS }).catch((error) => {
      const underway = [...requests.values()].filter((request) => request.end === undefined || request.status >= 400);
      throw new Error(`${error.message}; ${problems.join("; ")}; ${underway.map((request) => `${request.url}: ${request.status}`).join(", ")}`);
    });
    const about = await page.evaluate(() => ({ name: window.program.name, ...window.program.about() }));
    const atEnd = [...requests.values()].map((request) => ({ ...request }));
    const times = traced ? taskTimes((await browser.stopTracing()).toString()) : null;
    const heap = await cdp.send("Runtime.getHeapUsage");

    for (const shot of shots) {
      if (shot.picture) fs.writeFileSync(path.join(job.pictures, `${shot.step}.png`), Buffer.from(shot.picture.split(",")[1], "base64"));
      delete shot.picture;
    }
    return { about, flown, times, heap, shots, problems,
      requests: atEnd.map((request) => ({ ...request, kind: kindOf(request.url), url: new URL(request.url).pathname })) };
  } finally {
    await browser.close();
    server.close();
    server.closeAllConnections();
  }
}

const [jobFile, resultFile] = process.argv.slice(2);
fs.writeFileSync(resultFile, JSON.stringify(await run(JSON.parse(fs.readFileSync(jobFile, "utf8")))));
