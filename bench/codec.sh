#!/usr/bin/env bash
# Bits a sample and decode speed of elevation beside PNG, LERC, JPEG XL and zstd: ./dev bench codec [NAME...]
#
# Names pick some of the inputs, for quick turns: "./dev bench codec zion mt_hood". What the other codecs make
# of an input is kept in build/bench/codec_others.json and measured only once.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# shellcheck source=bench/support/codec_inputs.sh
source bench/support/codec_inputs.sh
check_names "$@"
choose_inputs "$@"

mkdir -p "$bench_data/codec"
arguments=()
for entry in "${inputs[@]}"; do
  name=${entry%%=*}
  echo "Building $name" >&2
  input=$(input_of "$name" "${entry#*=}")
  lossless=$bench_data/codec/$name.terrane
  build_one "$input" "$lossless"
  arguments+=("$input" "$lossless")
  for share in 0.5 0.25; do
    build_one "$input" "$bench_data/codec/${name}_$share.terrane" \
      --max-error "$(share_of_spacing "$lossless" $share)"
    arguments+=("$bench_data/codec/${name}_$share.terrane")
  done
done
exec build/release/bin/measure_codec build/bench/codec.json build/bench/codec_others.json "${arguments[@]}"
