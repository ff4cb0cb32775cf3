#!/usr/bin/env python3
"""Our engine in a page beside CesiumJS, on the same ground and flight: ./dev bench web [--turns N] [--only NAME] [--no-pictures]

Both fly bench/measure_surfaces/flight.json over the demo with 4097 samples a side, 600 steps, in Chromium at 1280x720 over a line of
40 Mbit/s and 50 ms, with an empty cache. bench/README.md says what is counted.
"""

import argparse
import hashlib
import json
import math
import shutil
import statistics
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
IMAGERY_FORMAT, IMAGERY_QUALITY = "WEBP", 75  # as ours by default
MERCATOR_HALF = math.pi * 6378137
SHOTS = [0, 120, 300, 480]  # steps: at rest before the flight, and in motion
CRACK_SHOTS = list(range(20, STEPS + 1, 20))
PROGRAMS = ["meshes", "patches", "cesium"]
DEFAULT_SURFACE = "meshes"
TRIANGLES_MILLIONS = {"meshes": 0.4, "patches": 1.5}
LONG_TASK_MS = 50


def require_programs():
    for program in ("node", "npm", "chromium"):
        if not shutil.which(program):
            raise measuring.Failure(f"{program} is missing: ./dev deps browsers")
    for path in (MODULE / "terrane.mjs", MODULE / "terrane_worker.mjs", measuring.TERRANE, CAMERAS):
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


def stamp_of(*sources):
    """What is made of these files is made again only where their content changes."""
    return "\n".join(hashlib.sha256(source.read_bytes()).hexdigest() for source in sources) + "\n"


def is_current(stamp_path, stamp):
    return stamp_path.exists() and stamp_path.read_text(encoding="utf-8") == stamp


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
    stamp = stamp_of(raster.path, HERE / "cesium_terrain.mjs")
    if is_current(out / "stamp", stamp):
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
    (part / "stamp").write_text(stamp, encoding="utf-8")
    shutil.rmtree(out, ignore_errors=True)
    part.rename(out)
    for aside in FOLDER.glob("heights.*"):
        aside.unlink()


def mercator_row(latitude, tiles):
    return int((1 - math.asinh(math.tan(math.radians(latitude))) / math.pi) / 2 * tiles)


def make_imagery(picture):
    """WebP tiles of the picture in the web Mercator scheme, each level averaged from the finer one."""
    out, part = FOLDER / "imagery", FOLDER / "imagery.part"
    stamp = stamp_of(picture.path) + f"{IMAGERY_FORMAT} {IMAGERY_QUALITY}\n"
    if is_current(out / "stamp", stamp):
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
                tile = part / str(level) / str(col) / f"{row}.webp"
                tile.parent.mkdir(parents=True, exist_ok=True)
                corner = [256 * (col - cols[0]), 256 * (row - rows[0])]
                measuring.run(
                    ["gdal_translate", "-q", "-of", IMAGERY_FORMAT, "-co", f"QUALITY={IMAGERY_QUALITY}"]
                    + ["--config", "GDAL_PAM_ENABLED", "NO", "-srcwin", *corner, 256, 256, warped, tile]
                )
                count, size = count + 1, size + tile.stat().st_size
        if source != picture.path:
            source.unlink()
        source = warped
    source.unlink()
    print(f"{count} tiles, {size / 1e6:.1f} MB", file=sys.stderr)
    (part / "stamp").write_text(stamp, encoding="utf-8")
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
    shutil.copy("web/package/dist/early.js", out / "early.js")
    for name in ("terrane.js", "page.css"):
        shutil.copy(HERE / "pages" / name, out / name)
    # The worker's script is JavaScript under another name.
    shutil.copy("web/package/src/worker.ts", out / "worker.js")
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


def total(result, *kinds):
    """Requests, and megabytes that came over the line for them."""
    of_kind = [request for request in result["requests"] if request["kind"] in kinds]
    return len(of_kind), sum(request["bytes"] for request in of_kind) / 1e6


def row_of(result):
    """The numbers of one flight. Those that other work on the machine disturbs end with _s or _wall."""
    flown, times = result["flown"], result["times"]
    frames = flown["frames"]
    requests, megabytes = total(result, "elevation", "imagery", "index")
    report = result["about"].get("report")
    heap = result["heap"]["usedSize"] + result["heap"]["backingStorageSize"]
    in_flight = flown["flightBegin"] / 1e3
    began = min(request["begin"] for request in result["requests"])
    return {
        "requests": requests,
        "mb": megabytes,
        "elevation_mb": total(result, "elevation")[1],
        "imagery_mb": total(result, "imagery")[1],
        "code_mb": total(result, "code")[1],
        "requests_in_flight": sum(
            request["kind"] != "code" and request["begin"] - began > in_flight for request in result["requests"]
        ),
        "triangles": round(statistics.mean(frame["told"] for frame in frames)),
        "triangles_max": round(max(frame["told"] for frame in frames)),
        "all_triangles": round(statistics.mean(frame["triangles"] for frame in frames)),
        "draw_calls": statistics.mean(frame["calls"] for frame in frames),
        "draw_calls_max": max(frame["calls"] for frame in frames),
        "main_thread_ms": times["taskCpuMs"] / len(frames),
        "main_thread_ms_wall": times["taskMs"] / len(frames),
        "longest_task_ms": max((task["cpuMs"] for task in times["longTasks"]), default=0.0),
        "long_tasks": sum(task["cpuMs"] > LONG_TASK_MS for task in times["longTasks"]),
        "long_tasks_wall": len(times["longTasks"]),
        "first_picture_s": flown["firstPictureSeconds"],
        "settled_s": flown["settledSeconds"],
        "flight_s": flown["flightSeconds"],
        "memory_mb": (heap + (report["heapBytes"] if report else 0)) / 1e6,
    }


def of_turns(rows):
    """Medians; of what other work disturbs, the least disturbed."""
    out = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        middle = statistics.median(values)
        out[name] = min(values) if name.endswith(("_s", "_wall")) else int(middle) if middle == int(middle) else middle
    return out


def take_pictures(bench, programs):
    """Both at the same moments, side by side in docs/pictures/web."""
    for program in programs:
        folder = FOLDER / f"pictures_{program}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        print(f"Pictures of {program}", file=sys.stderr)
        bench.fly(program, shots=SHOTS, rests=True, pictures=str(folder))
    PICTURES.mkdir(parents=True, exist_ok=True)
    pairs = []
    for step in [*SHOTS, "rest"]:
        when = "at rest, at the end" if step == "rest" else f"{step / STEPS_A_SECOND:g} s" if step else "at rest, before the flight"
        name = "rest" if step == "rest" else f"{step // STEPS_A_SECOND}s"
        pairs.append(
            {
                "out": str(PICTURES / f"{name}.jpg"),
                "left": str(FOLDER / f"pictures_{programs[0]}" / f"{step}.png"),
                "right": str(FOLDER / f"pictures_{programs[1]}" / f"{step}.png"),
                "leftText": f"Terrane, {when}",
                "rightText": f"CesiumJS, {when}",
            }
        )
    job = FOLDER / "pairs.json"
    job.write_text(json.dumps(pairs), encoding="utf-8")
    measuring.run(["node", HERE / "compose.mjs", shutil.which("chromium"), job])


def count_cracks(bench, surface):
    """Cracks in pictures of the flight, and in how many of them more was still coming."""
    print(f"Cracks of {surface}", file=sys.stderr)
    result = bench.fly(surface, shots=CRACK_SHOTS, rests=True, countsCracks=True)
    seen = [shot for shot in result["shots"] if shot["step"] != "in part"]
    return {
        "cracks": sum(shot["cracks"]["enclosed"] + shot["cracks"]["beneath"] for shot in seen),
        "crack_pictures": len(seen),
        "while_loading": sum(shot["about"]["report"]["requestsUnderway"] > 0 for shot in seen),
    }


def bench():
    parser = argparse.ArgumentParser(prog="./dev bench web", description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--turns", type=int, default=3, help="flights of each program (3)")
    parser.add_argument("--only", choices=PROGRAMS, action="append", help="measure this one; again for another")
    parser.add_argument("--no-pictures", action="store_true", help=f"leave {PICTURES} as it is")
    parser.add_argument("--no-cracks", action="store_true", help="count no cracks")
    options = parser.parse_args()
    require_programs()
    install()
    FOLDER.mkdir(parents=True, exist_ok=True)
    raster_path, picture_path, dataset = demo()
    raster = Raster(raster_path)
    make_terrain(raster)
    make_imagery(Raster(picture_path))
    flights = Bench(raster, dataset, make_cameras(raster, dataset), make_pages())

    programs = options.only or PROGRAMS
    turns = {program: [] for program in programs}
    for turn in range(options.turns):
        for program in programs:
            print(f"Turn {turn + 1} of {options.turns}: {program}", file=sys.stderr)
            result = flights.fly(program)
            (FOLDER / f"flight_{program}.json").write_text(json.dumps(result), encoding="utf-8")
            turns[program].append(row_of(result))
    rows, bars = [], []
    for program in programs:
        row = {"program": program, **of_turns(turns[program])}
        is_ours = program != "cesium"
        counts = count_cracks(flights, program) if is_ours and not options.no_cracks else {}
        row.update({name: counts.get(name) for name in ("cracks", "crack_pictures", "while_loading")})
        rows.append(row)
        if is_ours:
            bars += bars_of(program, row)
    if not options.no_pictures:
        take_pictures(flights, [DEFAULT_SURFACE, "cesium"])
    return measuring.finish("web", rows, bars)


def bars_of(surface, row):
    """What must hold of ours. Triangles are the mean of the frames, draw calls those of the frame that has the most."""
    bars = [
        measuring.at_most(f"{surface}_requests", row["requests"], 90),
        measuring.at_most(f"{surface}_megabytes", row["mb"], 3.5, "MB"),
        measuring.at_most(f"{surface}_triangles_millions", row["triangles"] / 1e6, TRIANGLES_MILLIONS[surface]),
        measuring.at_most(f"{surface}_draw_calls", row["draw_calls_max"], 10),
        measuring.at_most(f"{surface}_main_thread_ms", row["main_thread_ms"], 4, "ms"),
        measuring.at_most(f"{surface}_long_tasks", row["long_tasks"], 0),
        measuring.at_most(f"{surface}_first_picture_s", row["first_picture_s"], 1, "s"),
    ]
    if row["cracks"] is not None:
        bars.append(measuring.at_most(f"{surface}_cracks", row["cracks"], 0))
    return bars


measuring.main(bench)
