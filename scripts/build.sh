#!/usr/bin/env bash
# Installs what is missing and builds one preset.   scripts/build.sh [release|debug|asan|tsan] [TARGET…]
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${1:-release}
shift || true

if [[ $preset == asan ]]; then scripts/setup.sh --fuzz; else scripts/setup.sh; fi
if [[ ! -f build/$preset/build.ninja ]]; then
  echo "build: configuring $preset"
  cmake --preset "$preset" >"/tmp/brachy-configure.$$" 2>&1 \
      || { cat "/tmp/brachy-configure.$$" >&2; exit 1; }
  rm -f "/tmp/brachy-configure.$$"
  echo "build: compiling $preset (the first time takes a few minutes)"
fi
# scripts/test.sh leaves out the laboratory; who asks for it, or for everything, has it again.
has_all() { (($#)) && ninja -C build/release -t query "$@" >/dev/null 2>&1; }
if [[ $preset == release ]] && grep -q '^BRACHY_LAB:.*=OFF' build/release/CMakeCache.txt && ! has_all "$@"; then
  cmake --preset release >/dev/null
fi
targets=()
if (($#)); then targets=(--target "$@"); fi
cmake --build --preset "$preset" "${targets[@]}"
