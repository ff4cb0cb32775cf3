# The datasets that benches measure on, built where they are missing or older than the program: real ones where
# the test data stands beside the repository, and the demo. Sourced; the functions add to the array `datasets`.
# shellcheck shell=bash

readonly terrane=build/release/bin/terrane
readonly real_data=../shared/data
readonly bench_data=build/bench/data

# Builds a dataset NAME from INPUT, quietly, if need be; more arguments are options of the build.
bench_dataset() {
  local name=$1 input=$2
  shift 2
  local out=$bench_data/$name.terrane
  if [[ ! $out/manifest.json -nt $terrane ]]; then
    echo "Building $out" >&2
    "$terrane" build "$input" -o "$out" "$@" --overwrite -q
  fi
  datasets+=("$out")
}

# Makes the demo with 4097 samples a side and the picture that lies over it, if need be: prints its path
# without ".tif".
demo_4097() {
  local demo=$bench_data/demo_4097
  if [[ ! $demo.tif -nt $terrane ]]; then
    echo "Making $demo.tif" >&2
    "$terrane" synth -o "$demo.tif" --color "${demo}_color.tif" --size 4097 --seed 1 --overwrite -q
  fi
  echo "$demo"
}

# A synthetic terrain of SIZE samples a side as a dataset.
synthetic_dataset() {
  local name=$1 size=$2 seed=$3
  local tif=$bench_data/$name.tif
  if [[ ! $tif -nt $terrane ]]; then
    echo "Making $tif" >&2
    rm -f "$tif"
    "$terrane" synth -o "$tif" --size "$size" --seed "$seed" -q
  fi
  bench_dataset "$name" "$tif"
}

# A real dataset where there is one, else a synthetic one with another seed in its place.
real_dataset() {
  local name=$1 file=$2 seed=$3
  if [[ -f $real_data/$file ]]; then
    bench_dataset "$name" "$real_data/$file"
  else
    echo "$real_data/$file is absent: made-up terrain stands in for it" >&2
    synthetic_dataset "stand_in_$seed" 1025 "$seed"
  fi
}

datasets=()
mkdir -p "$bench_data"

# The four that most benches take.
usual_datasets() {
  real_dataset bigtujunga bigtujunga/bigtujunga.tif 11
  real_dataset swiss_alps swiss_alps_n46e008/N46E008.tif 12
  real_dataset california california_3s/california_nevada_3s.tif 13
  synthetic_dataset demo 2049 1
}

# The three with which the flight of pages is flown, two of them with their pictures.
page_datasets() {
  local demo
  demo=$(demo_4097)
  bench_dataset demo_web "$demo.tif" --max-error 1 --imagery "${demo}_color.tif"
  if [[ -f $real_data/california_3s/california_nevada_3s.tif ]]; then
    bench_dataset california_pictured "$real_data/california_3s/california_nevada_3s.tif" \
      --imagery "$real_data/california_3s/bluemarble_z8_3857.tif"
  fi
  real_dataset moon moon_gld100_4096/moon_gld100_4096.tif 14
}
