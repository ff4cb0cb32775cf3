#!/usr/bin/env python3
"""CPU time, bytes and PSNR of imagery beside GDAL's JPEG COG: ./dev bench imagery

Pictures: the colours of made-up country, and a Landsat scene where the test data stands beside the repository. Each
is laid on a flat grid sixteen times coarser, so that its pixels are texels and nothing but the imagery costs much; the
time of a build without imagery is taken off. Ours is built with the default format and quality, and as JPEG. The same
picture half a pixel off must be resampled and is a row of its own. The COG has our JPEG's quality and all overviews. CPU
time is user and system, the median of three.
"""
import os
import resource
import statistics
import subprocess
import sys

TERRANE = "build/release/bin/terrane"
DATA = "build/bench/data"
LANDSAT = "../shared/data/zion/landsat8_zion_rgb8.tif"
JPEG_QUALITY = 80
RUNS = 3
COARSER = 16


def run(*command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def cpu_seconds(*command):
    """The median CPU time of a command and its children."""
    times = []
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run(*command)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return statistics.median(times)


def measure(name, source, width, height, pixel):
    """Nine arguments of measure_imagery for one picture."""
    print(f"{name}: {width} x {height}", file=sys.stderr)
    picture, moved, grid, cog, dataset, as_jpeg = (
        f"{DATA}/imagery_{name}{end}"
        for end in (".tif", "_moved.tif", "_grid.tif", "_cog.tif", ".terrane", "_jpeg.terrane"))
    west, north, step = 500000, 6700000, pixel * COARSER
    cols, rows = -(-width // COARSER) + 1, -(-height // COARSER) + 1

    def place(x, y):
        return [str(v) for v in (x, y, x + width * pixel, y - height * pixel)]

    plain = ["-q", "-a_srs", "EPSG:32632", "-co", "TILED=YES", "-srcwin", "0", "0", str(width), str(height)]
    run("gdal_translate", *plain, "-a_ullr", *place(west, north), source, picture)
    run("gdal_translate", *plain, "-a_ullr", *place(west - pixel / 2, north + pixel / 2), source, moved)
    if os.path.exists(grid):
        os.remove(grid)
    corner = [west - step / 2, north + step / 2, west + (cols - 0.5) * step, north - (rows - 0.5) * step]
    run("gdal_create", "-outsize", str(cols), str(rows), "-bands", "1", "-burn", "100", "-ot", "Int16", "-a_srs",
        "EPSG:32632", "-a_ullr", *[str(v) for v in corner], grid)

    build = [TERRANE, "build", grid, "-q", "--overwrite", "-o"]
    bare = cpu_seconds(*build, f"{DATA}/imagery_bare.terrane")
    resampled = cpu_seconds(*build, dataset, "--imagery", moved)
    ours = cpu_seconds(*build, dataset, "--imagery", picture)
    jpeg = cpu_seconds(*build, as_jpeg, "--imagery-format", "jpeg", "--imagery-quality", str(JPEG_QUALITY), "--imagery",
                       picture)
    gdal = cpu_seconds("gdal_translate", "-q", "-of", "COG", "-co", "COMPRESS=JPEG", "-co", f"QUALITY={JPEG_QUALITY}",
                       picture, cog)
    times = [ours - bare, jpeg - bare, gdal, resampled - bare]
    return [name, dataset, as_jpeg, picture, cog, *[f"{seconds:.4f}" for seconds in times]]


def main():
    os.makedirs(DATA, exist_ok=True)
    made = f"{DATA}/imagery_made_color.tif"
    if not os.path.exists(made):
        run(TERRANE, "synth", "-q", "--overwrite", "--size", "4097", "-o", f"{DATA}/imagery_made.tif", "--color", made)
    arguments = measure("made_up", made, 4096, 4096, 10)
    if os.path.exists(LANDSAT):
        arguments += measure("landsat", LANDSAT, 1128, 1428, 30)
    else:
        print(f"{LANDSAT} is absent: made-up country alone", file=sys.stderr)
    sys.exit(subprocess.run(["build/release/bin/measure_imagery", "build/bench/imagery.json", *arguments],
                            check=False).returncode)


if __name__ == "__main__":
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    main()
