#!/usr/bin/env python3
"""terrane serve beside nginx on the same files: ./dev bench serve [--seconds N] [--turns N] [--dataset D]

wrk asks both for the same things over loopback, in turns: random single tiles (stored files of the same bytes in
nginx), and random ranges of 16 to 256 KiB of the archive, with 2, 16, 64 and 256 connections.
"""

import argparse
import getpass
import json
import os
import random
import shutil
import socket
import statistics
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "support"))
import measuring  # noqa: E402

FOLDER = Path("build/bench/serve")
REAL = Path("../shared/data/california_3s/california_nevada_3s.tif")
CONNECTIONS = [2, 16, 64, 256]
KINDS = ["small_tiles", "ranges"]
TILES = 2000
RANGES = 4000
THREADS = 2
NEEDED = {"wrk": "wrk", "nginx": "nginx-light"}

NGINX = """
worker_processes {threads};
daemon off;
pid {folder}/nginx.pid;
error_log {folder}/nginx.log;
{user}
events {{ worker_connections 1024; }}
http {{
  access_log off;
  sendfile on;
  keepalive_requests 1000000000;
  open_file_cache max=10000;
  default_type application/octet-stream;
  client_body_temp_path {folder}/temp; proxy_temp_path {folder}/temp; fastcgi_temp_path {folder}/temp;
  uwsgi_temp_path {folder}/temp; scgi_temp_path {folder}/temp;
  server {{ listen 127.0.0.1:{port} backlog=1024; root {folder}/root; }}
}}
"""


def require_programs():
    missing = [package for program, package in NEEDED.items() if not (shutil.which(program) or Path(f"/usr/sbin/{program}").exists())]
    if missing:
        raise measuring.Failure(
            f"Debian packages are missing; as root: apt-get install -y --no-install-recommends {' '.join(missing)}"
        )


def dataset(given):
    if given:
        return Path(given)
    out = measuring.DATA / "serve.terrane"
    if not (out / "manifest.json").exists():
        source = REAL if REAL.exists() else measuring.synth(4097, "int16")
        print(f"Building {out} from {source}", file=sys.stderr)
        measuring.DATA.mkdir(parents=True, exist_ok=True)
        measuring.run([measuring.TERRANE, "build", source, "-o", out, "--overwrite", "-q"])
    return out


def get(url):
    with urllib.request.urlopen(url, timeout=30) as answer:
        return answer.read(), answer.status


def tile_addresses(base, levels):
    """Stored tiles, chosen at random with a fixed seed among those that a descent over what is stored meets."""
    chosen, wave = {}, [(0, 0, 0)]
    chance = random.Random(7)
    for level in range(levels + 1):
        chance.shuffle(wave)
        below = []
        for address in wave[:TILES]:
            body, status = get(base + "elevation/{}/{}/{}".format(*address))
            if status != 200:
                continue
            chosen[address] = body
            _, col, row = address
            below += [(level + 1, 2 * col + (q & 1), 2 * row + (q >> 1)) for q in range(4)]
        wave = below
    addresses = sorted(chosen)
    chance.shuffle(addresses)
    return {address: chosen[address] for address in addresses[:TILES]}


def write_requests(base_path, root, tiles, archive_bytes):
    """What wrk asks each server for, and the tiles as files."""
    ours, theirs = [], []
    for (level, col, row), body in tiles.items():
        path = root / "tiles" / str(level) / str(col) / str(row)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(body)
        ours.append(f"{base_path}elevation/{level}/{col}/{row}")
        theirs.append(f"/tiles/{level}/{col}/{row}")
    chance = random.Random(11)
    ranges = []
    for _ in range(RANGES):
        length = min(archive_bytes, chance.randint(16 << 10, 256 << 10))
        begin = chance.randint(0, archive_bytes - length)
        ranges.append(f"{begin}-{begin + length - 1}")
    lists = {
        ("ours", "small_tiles"): ours,
        ("nginx", "small_tiles"): theirs,
        ("ours", "ranges"): [f"{base_path}elevation.pmtiles\t{r}" for r in ranges],
        ("nginx", "ranges"): [f"/elevation.pmtiles\t{r}" for r in ranges],
    }
    for (server, kind), lines in lists.items():
        (FOLDER / f"{server}_{kind}.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


def start_nginx():
    folder = FOLDER.resolve()
    user = f"user {getpass.getuser()};" if getpass.getuser() == "root" else ""
    # A free port: the one that a listening socket was just given.
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    config = folder / "nginx.conf"
    config.write_text(NGINX.format(threads=THREADS, folder=folder, user=user, port=port), encoding="utf-8")
    program = shutil.which("nginx") or "/usr/sbin/nginx"
    process = subprocess.Popen([program, "-e", f"{folder}/nginx.log", "-p", str(folder), "-c", str(config)])
    deadline = time.monotonic() + 10
    while True:
        try:
            get(f"http://127.0.0.1:{port}/manifest.json")
            return process, f"http://127.0.0.1:{port}"
        except OSError:
            if process.poll() is not None or time.monotonic() > deadline:
                raise measuring.Failure(f"nginx does not start; see {folder}/nginx.log") from None


def rss_bytes(pid):
    for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024
    raise measuring.Failure("terrane serve has ended")


def cpu_seconds(pid):
    """User and system time of a server and its workers."""
    ticks = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text(encoding="utf-8").rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(stat.parent.name) == pid or int(fields[1]) == pid:
            ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def wrk(url, server, kind, connections, seconds):
    said = measuring.run(
        ["wrk", "-t1", f"-c{connections}", f"-d{seconds}s", "--timeout", "10s", "-s", "bench/support/serve.lua", url]
        + ["--", FOLDER / f"{server}_{kind}.txt"]
    )
    line = [line for line in said.splitlines() if line.startswith("RESULT ")][0]
    return json.loads(line[7:])


def measure(urls, pids, seconds, turns):
    for server, url in urls.items():
        for kind in KINDS:
            wrk(url, server, kind, 256, min(seconds, 2))
    rss_before = rss_bytes(pids["ours"])
    results = {}
    for turn in range(turns):
        print(f"Turn {turn + 1} of {turns}", file=sys.stderr)
        for kind in KINDS:
            for connections in CONNECTIONS:
                for server, url in urls.items():
                    before = cpu_seconds(pids[server])
                    turn_result = wrk(url, server, kind, connections, seconds)
                    turn_result["cpu_us"] = (cpu_seconds(pids[server]) - before) * 1e6 / turn_result["requests"]
                    results.setdefault((kind, connections, server), []).append(turn_result)
    return results, (rss_bytes(pids["ours"]) - rss_before) / 1e6, rss_before / 1e6


def bench():
    parser = argparse.ArgumentParser(prog="./dev bench serve", description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=int, default=2, help="of each measurement (2); there are 16 a turn")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--dataset", help="instead of California at 3 seconds, or of made-up terrain")
    options = parser.parse_args()
    require_programs()
    data = dataset(options.dataset)
    shutil.rmtree(FOLDER, ignore_errors=True)
    root = FOLDER / "root"
    root.mkdir(parents=True)
    for name in ("manifest.json", "elevation.pmtiles"):
        shutil.copy(data / name, root / name)

    running = []
    try:
        ours = subprocess.Popen(
            [measuring.TERRANE, "serve", data, "--port", "0", "-q", "--threads", str(THREADS)], stdout=subprocess.PIPE, text=True
        )
        running.append(ours)
        ours_url = ours.stdout.readline().strip()
        if not ours_url:
            raise measuring.Failure("terrane serve did not start")
        served = json.loads(get(ours_url + "datasets.json")[0])["datasets"][0]
        levels = json.loads(measuring.run([measuring.TERRANE, "info", data, "--json"]))["finest_level"]
        tiles = tile_addresses(ours_url + served["immutable"][1:], levels)
        write_requests(served["immutable"], root, tiles, served["files"][0]["bytes"])
        nginx, nginx_url = start_nginx()
        running.append(nginx)
        urls = {"ours": ours_url.rstrip("/"), "nginx": nginx_url}
        results, growth, rss = measure(urls, {"ours": ours.pid, "nginx": nginx.pid}, options.seconds, options.turns)
    finally:
        for process in running:
            process.terminate()
        for process in running:
            process.wait(timeout=30)

    rows, ratios, errors = [], {kind: [] for kind in KINDS}, 0
    for kind in KINDS:
        for connections in CONNECTIONS:
            rates, row = {}, {"what": kind, "connections": connections}
            for server in urls:
                turns = results[(kind, connections, server)]
                rates[server] = [turn["requests"] / turn["us"] * 1e6 for turn in turns]
                row[f"{server}_per_s"] = statistics.median(rates[server])
                row[f"{server}_mb_s"] = statistics.median(turn["bytes"] / turn["us"] for turn in turns)
                row[f"{server}_cpu_us"] = statistics.median(turn["cpu_us"] for turn in turns)
                row[f"{server}_p50_ms"] = statistics.median(turn["p50_us"] for turn in turns) / 1e3
                row[f"{server}_p99_ms"] = statistics.median(turn["p99_us"] for turn in turns) / 1e3
                if server == "ours":
                    errors += sum(turn["errors"] for turn in turns)
            of_turns = [a / b for a, b in zip(rates["ours"], rates["nginx"])]
            row["ratio"] = statistics.median(of_turns)
            row["lowest"] = min(of_turns)
            row["highest"] = max(of_turns)
            ratios[kind].append(row["ratio"])
            rows.append(row)
    sizes = [len(body) for body in tiles.values()]
    print(f"{len(tiles)} tiles, {statistics.median(sizes):.0f} bytes in the median; terrane serve takes {rss:.1f} MB\n")
    bars = [
        measuring.at_most("errors", errors, 0),
        measuring.at_least("small_tiles_vs_nginx", min(ratios["small_tiles"]), 0.5),
        measuring.at_least("ranges_vs_nginx", min(ratios["ranges"]), 0.8),
        measuring.at_most("rss_growth_mb", growth, 8, "MB"),
    ]
    return measuring.finish("serve", rows, bars)


measuring.main(bench)
