#!/usr/bin/env bash
# Adaptive meshes beside the strips of Dick et al., full grids and greedy Delaunay triangles:
# ./dev bench meshes [--whole] [NAME...]
#
# Names pick some of the inputs of the codec bench. What the other codecs make of a grid is taken from that bench's
# build/bench/codec_others.json, or measured and left there. Where build/web holds the decoder (./dev build web all measure_mesh_decoding), it
# runs in node as well. --whole measures instead what whole datasets take, in build/bench/meshes_whole.json: a made-up one
# of 16385 samples a side, which takes a while and 8 GB of memory, and the largest two that are here.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# shellcheck source=bench/support/codec_inputs.sh
source bench/support/codec_inputs.sh

readonly folder=$bench_data/meshes
readonly web_decoder=build/web/bin/measure_mesh_decoding.js
# Builds are measured in turns, and the median counts.
readonly turns=3

# Builds a dataset in turns; gives the CPU seconds, user and system, of one.
timed_build() {
  local input=$1 out=$2 turn
  shift 2
  local TIMEFORMAT='%U %S'
  for ((turn = 0; turn < turns; turn++)); do
    { time "$terrane" build "$input" -o "$out" --overwrite -q "$@" 2>&3; } 3>&2 2>&1
  done | awk '{ print $1 + $2 }' | sort -g | sed -n "$((turns / 2 + 1))p"
}

# Adds an input and its two datasets to `arguments`, and the datasets to `datasets`.
add_input() {
  local name=$1 input=$2 share out seconds
  echo "Building $name" >&2
  build_one "$input" "$folder/$name.terrane"
  arguments+=("$name" "$input")
  for share in 0.5 0.25; do
    out=$folder/${name}_$share.terrane
    seconds=$(timed_build "$input" "$out" --max-error "$(share_of_spacing "$folder/$name.terrane" $share)")
    arguments+=("$out" "$seconds")
    datasets+=("$out")
  done
}

measure_whole() {
  local demo=$bench_data/synth_16385_int16.tif
  if [[ ! -f $demo ]]; then
    "$terrane" synth -o "$demo" --size 16385 --seed 1 --type int16 -q
  fi
  local name
  for name in moon_gld100_4096/moon_gld100_4096 california_3s/california_nevada_3s; do
    if [[ -f $real_data/$name.tif ]]; then
      add_input "${name#*/}" "$real_data/$name.tif"
    fi
  done
  add_input demo_16385 "$demo"
  exec build/release/bin/measure_whole_meshes build/bench/meshes_whole.json "${arguments[@]}"
}

# What the decoder does in node, for every dataset; "-" where it has not been built.
decode_in_node() {
  if [[ ! -f $web_decoder ]]; then
    echo "There is no $web_decoder: decoding in WebAssembly is left out; ./dev build web all measure_mesh_decoding makes it" >&2
    echo -
    return
  fi
  echo "Decoding in node" >&2
  node --no-experimental-fetch "$web_decoder" "${datasets[@]}" >build/bench/meshes_web.json
  echo build/bench/meshes_web.json
}

mkdir -p "$folder"
arguments=()
datasets=()
if [[ ${1:-} == --whole ]]; then
  measure_whole
fi
check_names "$@"
choose_inputs "$@"
for entry in "${inputs[@]}"; do
  name=${entry%%=*}
  add_input "$name" "$(input_of "$name" "${entry#*=}")"
done
web=$(decode_in_node)
exec build/release/bin/measure_meshes build/bench/meshes.json build/bench/codec_others.json "$web" "${arguments[@]}"
