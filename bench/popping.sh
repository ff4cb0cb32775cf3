#!/usr/bin/env bash
# How far the ground pops on screen from frame to frame, with morphing and without:
# ./dev bench popping [--surface patches|meshes]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh
usual_datasets
exec build/release/bin/measure_popping "$@" bench/flights build/bench/popping.json "${datasets[@]}"
