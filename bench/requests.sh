#!/usr/bin/env bash
# Where requests and bytes of a streamed flight go: ./dev bench requests
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh
demo=$(demo_4097)
bench_dataset demo_web "$demo.tif" --max-error 1 --imagery "${demo}_color.tif"
if [[ -f $real_data/california_3s/california_nevada_3s.tif ]]; then
  bench_dataset california_pictured "$real_data/california_3s/california_nevada_3s.tif" \
    --imagery "$real_data/california_3s/bluemarble_z8_3857.tif"
fi
real_dataset moon moon_gld100_4096/moon_gld100_4096.tif 14
exec build/release/bin/measure_requests "$@" bench/measure_surfaces/flight.json build/bench/requests.json "${datasets[@]}"
