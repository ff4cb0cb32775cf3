#!/bin/bash
# Bad input for every subcommand: each gives a clear message, a non-zero exit status, and
# leaves nothing behind. Usage: bad_input.sh PROGRAM
set -u
terrane=$(realpath "$1")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
failures=0

# fails STATUS WORDS COMMAND...: the command ends with this status, says these words, leaves nothing behind.
fails() {
  local status=$1 words=$2
  shift 2
  local before after said code
  before=$(find . | sort)
  said=$("$@" 2>&1)
  code=$?
  after=$(find . | sort)
  if [ "$code" -ne "$status" ]; then
    echo "FAILED: status $code instead of $status: $*"; echo "  $said"; failures=$((failures + 1))
  elif ! grep -qiE -- "$words" <<<"$said"; then
    echo "FAILED: does not say '$words': $*"; echo "  $said"; failures=$((failures + 1))
  elif [ "$before" != "$after" ]; then
    echo "FAILED: leaves something behind: $*"; diff <(echo "$before") <(echo "$after"); failures=$((failures + 1))
  else
    echo "ok: $(grep "^terrane: " <<<"$said" | head -1)"
  fi
}

# keeps STATUS WORDS FOLDER COMMAND...: as fails, but work that was done is kept in FOLDER, and the message says so.
keeps() {
  local status=$1 words=$2 kept=$3
  shift 3
  local before after said code
  before=$(find . | sort)
  said=$("$@" 2>&1)
  code=$?
  if [ "$code" -ne "$status" ]; then
    echo "FAILED: status $code instead of $status: $*"; echo "  $said"; failures=$((failures + 1))
  elif ! grep -qiE -- "$words" <<<"$said"; then
    echo "FAILED: does not say '$words': $*"; echo "  $said"; failures=$((failures + 1))
  elif [ ! -e "$kept/plan" ] || ! grep -qF -- "run the same command again to go on, or delete $kept" <<<"$said"; then
    echo "FAILED: does not keep its work, or does not say so: $*"; echo "  $said"; failures=$((failures + 1))
  else
    echo "ok: $(grep "^terrane: " <<<"$said" | head -1)"
  fi
  rm -rf "$kept"
  after=$(find . | sort)
  if [ "$before" != "$after" ]; then
    echo "FAILED: leaves more behind than its work: $*"; failures=$((failures + 1))
  fi
}

# grid NAME COLUMNS ROWS VALUE: an ASCII grid of one value.
grid() {
  { printf 'ncols %d\nnrows %d\nxllcorner 500000\nyllcorner 5200000\ncellsize 10\nNODATA_value -9999\n' "$2" "$3"
    for ((row = 0; row < $3; ++row)); do
      for ((col = 0; col < $2; ++col)); do printf '%s ' "$4"; done
      echo
    done; } >"$1"
}

"$terrane" synth -o good.tif --size 700 -q || exit 1
"$terrane" build good.tif -o good.terrane -q || exit 1

# Inputs.
fails 1 'missing.tif.*(not|no such)' "$terrane" build missing.tif -o a.terrane
echo 'Dear reader, this is no raster.' >text.tif
fails 1 'text.tif' "$terrane" build text.tif -o a.terrane
head -c $(($(stat -c %s good.tif) / 2)) good.tif >cut.tif
fails 1 'cut.tif' "$terrane" build cut.tif -o a.terrane --threads 1
grid nocrs.asc 20 20 100
fails 1 '--source-crs' "$terrane" build nocrs.asc -o a.terrane
grid void.asc 20 20 -9999
fails 1 'nodata|no data|void' "$terrane" build void.asc -q --source-crs EPSG:32632 -o a.terrane
{ printf 'ncols 20\nnrows 20\nxllcorner 500000\nyllcorner 6700000\ncellsize 10\nNODATA_value -9999\n'
  for ((row = 0; row < 20; ++row)); do
    for ((col = 0; col < 20; ++col)); do printf '%s ' -9999; done
    echo
  done; } >over_void.asc
grid one.asc 1 1 100
fails 1 'one.asc|1 ?x ?1' "$terrane" build one.asc --source-crs EPSG:32632 -o a.terrane

# The command line.
fails 2 'frobnicate' "$terrane" build good.tif -o a.terrane --frobnicate
fails 2 'size' "$terrane" build good.tif -o a.terrane --memory lots
fails 2 'required|-o' "$terrane" build good.tif
fails 2 'max-error|lossless' "$terrane" build good.tif -o a.terrane --lossless --max-error 1
fails 1 'max-error 1e\+06.*100000 at most|max-error 1000000.*100000 at most' "$terrane" build good.tif -o a.terrane --max-error 1e6
fails 2 'max-error nan.*finite' "$terrane" build good.tif -o a.terrane --max-error nan
fails 1 'spacing 2: the finest input has a sample every 10 .*Give 10 or more' "$terrane" build good.tif -o a.terrane --spacing 2
fails 2 'resampling.*cubic' "$terrane" build good.tif -o a.terrane --resampling best
for layers in 12,x '12,' ',3' metres; do
  fails 2 'layers.*12,3, or auto' "$terrane" build good.tif -o a.terrane --max-error 1 --layers "$layers"
done
for layers in 3,12 12,12 12,1 40,30,20,10; do
  fails 1 'layers.*falling' "$terrane" build good.tif -o a.terrane --max-error 1 --layers "$layers"
done
fails 1 'layers.*one layer' "$terrane" build good.tif -o a.terrane --layers 12
fails 2 'append|layers' "$terrane" build good.tif -o good.terrane --append --layers 12
fails 2 "no command 'buidl'" "$terrane" buidl good.tif

# Imagery: files, places, bands, values.
imagery=("$terrane" build good.tif -q -o a.terrane --imagery)
fails 1 'missing.tif.*no such' "${imagery[@]}" missing.tif
fails 1 'text.tif' "${imagery[@]}" text.tif
fails 1 'cut.tif' "${imagery[@]}" cut.tif
fails 1 'nocrs.asc.*--imagery-crs' "${imagery[@]}" nocrs.asc
fails 1 'nocrs.asc.*does not lie over' "${imagery[@]}" nocrs.asc --imagery-crs EPSG:32601
fails 1 'no band 2' "${imagery[@]}" good.tif --bands 1,2,3
fails 1 'another size' "${imagery[@]}" good.tif+nocrs.asc
fails 1 'void.asc.*no texel' "$terrane" build good.tif -q -o a.terrane --source-crs EPSG:32632 --imagery-crs EPSG:32632 \
  --crs EPSG:32632 --imagery over_void.asc
fails 2 'bands.*red' "${imagery[@]}" good.tif --bands 1,2
fails 2 'stretch.*MIN,MAX' "${imagery[@]}" good.tif --stretch 5
fails 2 'stretch.*MIN,MAX' "${imagery[@]}" good.tif --stretch 9,3
fails 2 "no imagery layer 'sea'" "${imagery[@]}" land=good.tif --bands sea=1
fails 2 'no --imagery' "$terrane" build good.tif -o a.terrane --bands 1
fails 2 'imagery-format' "${imagery[@]}" good.tif --imagery-format gif
fails 2 'imagery-quality' "${imagery[@]}" good.tif --imagery-quality 0

# Adding to a dataset.
fails 1 'nowhere.terrane.*does not exist' "$terrane" build good.tif -o nowhere.terrane --append
fails 2 'append|overwrite' "$terrane" build good.tif -o good.terrane --append --overwrite
fails 2 'append|crs' "$terrane" build good.tif -o good.terrane --append --crs EPSG:32633
fails 2 'append|max-error' "$terrane" build good.tif -o good.terrane --append --max-error 1
fails 2 'append|lossless' "$terrane" build good.tif -o good.terrane --append --lossless
fails 2 'append|imagery' "$terrane" build good.tif -o good.terrane --append --imagery good.tif
fails 1 'good.terrane.*within .* m.*anew' "$terrane" build good.tif -o good.terrane --append
grid whole.asc 20 20 100
"$terrane" build whole.asc --source-crs EPSG:32632 -o whole.terrane -q || exit 1
fails 1 'missing.tif.*(not|no such)' "$terrane" build missing.tif -o whole.terrane --append
fails 1 'whole.asc.*cannot be appended.*CRS.*anew' \
  "$terrane" build whole.asc --source-crs EPSG:2056 -o whole.terrane --append
fails 1 'good.tif.*cannot be appended.*anew' "$terrane" build good.tif -o whole.terrane --append

# The output.
fails 1 '--overwrite' "$terrane" build good.tif -o good.terrane
fails 1 'does not exist' "$terrane" build good.tif -o nowhere/a.terrane
fails 1 'cannot be made|not exist' "$terrane" build good.tif -o /proc/a.terrane
mkdir own.terrane && cp good.terrane/* own.terrane && echo north >own.terrane/notes.txt
fails 1 'own.terrane/notes.txt.*move it' "$terrane" build good.tif -o own.terrane --overwrite
ln -s good.terrane link.terrane
fails 1 'symbolic link' "$terrane" build good.tif -o link.terrane --overwrite
mkdir photos && echo meow >photos/cat.jpg
fails 1 'no dataset' "$terrane" build good.tif -o photos --overwrite
if [ "$(id -u)" -eq 0 ]; then
  echo "note: root may write anywhere; a read-only folder is not tried"
else
  mkdir locked && chmod a-w locked
  fails 1 'locked' "$terrane" build good.tif -o locked/a.terrane
  cp -r good.terrane theirs.terrane && chmod a-w theirs.terrane
  fails 1 'theirs.terrane: may not be replaced' "$terrane" build good.tif -o theirs.terrane --overwrite
  fails 1 'theirs.terrane: may not be replaced' "$terrane" build good.tif -o theirs.terrane --append
  chmod u+w theirs.terrane
fi

# A disk that is full, for the archive and for scratch data.
full() { (ulimit -f 16 && "$@"); }
fails 1 'room|large|full|written|write' full "$terrane" build good.tif -o a.terrane
full_later() { (ulimit -f 400 && "$@"); }
keeps 1 'room|large|full|written|write' a.terrane.partial full_later "$terrane" build good.tif -o a.terrane

# What is no work of a build is not touched, and two builds of one output do not meet.
mkdir b.terrane.partial && echo meow >b.terrane.partial/cat.jpg
fails 1 'interrupted build|move it away' "$terrane" build good.tif -o b.terrane
mkdir c.terrane.partial
(
  flock -x 9
  fails 1 'another build' "$terrane" build good.tif -o c.terrane
  exit $failures
) 9<c.terrane.partial
failures=$?
rm -r b.terrane.partial c.terrane.partial

# Datasets that were damaged; -s keeps the size, so that only hashes can tell.
damaged() { rm -rf bad.terrane && cp -r good.terrane bad.terrane; }
fails 1 'missing.terrane' "$terrane" info missing.terrane
fails 1 'missing.terrane' "$terrane" verify missing.terrane
damaged && printf 'X' | dd of=bad.terrane/elevation.pmtiles bs=1 seek=5000 conv=notrunc status=none
fails 1 'changed|SHA|damaged' "$terrane" verify bad.terrane
damaged && truncate -s -100 bad.terrane/elevation.pmtiles
fails 1 'bytes|cut|trunc|end' "$terrane" verify bad.terrane
damaged && : >bad.terrane/elevation.pmtiles
fails 1 'elevation.pmtiles' "$terrane" verify bad.terrane
fails 1 'elevation.pmtiles' "$terrane" info bad.terrane
"$terrane" build good.tif -o pictured.terrane -q --imagery good.tif || exit 1
pictured() { rm -rf bad.terrane && cp -r pictured.terrane bad.terrane; }
pictured && printf 'XXXX' | dd of=bad.terrane/imagery.pmtiles bs=1 seek=30000 conv=notrunc status=none
fails 1 'imagery.pmtiles' "$terrane" verify bad.terrane
pictured && rm bad.terrane/imagery.pmtiles
fails 1 'imagery.pmtiles' "$terrane" info bad.terrane
fails 1 "no imagery layer 'sea'" "$terrane" render pictured.terrane --software --size 64x36 -o a.png --imagery sea
damaged && rm bad.terrane/elevation.pmtiles
fails 1 'elevation.pmtiles' "$terrane" verify bad.terrane
damaged && sed -i 's/"builtBy": "terrane/"builtBy": "Terrane/' bad.terrane/manifest.json
fails 1 'manifest.*changed' "$terrane" verify bad.terrane
fails 1 'manifest.*changed' "$terrane" info bad.terrane
damaged && truncate -s 300 bad.terrane/manifest.json
fails 1 'manifest' "$terrane" verify bad.terrane
damaged && rm bad.terrane/manifest.json
fails 1 'manifest' "$terrane" verify bad.terrane

# A manifest from a newer version, sealed as that version would.
damaged && sed -i -E 's/("formatVersion": )1/\12/; s/("manifestSha256": ")[0-9a-f]{64}/\1'"$(printf '0%.0s' {1..64})"'/' bad.terrane/manifest.json
seal=$(sha256sum <bad.terrane/manifest.json | cut -d' ' -f1)
sed -i -E 's/("manifestSha256": ")0{64}/\1'"$seal"'/' bad.terrane/manifest.json
fails 1 'version' "$terrane" info bad.terrane
fails 1 'version' "$terrane" verify bad.terrane

# Pictures: the command line, the camera, flights, outputs, a full disk, a damaged dataset.
draw=("$terrane" render good.terrane --software --size 64x36)
touch there.png
echo '{"keys": "none"}' >bad_flight.json
fails 1 'does not exist.*terrane build' "$terrane" render nosuch.terrane -o a.png
fails 1 'nothing to write' "${draw[@]}"
fails 1 'there.png.*--overwrite' "${draw[@]}" -o there.png
fails 1 'a.png' "${draw[@]}" -o nowhere/a.png
echo '{"type": "LineString", "coordinates": [[1, 2], ["x", 3]]}' > words.geojson
echo '{"type": "Topology"}' > topology.geojson
echo 'LINESTRING (1 2, 3 4)' > wkt.geojson
fails 1 'nosuch.geojson.*does it exist' "${draw[@]}" -o a.png --lines nosuch.geojson
fails 1 'words.geojson.*invalid.*coordinate.*ogrinfo' "${draw[@]}" -o a.png --lines words.geojson
fails 1 "topology.geojson.*not a vector file" "${draw[@]}" -o a.png --lines topology.geojson
fails 1 'wkt.geojson.*not a vector file' "${draw[@]}" -o a.png --lines wkt.geojson
# A colour is one by any of its names; what is none is told, and the picture drawn.
coloured() {
  printf '{"type": "Feature", "properties": {"%s": "%s", "stroke-width": 9}, "geometry": {"type": "LineString", ' "$2" "$3" >"$1.geojson"
  printf '"coordinates": [[498000, 6698000], [502000, 6702000]]}}' >>"$1.geojson"
  "${draw[@]}" -o "$1.png" --overwrite --lines "$1.geojson" 2>&1
}
coloured hex stroke '#ff0000' >said.txt
for color in '#F00' red 'rgb(255, 0, 0)'; do
  coloured same stroke "$color" >>said.txt
  cmp -s hex.png same.png || { echo "FAILED: the colour $color is not #ff0000"; failures=$((failures + 1)); }
done
coloured same color '#ff0000' >>said.txt
cmp -s hex.png same.png || { echo "FAILED: color is not read as stroke"; failures=$((failures + 1)); }
if grep -qE "warning|exists" said.txt || ! coloured none stroke dull | grep -q "1 of its lines.*no colour.*'dull'"; then
  echo "FAILED: a colour that is none is not told, or another is"; cat said.txt; failures=$((failures + 1))
fi
cmp -s hex.png none.png && { echo "FAILED: colours make no difference"; failures=$((failures + 1)); }
rm -f hex.* same.* none.* said.txt
printf 'vec3 apply(Ground ground) {\n  return oops;\n}\n' > wrong.glsl
fails 1 'oops' "${draw[@]}" -o a.png --pass wrong.glsl
fails 1 'nosuch.glsl.*does it exist' "${draw[@]}" -o a.png --pass nosuch.glsl
fails 1 'size.*WIDTHxHEIGHT' "$terrane" render good.terrane --size huge -o a.png
fails 1 'a.jpg.*PNG' "${draw[@]}" -o a.jpg
fails 1 '--at.*--flight' "${draw[@]}" -o a.png --at 5
fails 1 's.json.*folder.*does not exist' "${draw[@]}" -o a.png --stats nodir/s.json
fails 2 'tau nan' "${draw[@]}" -o a.png --tau nan
fails 1 'water nan' "${draw[@]}" -o a.png --water nan
fails 2 'look-from|eye' "${draw[@]}" -o a.png --look-from N --eye 1,2,3 --look-at 4,5,6
echo '{"type": "LineString", "coordinates": [[7.1, 46.2], [7.2, 46.2]]}' >degrees.geojson
fails 1 'degrees.geojson.*nothing of it lies on the dataset.*7.1 to 7.2' "${draw[@]}" -o a.png --lines degrees.geojson
# A reader that has seen enough is no fault.
"$terrane" info good.terrane 2>stderr.txt | true
code=${PIPESTATUS[0]}
if [ "$code" -ne 0 ] || [ -s stderr.txt ]; then
  echo "FAILED: info to a reader that left ends with $code: $(cat stderr.txt)"; failures=$((failures + 1))
fi
rm -f stderr.txt
if [ -e /dev/full ]; then
  "$terrane" info good.terrane >/dev/full 2>/dev/null && { echo "FAILED: info to a full disk ends with 0"; failures=$((failures + 1)); }
fi
fails 1 '2\^k' "${draw[@]}" -o a.png --k 16
fails 2 'tau' "${draw[@]}" -o a.png --tau 0
fails 2 'mode' "${draw[@]}" -o a.png --mode pretty
fails 2 'surface.*nonsense' "${draw[@]}" -o a.png --surface nonsense
fails 1 '--metric.*--surface patches' "${draw[@]}" -o a.png --surface meshes --metric distance
fails 1 'EASTING' "${draw[@]}" -o a.png --eye 1,2 --look-at 1,2,3
fails 1 '--look-at' "${draw[@]}" -o a.png --eye 1,2,3
fails 1 'look-from' "${draw[@]}" -o a.png --look-from upstairs
fails 1 'bad_flight.json' "${draw[@]}" -o a.png --flight bad_flight.json --at 1
fails 1 'missing.json' "${draw[@]}" -o a.png --flight missing.json --at 1
fails 1 'a.tif' "${draw[@]}" --position nowhere/a.tif
fails 1 'a.png|large|room' full "$terrane" render good.terrane --software --size 1280x720 -o a.png
fails 1 'missing.json' "$terrane" bench good.terrane --flight missing.json
fly=("$terrane" bench good.terrane --flight missing.json)
fails 1 '--line fast.*40Mbit/s,50ms' "${fly[@]}" --policy available --line fast
fails 1 '--line 0bit/s,1ms' "${fly[@]}" --policy available --line 0bit/s,1ms
fails 1 '--line 1Mbit/s' "${fly[@]}" --policy available --line 1Mbit/s
fails 1 'dataset on disk' "$terrane" bench http://127.0.0.1:1/a --flight missing.json --policy available
fails 2 'policy' "${fly[@]}" --policy eventually
fails 2 'surface.*nonsense' "${fly[@]}" --surface nonsense
fails 2 '--line requires --policy' "${fly[@]}" --line 1Mbit/s,1ms
fails 2 'excludes' "${fly[@]}" --policy available --frames 3
touch there.tif
fails 1 'there.tif.*--overwrite' "$terrane" synth -o there.tif --size 65
fails 1 'size' "$terrane" synth -o a.tif --size -3
damaged && printf 'x' | dd of=bad.terrane/elevation.pmtiles bs=1 seek=40000 conv=notrunc status=none
timeout 60 "$terrane" render bad.terrane --software --size 64x36 -o damaged.png >/dev/null 2>&1
if [ $? -gt 1 ]; then
  echo "FAILED: a damaged dataset stops the renderer"; failures=$((failures + 1))
fi

# Serving: what is no dataset, two of one name, addresses that are none or taken, a log that cannot be written.
fails 1 'nosuch.terrane.*does not exist' "$terrane" serve nosuch.terrane --port 0
fails 1 'good.tif.*not a dataset' "$terrane" serve good.tif --port 0
fails 1 'rename' "$terrane" serve good.terrane ./good.terrane --port 0
fails 1 'nowhere.*no IP address' "$terrane" serve good.terrane --bind nowhere
fails 1 'cannot listen at 192.0.2.1' "$terrane" serve good.terrane --bind 192.0.2.1 --port 0
fails 1 'nowhere/access.log.*another file' "$terrane" serve good.terrane --port 0 --access-log nowhere/access.log
fails 1 '--cache.*size in bytes' "$terrane" serve good.terrane --port 0 --cache much
fails 2 'port' "$terrane" serve good.terrane --port 99999
fails 2 'DATASET' "$terrane" serve
mkfifo printed
"$terrane" serve good.terrane --port 0 -q >printed &
server=$!
read -r url <printed
port=${url##*:}
fails 1 'another program listens there.*--port' "$terrane" serve good.terrane --port "${port%/}"

# Datasets at addresses: what is none there, what must be on disk, nobody there.
fails 1 'd/none/manifest.json: the server answers 404; is this a dataset' "$terrane" info "${url}d/none"
fails 1 'manifest.json: the server answers 404' "$terrane" render "$url" -o a.png
fails 1 'd/good: is an address.*on disk' "$terrane" verify "${url}d/good"
fails 1 'd/good: is an address.*on disk' "$terrane" serve "${url}d/good" --port 0
fails 1 'd/good/manifest.json.*(SSL|TLS)' "$terrane" info "${url/http:/https:}d/good"
kill "$server"
if ! wait "$server"; then
  echo "FAILED: a server that is asked to end does not end well"; failures=$((failures + 1))
fi
rm printed
fails 1 'manifest.json: .*connect.*nobody has answered for' "$terrane" info "${url}d/good"

[ $failures -eq 0 ] && echo "all bad inputs were told apart" || echo "$failures failed"
[ $failures -eq 0 ]
