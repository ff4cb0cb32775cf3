#!/usr/bin/env python3
"""CPU time and memory of a build beside GDAL's Cloud Optimized GeoTIFF: ./dev bench build [--small]

Both read the same GeoTIFF of made-up terrain, with as many threads, one after the other in pairs; the median of
the pairs' ratios counts. The larger size is built with 500 MiB, far less than it is, and shows what memory that
takes. --small leaves it out.
"""

import argparse
import os
import shutil
import statistics
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "support"))
import measuring  # noqa: E402

SMALL = 4097
LARGE = 16385
MEMORY_BYTES = 500 << 20
KINDS = {"int16": "i16", "float32": "f32"}


def build(source, out, threads, memory):
    """What `terrane build` costs; the dataset is gone afterwards."""
    command = [measuring.TERRANE, "build", source, "-o", out, "--overwrite", "-q", "--threads", threads]
    try:
        return measuring.cost_of(command + (["--memory", memory] if memory else []))
    finally:
        shutil.rmtree(out, ignore_errors=True)


def cog(source, out, threads):
    """What GDAL's COG of the same file costs."""
    options = ["COMPRESS=ZSTD", "PREDICTOR=YES", f"NUM_THREADS={threads}"]
    command = ["gdal_translate", "-q", "-of", "COG"]
    for option in options:
        command += ["-co", option]
    try:
        return measuring.cost_of(command + [source, out])
    finally:
        out.unlink(missing_ok=True)


def measure(size, kind, repeats, threads):
    source = measuring.synth(size, kind)
    memory = MEMORY_BYTES if size == LARGE else 0
    pairs = []
    for turn in range(repeats):
        print(f"Building {source.name}, {turn + 1} of {repeats}", file=sys.stderr)
        ours = build(source, measuring.DATA / "bench_build.terrane", threads, memory)
        theirs = cog(source, measuring.DATA / "bench_build_cog.tif", threads)
        pairs.append((ours, theirs))
    samples = size * size
    return {
        "samples_a_side": size,
        "type": kind,
        "pairs": repeats,
        "ours_cpu_s": statistics.median(ours.cpu for ours, _ in pairs),
        "cog_cpu_s": statistics.median(theirs.cpu for _, theirs in pairs),
        "cpu_ratio": statistics.median(ours.cpu / theirs.cpu for ours, theirs in pairs),
        "ours_ns_a_sample": statistics.median(ours.cpu for ours, _ in pairs) / samples * 1e9,
        "ours_wall_s": statistics.median(ours.wall for ours, _ in pairs),
        "cog_wall_s": statistics.median(theirs.wall for _, theirs in pairs),
        "ours_peak_mb": max(ours.peak for ours, _ in pairs) / 1e6,
        "cog_peak_mb": max(theirs.peak for _, theirs in pairs) / 1e6,
        "memory_option_mb": memory / 1e6 if memory else None,
    }


def bench():
    parser = argparse.ArgumentParser(prog="./dev bench build", description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--small", action="store_true", help=f"only {SMALL} samples a side")
    parser.add_argument("--pairs", type=int, default=5, help=f"builds of each kind at {SMALL} (default 5)")
    parser.add_argument("--large-pairs", type=int, default=1, help=f"the same at {LARGE} (default 1)")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="for both (default: all cores)")
    options = parser.parse_args()

    rows = []
    bars = []
    over_budget = []
    for size, repeats in ((SMALL, options.pairs), (LARGE, 0 if options.small else options.large_pairs)):
        for kind, short in KINDS.items():
            if repeats == 0:
                continue
            row = measure(size, kind, repeats, options.threads)
            rows.append(row)
            bars.append(measuring.at_most(f"cpu_vs_cog_{size}_{short}", row["cpu_ratio"], 1.0))
            if row["memory_option_mb"]:
                over_budget.append(row["ours_peak_mb"] - row["memory_option_mb"])
    if over_budget:
        bars.append(measuring.at_most("rss_over_budget_mb", max(over_budget), 300.0, "MB"))
    return measuring.finish("build", rows, bars)


measuring.main(bench)
