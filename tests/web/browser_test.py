#!/usr/bin/env python3
"""Draws a dataset in headless Chromium, streamed from `terrane serve`, and compares the picture with `terrane render`.

usage: browser_test.py TERRANE MODULE_FOLDER WORK_FOLDER

The page and the module come from a server of this test, the dataset from another one (so of another origin, by CORS).
Chromium draws through Mesa's software rasteriser, as `terrane render --gles --software` does, so that the pictures may
differ by rounding alone.
"""
import collections
import http.server
import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys
import threading
import urllib.parse
import zlib

WIDTH, HEIGHT = 640, 400
# How many workers there are; "broken": two that never come to life; "dying": two that die at their work.
WAYS = (("patches", "2"), ("meshes", "2"), ("meshes", "0"), ("meshes", "dying"), ("patches", "broken"))
# What of them have lines on the ground, and a pass that draws contour lines over it.
STAGED_WAYS = (("patches", "2"), ("meshes", "0"))
MIDDLE = (500000, 6700000)  # of the ground
LINES = [  # corners, colour, opacity, width, 1 for metres
    ([[MIDDLE[0] + 2000 * math.cos(i / 20), MIDDLE[1] + 2000 * math.sin(i / 20)] for i in range(126)], (208, 48, 32), 1, 4, 0),
    ([[MIDDLE[0] - 4000 + 80 * i, MIDDLE[1] + 2500 - 50 * i] for i in range(101)], (0, 96, 255), 0.5, 120, 1),
    ([[MIDDLE[0], MIDDLE[1]]], (255, 255, 255), 1, 15, 0)]
PASS = """vec3 apply(Ground ground) {
  if (!ground.isGround) return ground.color;
  float at = ground.place.z / 100.0;
  float perPixel = max(fwidth(at), 1e-6);
  float pixels = abs(fract(at - 0.5) - 0.5) / perPixel;
  float share = clamp(1.2 - pixels, 0.0, 1.0) * clamp(1.0 - 2.0 * perPixel, 0.0, 1.0);
  return mix(ground.color, vec3(0.12, 0.03, 0.0), share);
}
"""
EYE, TARGET, FOV = (495500, 6695500, 2300), (500300, 6700800, 700), 50
TAU, SAMPLES = 1, 4
PATIENCE_SECONDS = 180
MODULE_FILES = ("terrane.mjs", "terrane.wasm", "terrane_worker.mjs", "terrane_worker.wasm")

# Of the 256 steps of a colour, and of all pixels.
LARGEST_USUAL_DIFFERENCE = 2
LARGEST_SHARE_BEYOND = 0.002
LARGEST_MEAN_DIFFERENCE = 0.1

CHROMIUM_FLAGS = [
    "--headless=new", "--no-sandbox", "--no-first-run", "--disable-quic", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--use-gl=angle", "--use-angle=gl-egl",
    "--ignore-gpu-blocklist", f"--window-size={WIDTH},{HEIGHT}"]


def read_png(path):
    """The texels of an 8-bit RGB or RGBA PNG, as rows of RGBA."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    at, packed, header = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        if kind == b"IDAT":
            packed += body
        at += 12 + size
    width, height, depth, color, _, _, interlace = header
    assert depth == 8 and color in (2, 6) and interlace == 0, header
    channels = 3 if color == 2 else 4
    raw, stride = zlib.decompress(packed), width * channels
    above, out = bytearray(stride), bytearray()
    for y in range(height):
        kind = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left = row[i - channels] if i >= channels else 0
            corner = above[i - channels] if i >= channels else 0
            if kind == 1:
                row[i] = (row[i] + left) & 255
            elif kind == 2:
                row[i] = (row[i] + above[i]) & 255
            elif kind == 3:
                row[i] = (row[i] + (left + above[i]) // 2) & 255
            elif kind == 4:
                estimate = left + above[i] - corner
                row[i] = (row[i] + min((left, above[i], corner), key=lambda v: abs(estimate - v))) & 255
        for x in range(width):
            out += row[x * channels:x * channels + 3] + b"\xff"
        above = row
    return width, height, bytes(out)


def write_png(path, rgba):
    rows = b"".join(b"\0" + rgba[y * WIDTH * 4:(y + 1) * WIDTH * 4] for y in range(HEIGHT))
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 6, 0, 0, 0)), (b"IDAT", zlib.compress(rows)),
              (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks))


class PageServer(http.server.ThreadingHTTPServer):
    """Sends the page and the module, and hears what the page tells."""

    def __init__(self, files):
        self.files, self.told, self.news = files, {}, threading.Condition()
        super().__init__(("127.0.0.1", 0), PageHandler)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def tell(self, what, body):
        with self.news:
            self.told[what] = body
            self.news.notify_all()

    def wait(self):
        with self.news:
            if not self.news.wait_for(lambda: "done" in self.told or "problem" in self.told, PATIENCE_SECONDS):
                sys.exit(f"the page told nothing for {PATIENCE_SECONDS} s")
            return self.told


class PageHandler(http.server.BaseHTTPRequestHandler):
    TYPES = {".html": "text/html", ".mjs": "text/javascript", ".ts": "text/javascript", ".wasm": "application/wasm",
             ".json": "application/json"}

    def do_GET(self):
        path = self.server.files.get(self.path.split("?")[0])
        self.send_response(200 if path else 404)
        body = path.read_bytes() if path else b""
        if path:
            self.send_header("Content-Type", self.TYPES[path.suffix])
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()
        self.server.tell(self.path.rsplit("/", 1)[1], body)

    def log_message(self, *_):
        pass


def make_dataset(terrane, work):
    dataset = work / "small.terrane"
    for command in (["synth", "-o", work / "small.tif", "--color", work / "color.tif", "--size", "1025", "--seed", "1"],
                    ["build", work / "small.tif", "-o", dataset, "--imagery", work / "color.tif"]):
        subprocess.run([terrane, *command, "--overwrite", "-q"], check=True)
    return dataset


def main(terrane, module, work):
    work.mkdir(parents=True, exist_ok=True)
    dataset = make_dataset(terrane, work)
    for surface, workers in WAYS:
        compare(terrane, module, work, dataset, surface, workers, False)
    for surface, workers in STAGED_WAYS:
        compare(terrane, module, work, dataset, surface, workers, True)


def write_stages(work):
    """What `terrane render` is told of lines and pass, and what the page is."""
    features = [{"type": "Feature", "geometry": {"type": "LineString" if len(corners) > 1 else "Point",
                                                 "coordinates": corners if len(corners) > 1 else corners[0]},
                 "properties": {"stroke": "#%02x%02x%02x" % color, "stroke-opacity": opacity,
                                "stroke-meters" if meters else "stroke-width": width}}
                for corners, color, opacity, width, meters in LINES]
    (work / "lines.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    (work / "contours.glsl").write_text(PASS)
    page = {"corners": [number for line in LINES for corner in line[0] for number in corner],
            "lines": [number for corners, color, opacity, width, meters in LINES
                      for number in (len(corners), *(part / 255 for part in color), opacity, width, meters)],
            "pass": PASS, "origin": [*MIDDLE, 0]}
    return ["--lines", work / "lines.geojson", "--pass", work / "contours.glsl"], json.dumps(page).encode()


def check_answers(report):
    """What the page says of the ground under the picture's middle fits together."""
    picked, profile = report["picked"], report["profile"]
    assert abs(picked["elevation"] - picked["height"]) < 1e-3 and 0 < picked["error"] < 30, picked
    eye_to_ground = math.dist(EYE, (picked["east"], picked["north"], picked["height"]))
    assert abs(eye_to_ground - picked["distance"]) < 1e-3, picked
    assert profile["count"] == 11 and abs(profile["length"] - 1000) < 1e-6, profile
    assert abs(profile["middle"] - picked["height"]) < 1e-3, profile
    # What is under a pixel is seen from the eye.
    assert report["sight"][0] == 1 and report["sight"][1] > -0.01, report["sight"]
    assert "terraneFlight" in report["flightTrouble"] and report["flightWords"] == "" and report["flightSeconds"] == 4, report
    assert math.dist(EYE, report["flightEye"]) < 1e-6, report["flightEye"]


def compare(terrane, module, work, dataset, surface, workers, is_staged):
    """Draws one way in the browser and natively, and ends the program where the pictures are not the same."""
    points = [",".join(map(str, point)) for point in (EYE, TARGET)]
    kind = f"{surface}_lined" if is_staged else surface
    native_path, browser_path = work / f"native_{kind}.png", work / f"browser_{kind}_{workers}.png"
    options, told_stages = write_stages(work) if is_staged else ([], b"null")
    (work / "stages.json").write_bytes(told_stages)
    subprocess.run([terrane, "render", dataset, "-o", native_path, "--overwrite", "-q", "--gles", "--software",
                    "--surface", surface, "--size", f"{WIDTH}x{HEIGHT}", "--eye", points[0], "--look-at", points[1],
                    "--fov", str(FOV), "--tau", str(TAU), "--samples", str(SAMPLES), *options], check=True)

    here = pathlib.Path(__file__).parent
    # note: the worker's script is written so that it is JavaScript, too.
    script = here.parent.parent / "web" / "package" / "src" / "worker.ts"
    pages = PageServer({"/page.html": here / "page.html", "/worker.js": script, "/stages.json": work / "stages.json",
                        **{f"/{name}": module / name for name in MODULE_FILES}})
    serving = subprocess.Popen([terrane, "serve", dataset, "--cors", "--port", "0", "-q"], stdout=subprocess.PIPE,
                               text=True)
    browser = None
    try:
        url = serving.stdout.readline().strip()
        query = urllib.parse.urlencode({"dataset": f"{url}d/small/", "eye": points[0], "target": points[1], "fov": FOV,
                                        "tau": TAU, "samples": SAMPLES, "surface": surface,
                                        "workers": workers})
        profile = work / "profile"
        shutil.rmtree(profile, ignore_errors=True)
        with open(work / "chromium.log", "w") as log:
            browser = subprocess.Popen(["chromium", *CHROMIUM_FLAGS, f"--user-data-dir={profile}",
                                        f"http://127.0.0.1:{pages.server_port}/page.html?{query}"], stdout=log,
                                       stderr=log)
        told = pages.wait()
    finally:
        for process in (browser, serving):
            if process is not None:
                process.terminate()
                process.wait()

    if "problem" in told:
        sys.exit("the page says: " + told["problem"].decode())
    report = json.loads(told["report"])
    print(json.dumps(report, indent=2))
    check_answers(report)
    write_png(browser_path, told["picture"])
    width, height, native = read_png(native_path)
    assert (width, height) == (WIDTH, HEIGHT) and len(told["picture"]) == len(native)
    counts = collections.Counter(max(abs(a - b) for a, b in zip(told["picture"][i:i + 3], native[i:i + 3]))
                                 for i in range(0, len(native), 4))
    pixels = WIDTH * HEIGHT
    beyond = sum(count for difference, count in counts.items() if difference > LARGEST_USUAL_DIFFERENCE) / pixels
    mean = sum(difference * count for difference, count in counts.items()) / pixels
    colors = len(set(native[i:i + 3] for i in range(0, len(native), 4)))
    print(f"{beyond:.5%} of the pixels differ by more than {LARGEST_USUAL_DIFFERENCE} of 255, the mean is {mean:.4f}, "
          f"the largest {max(counts)}; {colors} colours")
    if colors < 1000:
        sys.exit("the native picture shows next to nothing")
    if beyond > LARGEST_SHARE_BEYOND or mean > LARGEST_MEAN_DIFFERENCE:
        sys.exit(f"the browser's picture is another one: {browser_path}, {native_path}")
    if report["canvasDiffers"]:
        sys.exit("the canvas shows another picture than was drawn")
    most, left, trouble = {"broken": (0, 0, "worker"), "dying": (2, 0, "it died")}.get(workers) or (
        int(workers), int(workers), "")
    if (report["mostWorkers"], report["workers"]) != (most, left):
        sys.exit(f"workers: {workers}, but {report['mostWorkers']} came to life and {report['workers']} are left")
    if trouble not in report["trouble"] or (trouble == "") != (report["trouble"] == ""):
        sys.exit(f"workers: {workers}, and the trouble is said to be: {report['trouble']}")
    if report["requestsFailed"] or report["tilesLost"]:
        sys.exit("not all came")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]).resolve())
