#!/usr/bin/env bash
# Error in pixels and cracks of what is drawn, on three datasets: ./dev bench error [--surface NAME]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh
usual_datasets
exec build/release/bin/measure_error "$@" bench/flights build/bench/error.json "${datasets[@]}"
