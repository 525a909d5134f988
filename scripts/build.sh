#!/usr/bin/env bash
# Installs what is missing and builds one preset.   scripts/build.sh [release|debug|asan|tsan] [TARGET…]
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${1:-release}
shift || true

if [[ $preset == asan ]]; then scripts/setup.sh --fuzz; else scripts/setup.sh; fi
if [[ ! -f build/$preset/build.ninja ]]; then
  echo "build: configuring $preset"
  rooms=()
  if [[ $preset == release && ${CI:-} ]]; then rooms=(-DBRACHY_UNITY=TESTS); fi  # CI has half an hour
  cmake --preset "$preset" "${rooms[@]}" >"/tmp/brachy-configure.$$" 2>&1 || { cat "/tmp/brachy-configure.$$" >&2; exit 1; }
  rm -f "/tmp/brachy-configure.$$"
  echo "build: compiling $preset (the first time takes a few minutes)"
fi
targets=()
if (($#)); then targets=(--target "$@"); fi
cmake --build --preset "$preset" "${targets[@]}"
