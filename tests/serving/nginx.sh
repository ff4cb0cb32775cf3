#!/bin/bash
# The nginx configuration of docs/serving.md, as it stands there: started before `terrane serve` with a certificate
# made on the spot, and asked over TLS and HTTP/2. Usage: nginx.sh PROGRAM NGINX DOCUMENT
set -u
terrane=$(realpath "$1")
nginx=$2
document=$(realpath "$3")
folder=$(mktemp -d)
serve_pid=
nginx_pid=
finish() {
  for pid in $nginx_pid $serve_pid; do kill "$pid" 2>/dev/null; done
  for pid in $nginx_pid $serve_pid; do wait "$pid" 2>/dev/null; done
  rm -rf "$folder"
}
trap finish EXIT
chmod 755 "$folder"
cd "$folder" || exit 1
fail() {
  echo "FAILED: $*"
  cat nginx.log serve.log 2>/dev/null
  exit 1
}
# holds WORDS COMMAND...: the command's output has this line.
holds() {
  local words=$1 said
  shift
  said=$("$@" 2>&1) || fail "$* says: $said"
  grep -qiE -- "$words" <<<"$said" || fail "$* does not say '$words' but: $said"
  echo "ok: $words"
}

mkdir -p terrain cache temp
"$terrane" synth -o made.tif --size 700 -q || fail "no terrain"
"$terrane" build made.tif -o terrain/made.terrane -q || fail "no dataset"
"$terrane" serve terrain/made.terrane --port 0 >url 2>serve.log &
serve_pid=$!
deadline=$((SECONDS + 20))
until [ -s url ]; do
  kill -0 "$serve_pid" 2>/dev/null || fail "terrane serve has ended"
  [ "$SECONDS" -lt "$deadline" ] || fail "terrane serve does not start"
done
backend=$(sed -e 's,http://,,' -e 's,/$,,' url)

openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=localhost \
  -addext subjectAltName=DNS:localhost -keyout privkey.pem -out fullchain.pem 2>openssl.log || fail "no certificate"

# The configuration of the document; only addresses and paths are this test's own.
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
{
  echo "daemon off; pid $folder/nginx.pid; error_log $folder/nginx.log;"
  [ "$EUID" -ne 0 ] || echo "user root;"
  echo "events {} http { access_log off;"
  for kind in client_body proxy fastcgi uwsgi scgi; do echo "${kind}_temp_path $folder/temp;"; done
  # shellcheck disable=SC2016  # the backticks are the document's
  sed -n '/^```nginx$/,/^```$/{/^```/d;p}' "$document" |
    sed -e "s,listen 443,listen 127.0.0.1:$port," -e "s,server 127.0.0.1:8080,server $backend," \
      -e "s,terrain.example.org,localhost," -e "s,/etc/ssl/terrane,$folder," -e "s,/var/cache/nginx/terrane,$folder/cache," \
      -e "s,/srv/terrain/,$folder/terrain/,"
  echo "}"
} >nginx.conf
grep -q "listen 127.0.0.1:$port ssl http2" nginx.conf || fail "the document has no configuration"
"$nginx" -e "$folder/nginx.log" -p "$folder" -c "$folder/nginx.conf" &
nginx_pid=$!
site=https://localhost:$port
ask=(curl -sS --fail --cacert fullchain.pem --connect-to "localhost:$port:127.0.0.1:$port")
deadline=$((SECONDS + 20))
until "${ask[@]}" -o /dev/null "$site/healthz" 2>/dev/null; do
  kill -0 "$nginx_pid" 2>/dev/null || fail "nginx has ended"
  [ "$SECONDS" -lt "$deadline" ] || fail "nginx does not start"
done

holds '^2$' "${ask[@]}" --http2 -o /dev/null -w '%{http_version}\n' "$site/healthz"
hash=$("${ask[@]}" "$site/datasets.json" | sed -n 's/.*"hash": "\([0-9a-f]*\)".*/\1/p')
[ ${#hash} -eq 64 ] || fail "no hash: $hash"
base=$site/d/made/$hash

# Whole, in ranges over the borders of slices, and out of the cache.
for turn in first second; do
  "${ask[@]}" -o whole "$base/elevation.pmtiles" || fail "no archive"
  cmp -s whole terrain/made.terrane/elevation.pmtiles || fail "the archive differs ($turn)"
  for range in 0-126 1000-2999 100000-300000; do
    "${ask[@]}" -o part -w '%{http_code}\n' -H "Range: bytes=$range" "$base/elevation.pmtiles" >status || fail "no range"
    first=${range%-*}
    [ "$(cat status)" = 206 ] || fail "status $(cat status) for a range"
    cmp -s part <(tail -c +$((first + 1)) terrain/made.terrane/elevation.pmtiles | head -c $((${range#*-} - first + 1))) ||
      fail "bytes $range differ ($turn)"
  done
  holds 'immutable' "${ask[@]}" -o /dev/null -D - "$base/elevation/0/0/0"
  "${ask[@]}" -o manifest "$base/manifest.json" || fail "no manifest"
  cmp -s manifest terrain/made.terrane/manifest.json || fail "the manifest differs ($turn)"
  "${ask[@]}" --compressed -o manifest "$site/d/made/manifest.json" || fail "no manifest"
  cmp -s manifest terrain/made.terrane/manifest.json || fail "the compressed manifest differs ($turn)"
done
[ -n "$(find cache -type f)" ] || fail "nothing was cached"
asked=$(curl -sS "http://$backend/metrics" | sed -n 's/^terrane_requests_total{route="archive",status="206"} //p')
[ "$asked" -le 3 ] || fail "the cache does not hold: $asked requests reached the server"
holds 'heightsMeters' "${ask[@]}" "$base/elevation?points=500000,6700000"
holds 'heightsMeters' "${ask[@]}" -H 'Content-Type: application/json' -d '{"points":[[500000,6700000]]}' "$base/elevation"

# The directory itself.
"${ask[@]}" -o part -H 'Range: bytes=0-126' "$site/static/made.terrane/elevation.pmtiles" || fail "no static range"
cmp -s part <(head -c 127 terrain/made.terrane/elevation.pmtiles) || fail "the static range differs"
holds 'access-control-allow-origin: \*' "${ask[@]}" -o /dev/null -D - "$site/static/made.terrane/manifest.json"
echo "passed"
