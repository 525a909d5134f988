#!/usr/bin/env bash
# Plans five glands by every method of `brachy plan --generate`, judges the plans by their exact dose and by 200
# draws of clinical placement noise, and writes the table. Some 5 minutes of a quiet machine. The two meshes want
# BRACHY_DATA_DIR and are left out without it.
#   scripts/charts/planning.sh [--quick] [--charts DIR] [--json FILE] [--store]
# --quick: the first gland, 10 draws, 10 s of the integer programme. --store: tests/reference/planning becomes this
# run's.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

. scripts/charts/chart_options.sh

scripts/setup.sh --planning
scripts/build.sh release brachy
/usr/bin/python3 scripts/charts/planning.py build/release/bin/brachy "$kept" "$charts" "${options[@]}"
echo "planning: figures in $kept, table in $charts"
