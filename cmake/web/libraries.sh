#!/usr/bin/env bash
# Compiles the third-party libraries that the WebAssembly build needs, from Debian's sources: `libraries.sh PREFIX`.
#
# apt fetches the sources and checks them against Debian's signatures; root is not needed. What is done is not done
# again. CMake then finds in PREFIX what it finds in /usr for a native build, under the same names.
set -euo pipefail

prefix=$(mkdir -p "$1" && cd "$1" && pwd)
script=$(realpath "${BASH_SOURCE[0]}")
readonly prefix script work=$prefix/work
readonly sources=(fmtlib libjpeg-turbo libwebp libzstd zlib)

# Not /usr/lib/emscripten's default: acorn, which emcc links with, is a Debian package of its own.
export NODE_PATH=/usr/share/nodejs
readonly flags="-O3 -msimd128"
toolchain=$(dirname "$(readlink -f "$(command -v emcc)")")/cmake/Modules/Platform/Emscripten.cmake
readonly toolchain

# apt with lists and archives of its own, so that nobody's /etc/apt must name sources.
apt_own() {
  local command=$1
  shift
  "$command" -q -o Dir::State="$work/apt/state" -o Dir::Cache="$work/apt/cache" -o Dir::Etc::sourcelist="$work/apt/sources.list" \
    -o Dir::Etc::sourceparts=- -o APT::Sandbox::User= -o Acquire::Languages=none -o Dir::State::status=/var/lib/dpkg/status "$@"
}

# The servers that this machine takes its packages from, or Debian's own.
source_lines() {
  local lines line
  # Of equal versions apt takes the first one: rather from the main archive, the one that mirrors keep whole.
  # shellcheck disable=SC2016  # apt's own variables
  lines=$(apt-get indextargets 'Created-By: Packages' 'Origin: Debian' --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' 2>/dev/null |
    sort -u | awk '{ print ($2 ~ /security/), $0 }' | sort -s -k 1,1 | cut -d ' ' -f 2-)
  [[ -n $lines ]] || lines='http://deb.debian.org/debian bookworm main
http://deb.debian.org/debian-security bookworm-security main'
  while IFS= read -r line; do
    echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $line"
  done <<<"$lines"
}

fetch_sources() {
  mkdir -p "$work"/apt/state/lists/partial "$work"/apt/cache/archives/partial
  source_lines >"$work/apt/sources.list"
  apt_own apt-get update
  cd "$work"
  local name
  for name in "${sources[@]}"; do
    fetch_source "$name"
    mv "$name"-[0-9]*/ "$name"
  done
}

# The newest version, or the next where a mirror lists one that it does not hold (yet).
fetch_source() {
  local name=$1 version
  while IFS= read -r version; do
    ! apt_own apt-get source "$name=$version" || return 0
    echo "$name $version cannot be fetched; trying an older version" >&2
    rm -rf "$name"-[0-9]*/
  done < <(apt_own apt-cache showsrc --only-source "$name" | sed -n 's/^Version: //p' | sort -uVr)
  echo "no version of the source package $name can be fetched" >&2
  return 1
}

# One CMake project: NAME, its folder, what is built of it, and its options.
# note: what CMake tries out it only compiles. Each of some fifty programs would take seconds to link, and show nothing that matters here.
compile() {
  local name=$1 folder=$2 target=$3
  shift 3
  echo "compiling $name for WebAssembly"
  cmake -G Ninja -S "$folder" -B "$work/build/$name" -DCMAKE_TOOLCHAIN_FILE="$toolchain" -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_C_FLAGS="$flags" -DCMAKE_CXX_FLAGS="$flags -fno-exceptions" -DCMAKE_C_FLAGS_RELEASE=-DNDEBUG -DCMAKE_CXX_FLAGS_RELEASE=-DNDEBUG \
    -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_INSTALL_PREFIX="$prefix" \
    -DCMAKE_FIND_ROOT_PATH="$prefix" -DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY -DBUILD_SHARED_LIBS=OFF -Wno-dev "$@"
  cmake --build "$work/build/$name" --target "$target"
}

# note: CMake reads the sizes of types out of a program wrongly where that is WebAssembly. "install" would make programs, too.
compile_jpeg() {
  local source=$work/libjpeg-turbo build=$work/build/jpeg
  compile jpeg "$source" jpeg-static -DHAVE_SIZE_T=1 -DSIZE_T=4 -DHAVE_UNSIGNED_LONG=1 -DUNSIGNED_LONG=4 \
    -DENABLE_SHARED=OFF -DWITH_SIMD=OFF -DWITH_TURBOJPEG=OFF
  cp "$build"/libjpeg.a "$prefix/lib/"
  cp "$build"/jconfig.h "$source"/{jpeglib,jmorecfg,jerror}.h "$prefix/include/"
}

# note: nor is anything of it needed but the library itself.
compile_webp() {
  local source=$work/libwebp build=$work/build/webp
  compile webp "$source" webp -DWEBP_BUILD_ANIM_UTILS=OFF -DWEBP_BUILD_CWEBP=OFF -DWEBP_BUILD_DWEBP=OFF \
    -DWEBP_BUILD_GIF2WEBP=OFF -DWEBP_BUILD_IMG2WEBP=OFF -DWEBP_BUILD_VWEBP=OFF -DWEBP_BUILD_WEBPINFO=OFF \
    -DWEBP_BUILD_WEBPMUX=OFF -DWEBP_BUILD_EXTRAS=OFF -DWEBP_ENABLE_SIMD=OFF
  mkdir -p "$prefix/include/webp" "$prefix/lib/pkgconfig"
  cp "$build/libwebp.a" "$prefix/lib/"
  cp "$build/src/libwebp.pc" "$prefix/lib/pkgconfig/"
  cp "$source"/src/webp/{decode,encode,types}.h "$prefix/include/webp/"
}

# note: zlib's CMake wants files of Windows that Debian's sources do not have.
compile_zlib() {
  echo "compiling zlib for WebAssembly"
  cd "$work/zlib"
  CC="ccache emcc" AR=emar RANLIB=emranlib CFLAGS="$flags -DNDEBUG" ./configure --static --prefix="$prefix"
  make -j"$(nproc)" libz.a
  make install
}

# note: googletest's own CMake insists on exceptions.
compile_googletest() {
  echo "compiling googletest for WebAssembly"
  local source=/usr/src/googletest/googletest name
  mkdir -p "$work/build/googletest"
  for name in gtest gtest_main; do
    local file=$source/src/$name.cc
    [[ $name != gtest ]] || file=$source/src/gtest-all.cc
    ccache em++ -O2 -msimd128 -fno-exceptions -std=c++17 -I "$source" -I "$source/include" -c "$file" -o "$work/build/googletest/$name.o"
    emar rcs "$prefix/lib/lib$name.a" "$work/build/googletest/$name.o"
  done
  ln -sfn "$source/include/gtest" "$prefix/include/gtest"
}

# Libraries that are headers only: the very files of the native build, without the rest of /usr/include.
link_headers() {
  local name
  mkdir -p "$prefix/include" "$prefix/lib" "$prefix/share/cmake"
  for name in glm nlohmann; do ln -sfn "/usr/include/$name" "$prefix/include/$name"; done
  for name in glm nlohmann_json; do cp -r "/usr/share/cmake/$name" "$prefix/share/cmake/"; done
}

main() {
  local done_by
  done_by=$(sha256sum <"$script")
  [[ $(cat "$prefix/complete" 2>/dev/null) != "$done_by" ]] || return 0
  rm -rf "$prefix"
  mkdir -p "$work"
  link_headers
  fetch_sources
  # Side by side: most of the time CMake tries the compiler out, one small program after the other.
  local job jobs=()
  compile_webp & jobs+=($!)
  compile zstd "$work/libzstd/build/cmake" install -DZSTD_BUILD_PROGRAMS=OFF -DZSTD_BUILD_SHARED=OFF -DZSTD_MULTITHREAD_SUPPORT=OFF & jobs+=($!)
  compile_jpeg & jobs+=($!)
  compile fmt "$work/fmtlib" install -DFMT_TEST=OFF -DFMT_DOC=OFF & jobs+=($!)
  compile_zlib & jobs+=($!)
  compile_googletest & jobs+=($!)
  for job in "${jobs[@]}"; do wait "$job"; done
  echo "$done_by" >"$prefix/complete"
}

main
