#!/usr/bin/env bash
# Where requests and bytes of a streamed flight go: ./dev bench requests
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh
page_datasets
exec build/release/bin/measure_requests "$@" bench/measure_surfaces/flight.json build/bench/requests.json "${datasets[@]}"
