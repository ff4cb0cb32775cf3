# The inputs of the codec table, and how benches come to datasets of them. Sourced from the root of the repository.
# shellcheck shell=bash

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

# Ends the program where one of these is no input's name.
check_names() {
  local names=" ${files[*]%%=*} " name
  for name in "$@"; do
    if [[ $names != *" $name "* ]]; then
      echo "there is no input called \"$name\"; there are:$names" >&2
      exit 2
    fi
  done
}

# The inputs with these names, or all, as far as they are here: sets `inputs`, "NAME=FILE" each.
choose_inputs() {
  local wanted=" $* " entry name file
  inputs=()
  for entry in "${files[@]}"; do
    name=${entry%%=*}
    file=${entry#*=}
    [[ $# -eq 0 || $wanted == *" $name "* ]] || continue
    if [[ -n $file && ! -f $real_data/$file ]]; then
      echo "$real_data/$file is absent: left out" >&2
      continue
    fi
    inputs+=("$entry")
  done
  if ((${#inputs[@]} == 0)); then
    echo "none of the inputs is here" >&2
    exit 1
  fi
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
