"""What the benches in Python share: results in the shape of bench_result.h, and what a command costs."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

TERRANE = Path("build/release/bin/terrane")
DATA = Path("build/bench/data")


class Failure(Exception):
    """Something that ends a bench, in words."""


def describe_machine():
    processor = "unknown processor"
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name") and ": " in line:
            processor = line.split(": ", 1)[1]
            break
    system = "unknown system"
    release = Path("/etc/os-release")
    for line in release.read_text(encoding="utf-8").splitlines() if release.exists() else []:
        if line.startswith('PRETTY_NAME="'):
            system = line[13:-1]
    return f"{processor}, {os.cpu_count()} cores, {system}"


def at_most(name, value, bar, unit=""):
    """A number that must hold."""
    return {"name": name, "value": value, "unit": unit, "side": "at most", "bar": bar, "holds": value <= bar}


def at_least(name, value, bar, unit=""):
    """A number that must hold."""
    return {"name": name, "value": value, "unit": unit, "side": "at least", "bar": bar, "holds": value >= bar}


def _cell(value):
    if value is None:
        return "-"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _print_columns(rows):
    texts = [[isinstance(value, str) for value in row] for row in rows]
    left = texts[-1]
    cells = [[_cell(value) for value in row] for row in rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(left))]
    for row in cells:
        line = (f"{text:<{width}}" if is_left else f"{text:>{width}}" for text, width, is_left in zip(row, widths, left))
        print("  ".join(line).rstrip())


def finish(bench, rows, bars):
    """Prints rows and bars, writes build/bench/NAME.json; gives the exit status."""
    if rows:
        _print_columns([list(rows[0])] + [list(row.values()) for row in rows])
        print()
    lines = [["bar", "value", "must be", ""]]
    for bar in bars:
        unit = " " + bar["unit"] if bar["unit"] else ""
        value = f"{bar['value']:.4g}{unit}"
        must = f"{bar['side']} {bar['bar']:.4g}{unit}"
        lines.append([bar["name"], value, must, "holds" if bar["holds"] else "DOES NOT HOLD"])
    _print_columns(lines)

    result = {"bench": bench, "machine": describe_machine(), "rows": rows, "bars": bars}
    out = Path("build/bench") / f"{bench}.json"
    out.parent.mkdir(parents=True, exist_ok=True)
    part = out.with_suffix(".json.part")
    part.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    part.replace(out)
    if all(bar["holds"] for bar in bars):
        return 0
    print(f"{bench}: a bar does not hold", file=sys.stderr)
    return 1


def run(arguments):
    """Runs a command to its end; its output, or a Failure with what it said."""
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Failure(f"{arguments[0]}: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout


class Cost:
    """CPU seconds (of all threads and children), wall seconds and peak memory in bytes of one command."""

    def __init__(self, cpu, wall, peak):
        self.cpu = cpu
        self.wall = wall
        self.peak = peak


def cost_of(arguments):
    begin = time.monotonic()
    process = subprocess.Popen(
        [str(a) for a in arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    said = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    process.stderr.close()
    if process.returncode != 0:
        raise Failure(f"{arguments[0]} {arguments[1]}: {said.strip() or f'exit status {process.returncode}'}")
    peak = usage.ru_maxrss * 1024
    return Cost(usage.ru_utime + usage.ru_stime, time.monotonic() - begin, peak)


def synth(size, kind):
    """The demo's terrain, made once: int16 or float32, `size` samples a side."""
    DATA.mkdir(parents=True, exist_ok=True)
    path = DATA / f"synth_{size}_{kind}.tif"
    if not path.exists():
        print(f"Making {path}", file=sys.stderr)
        run([TERRANE, "synth", "-o", path, "--size", size, "--seed", 1, "--type", kind, "-q"])
    return path


def main(body):
    """Runs a bench from the root of the repository."""
    os.chdir(Path(__file__).resolve().parent.parent.parent)
    try:
        sys.exit(body())
    except Failure as failure:
        print(failure, file=sys.stderr)
        sys.exit(1)
