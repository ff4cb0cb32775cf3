#!/usr/bin/env bash
# Bits a sample and decode speed of elevation beside PNG, LERC, JPEG XL and zstd: ./dev bench codec [NAME...]
#
# Names pick some of the inputs, for quick turns: "./dev bench codec zion mt_hood". What the other codecs make
# of an input is kept in build/bench/codec_others.json and measured only once.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly terrane=build/release/bin/terrane
readonly real_data=../shared/data
readonly bench_data=build/bench/data

# What the catalogue of the test data marks for this table, smallest first, and the demo.
readonly files=(
  "zion=zion/dem_srtm_zion.tif"
  "swellendam=swellendam/dem_srtm_utm33s.tif"
  "bigtujunga=bigtujunga/bigtujunga.tif"
  "mt_hood=mt_hood/lf_elev_220_mt_hood_utm.tif"
  "gabilan=gabilan_mesa_1m/gabilan.bil"
  "swiss_alps=swiss_alps_n46e008/N46E008.tif"
  "new_zealand=new_zealand_1km/nz_elev.tif"
  "moon=moon_gld100_4096/moon_gld100_4096.tif"
  "california=california_3s/california_nevada_3s.tif"
  "demo="
)

# The raster behind a name: the file itself, the middle of the big one, or made-up ground.
input_of() {
  local name=$1 file=$2 input=$bench_data/codec_$1.tif
  case $name in
    demo)
      if [[ ! -f $input ]]; then
        "$terrane" synth -o "$input" --size 4097 --seed 1 -q
      fi
      ;;
    california)
      if [[ ! -f $input ]]; then
        gdal_translate -q -srcwin 4552 352 4097 4097 -co COMPRESS=ZSTD -co PREDICTOR=2 -co TILED=YES \
          "$real_data/$file" "$input"
      fi
      ;;
    *) input=$real_data/$file ;;
  esac
  echo "$input"
}

# Builds one dataset unless it is newer than the program.
build_one() {
  local input=$1 out=$2
  shift 2
  if [[ ! $out/manifest.json -nt $terrane ]]; then
    "$terrane" build "$input" -o "$out" --overwrite -q "$@"
  fi
}

# A fraction of a dataset's sample spacing, in metres.
share_of_spacing() {
  "$terrane" info "$1" --json |
    python3 -c 'import json, sys
info = json.load(sys.stdin)
print(repr(info["spacing_x"] * info["meters_per_unit"] * float(sys.argv[1])))' "$2"
}

names=" ${files[*]%%=*} "
for name in "$@"; do
  if [[ $names != *" $name "* ]]; then
    echo "there is no input called \"$name\"; there are:$names" >&2
    exit 2
  fi
done

mkdir -p "$bench_data/codec"
arguments=()
wanted=" $* "
for entry in "${files[@]}"; do
  name=${entry%%=*}
  file=${entry#*=}
  [[ $# -eq 0 || $wanted == *" $name "* ]] || continue
  if [[ -n $file && ! -f $real_data/$file ]]; then
    echo "$real_data/$file is absent: left out" >&2
    continue
  fi
  echo "Building $name" >&2
  input=$(input_of "$name" "$file")
  lossless=$bench_data/codec/$name.terrane
  build_one "$input" "$lossless"
  arguments+=("$input" "$lossless")
  for share in 0.5 0.25; do
    build_one "$input" "$bench_data/codec/${name}_$share.terrane" --max-error "$(share_of_spacing "$lossless" $share)"
    arguments+=("$bench_data/codec/${name}_$share.terrane")
  done
done
if ((${#arguments[@]} == 0)); then
  echo "none of the inputs is here" >&2
  exit 1
fi
exec build/release/bin/measure_codec build/bench/codec.json build/bench/codec_others.json "${arguments[@]}"
