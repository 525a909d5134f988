#!/usr/bin/env bash
# Builds upstream's OpenIGTLink and runs our tests with its library and its example programs as peers, beside Debian's
# (version 1.11): the same sources, as igtl_upstream_tests. Some minutes.
#   scripts/campaigns/openigtlink.sh [WORK]       WORK: default out/openigtlink; kept for the next time
# Environment:
#   OPENIGTLINK_SOURCE   a git repository to clone; default https://github.com/openigtlink/OpenIGTLink.git
#   OPENIGTLINK_REVISION its commit, tag or branch; default what was tested last
# Where the source cannot be reached it prints why and exits with 77.
set -euo pipefail
cd "$(dirname "$0")/../.."
source=${OPENIGTLINK_SOURCE:-https://github.com/openigtlink/OpenIGTLink.git}
revision=${OPENIGTLINK_REVISION:-94244fed7051e00cbcd4c341a7d7656be8ac404a}
work=$(realpath -m "${1:-out/openigtlink}")
jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
mkdir -p "$work"

say() { echo "openigtlink: $1"; }
quietly() { "$@" >"$work/log" 2>&1 || { tail -n 30 "$work/log" >&2; say "failed: $*" >&2; exit 1; }; }

if [[ ! -d $work/src/.git ]]; then
  if ! GIT_TERMINAL_PROMPT=0 timeout 300 git clone -q "$source" "$work/src.part" 2>"$work/log"; then
    say "skipped: $source cannot be cloned: $(tail -n 1 "$work/log")"
    rm -rf "$work/src.part"
    exit 77
  fi
  mv "$work/src.part" "$work/src"
fi
if ! git -C "$work/src" checkout -q "$revision" 2>"$work/log"; then
  say "skipped: $source has no $revision: $(tail -n 1 "$work/log")"
  exit 77
fi
say "source: $(git -C "$work/src" log -1 --format='%h of %cs')"

quietly cmake -S "$work/src" -B "$work/build" -DCMAKE_BUILD_TYPE=Release \
    "-DCMAKE_CXX_FLAGS=-O1 -w" "-DCMAKE_C_FLAGS=-O1 -w" -DBUILD_TESTING=OFF -DBUILD_EXAMPLES=OFF \
    -DBUILD_SHARED_LIBS=OFF "-DCMAKE_INSTALL_PREFIX=$work/prefix"
quietly cmake --build "$work/build" --target install --parallel "$jobs"
say "built: $(find "$work/prefix" -name 'libOpenIGTLink.*')"

[[ -f build/release/build.ninja ]] || quietly cmake --preset release
quietly cmake -S . -B build/release "-DBRACHY_UPSTREAM_IGTL=$work/prefix"
quietly cmake --build build/release --target igtl_upstream_tests --parallel "$jobs"
build/release/bin/igtl_upstream_tests
