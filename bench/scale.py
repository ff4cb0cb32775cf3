#!/usr/bin/env python3
"""What a frame and a build cost as the dataset grows around the same ground: ./dev bench scale [--long]

The middle of every size that `terrane synth` makes is the same place, sample for sample. The same flight
(support/scale_flight.json) goes over it in each; it looks steeply down, so that all ground in the picture lies
within the smallest size and what a larger one adds is never seen. --long takes 65537 samples a side as well,
some 60 GB of disk for a while, and hours.
"""

import argparse
import json
import shutil
import statistics
import struct
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "support"))
import measuring  # noqa: E402

SIZES = [4097, 16385]
LONG_SIZE = 65537
LONG_DISK_BYTES = 60e9
FLIGHT = Path("bench/support/scale_flight.json")
FRAMES = 21
MEMORY = "1G"
FRAME_COSTS = ["triangles", "tiles", "bytes", "memory"]


def opening_bytes(dataset):
    """What a client reads before its first tile: the manifest, and the archive's header and directories."""
    with open(dataset / "elevation.pmtiles", "rb") as archive:
        header = archive.read(127)
    root, _, _, leaves = (struct.unpack_from("<Q", header, at)[0] for at in (16, 24, 32, 48))
    return (dataset / "manifest.json").stat().st_size + 127 + root + leaves


def fly(dataset):
    """The flight's report, and its frames' costs: means of counts, bytes read after the first, the most memory."""
    report = json.loads(
        measuring.run([measuring.TERRANE, "bench", dataset, "--flight", FLIGHT, "--frames", FRAMES, "--json"])
        .strip()
        .splitlines()[-1]
    )
    summary = report["summary"]
    costs = {name: summary[name]["mean"] for name in ("triangles", "tiles")}
    # note: the first frame also reads what stands between the root and the ground, up to four tiles a level.
    # That is paid once and grows with the number of levels, so it stands in a column of its own.
    costs["bytes"] = sum(frame["bytes"] for frame in report["frames"][1:])
    costs["memory"] = summary["memory"]
    return costs, report


def measure(size, kind, builds):
    source = measuring.synth(size, kind)
    dataset = measuring.DATA / f"scale_{size}.terrane"
    command = [measuring.TERRANE, "build", source, "-o", dataset, "--overwrite", "-q", "--memory", MEMORY]
    print(f"Building {dataset}", file=sys.stderr)
    costs = [measuring.cost_of(command) for _ in range(builds)]
    print(f"Flying over {dataset}", file=sys.stderr)
    frame_costs, report = fly(dataset)
    archive = (dataset / "elevation.pmtiles").stat().st_size
    row = {
        "samples_a_side": size,
        **frame_costs,
        "select_ms": report["summary"]["select_ms"]["p50"],
        "first_frame_bytes": report["frames"][0]["bytes"],
        "opening_bytes": opening_bytes(dataset),
        "archive_mb": archive / 1e6,
        "build_ns_a_sample": statistics.median(cost.cpu for cost in costs) / size / size * 1e9,
        "build_peak_mb": max(cost.peak for cost in costs) / 1e6,
        "build_wall_s": statistics.median(cost.wall for cost in costs),
    }
    shutil.rmtree(dataset)
    if size == LONG_SIZE:
        source.unlink()
    return row, [frame["triangles"] for frame in report["frames"]]


def bench():
    parser = argparse.ArgumentParser(prog="./dev bench scale", description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--long", action="store_true", help=f"{LONG_SIZE} samples a side, too")
    parser.add_argument("--type", choices=["int16", "float32"], default="int16", help="of the samples")
    options = parser.parse_args()

    sizes = SIZES + ([LONG_SIZE] if options.long else [])
    measuring.DATA.mkdir(parents=True, exist_ok=True)
    free = shutil.disk_usage(measuring.DATA).free
    if options.long and free < LONG_DISK_BYTES:
        raise measuring.Failure(
            f"{measuring.DATA}: {free / 1e9:.0f} GB are free, --long needs {LONG_DISK_BYTES / 1e9:.0f} GB"
        )

    rows = []
    flights = []
    for size in sizes:
        # note: a small build is short, so one alone says little.
        row, triangles = measure(size, options.type, 3 if size == SIZES[0] else 1)
        rows.append(row)
        flights.append(triangles)

    # Everything beside the smallest size.
    for row, triangles in zip(rows, flights):
        row["frame_growth"] = max(row[cost] / rows[0][cost] for cost in FRAME_COSTS)
        row["worst_frame"] = max(a / b for a, b in zip(triangles, flights[0]))
        row["build_growth"] = row["build_ns_a_sample"] / rows[0]["build_ns_a_sample"]
    bars = [
        measuring.at_most("frame_cost_growth", max(row["frame_growth"] for row in rows[1:]), 1.1),
        measuring.at_most("build_cost_growth", max(row["build_growth"] for row in rows[1:]), 1.15),
    ]
    return measuring.finish("scale", rows, bars)


measuring.main(bench)
