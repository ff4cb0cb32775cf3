#!/usr/bin/env bash
# Streaming over a simulated line, in simulated time: ./dev bench stream [--only SETTING]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/support/datasets.sh
source bench/support/datasets.sh

# A dataset NAME of INPUT with PICTURE over it.
pictured_dataset() {
  local name=$1 input=$2 picture=$3
  local out=$bench_data/$name.terrane
  if [[ ! $out/manifest.json -nt $terrane ]]; then
    echo "Building $out" >&2
    "$terrane" build "$input" -o "$out" --imagery "$picture" --overwrite -q
  fi
  datasets+=("$out")
}

datasets=()
if [[ -f $real_data/california_3s/california_nevada_3s.tif ]]; then
  pictured_dataset california_pictured "$real_data/california_3s/california_nevada_3s.tif" \
    "$real_data/california_3s/bluemarble_z8_3857.tif"
else
  echo "$real_data/california_3s is absent: only the demo is flown over" >&2
fi
demo=$bench_data/demo_4097
if [[ ! $demo.tif -nt $terrane ]]; then
  echo "Making $demo.tif" >&2
  "$terrane" synth -o "$demo.tif" --color "${demo}_color.tif" --size 4097 --seed 1 --overwrite -q
fi
pictured_dataset demo_pictured "$demo.tif" "${demo}_color.tif"
exec build/release/bin/measure_stream "$@" bench/measure_stream/flight.json build/bench/stream.json "${datasets[@]}"
