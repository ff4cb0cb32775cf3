#!/usr/bin/env bash
# Expanding compact meshes on CPU and GPU beside uploading them, and ways to draw them: ./dev bench mesh_decode
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh
exec build/release/bin/measure_mesh_decode build/bench/mesh_decode.json "${datasets[@]}"
