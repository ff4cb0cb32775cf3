#!/usr/bin/env bash
# Triangles of `patches` against a uniform grid-per-tile level of detail: ./dev bench patches
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh
usual_datasets
exec build/release/bin/measure_patches bench/flights build/bench/patches.json "${datasets[@]}"
