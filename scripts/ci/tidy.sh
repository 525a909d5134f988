#!/usr/bin/env bash
# clang-tidy over the sources (slow: some minutes), and with it every warning of clang 14.
#   scripts/ci/tidy.sh [FILE…]     default: all of core, net, haptics, apps
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v clang-tidy-14 >/dev/null || { echo "tidy: apt-get install clang-tidy-14" >&2; exit 2; }
# Each source alone, without precompiled headers: clang does not read GCC's, and a missing #include is noticed.
cmake --preset release -B build/tidy -DBRACHY_PCH=OFF -DBRACHY_TOGETHER=0 >/dev/null
files=("$@")
((${#files[@]})) || mapfile -t files < <(git ls-files 'core/*.cpp' 'net/*.cpp' 'haptics/*.cpp' 'apps/*.cpp')
# -fopenmp is g++'s; clang 14 without its runtime only needs to skip the pragmas.
printf '%s\n' "${files[@]}" |
  xargs -P 2 -n 1 clang-tidy-14 -p build/tidy --quiet --extra-arg=-Wno-unknown-pragmas \
    --extra-arg=-Wno-unknown-warning-option \
    --extra-arg=-Wno-unused-command-line-argument --extra-arg=-fno-openmp
echo "tidy: ok"
