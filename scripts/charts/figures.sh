#!/usr/bin/env bash
# Redraws the paper's figures 1 to 5 from our engine (`brachy deform`) with the paper's parameters, as SVG.
#   scripts/charts/figures.sh [DIR]      default: out/figures
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
here=$PWD
(($# <= 1)) && [[ ${1:-} != -* ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

folder=$(cd "$from" && realpath -m "${1:-$here/out/figures}")

scripts/setup.sh --charts
scripts/build.sh release brachy
/usr/bin/python3 scripts/charts/figures.py build/release/bin/brachy "$folder"
echo "figures: in $folder"
