#!/usr/bin/env bash
# Patches and meshes side by side on one flight: ./dev bench surfaces
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh
page_datasets
exec build/release/bin/measure_surfaces "$@" bench/measure_surfaces/flight.json build/bench/surfaces.json "${datasets[@]}"
