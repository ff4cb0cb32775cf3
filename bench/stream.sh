#!/usr/bin/env bash
# Streaming over a simulated line, in simulated time: ./dev bench stream [--only SETTING]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh

if [[ -f $real_data/california_3s/california_nevada_3s.tif ]]; then
  bench_dataset california_pictured "$real_data/california_3s/california_nevada_3s.tif" \
    --imagery "$real_data/california_3s/bluemarble_z8_3857.tif"
else
  echo "$real_data/california_3s is absent: only the demo is flown over" >&2
fi
demo=$(demo_4097)
bench_dataset demo_pictured "$demo.tif" --imagery "${demo}_color.tif"
# The same heights in layers of significance and not, for lines that cannot keep up.
bench_dataset demo_web "$demo.tif" --max-error 1 --imagery "${demo}_color.tif"
bench_dataset demo_layers "$demo.tif" --max-error 1 --layers auto --imagery "${demo}_color.tif"
exec build/release/bin/measure_stream "$@" bench/measure_stream/flight.json build/bench/stream.json "${datasets[@]}"
