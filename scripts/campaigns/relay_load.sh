#!/usr/bin/env bash
# What many viewers cost the daemon: its processor time with 1, 10, 50 and 200 viewers of the surface, the needle
# moving, beside it and behind `brachy relay`. Ends with 0 only if behind the relay it stays within 10 % of one
# viewer's beside it. Five minutes; two cores at least.
#   scripts/campaigns/relay_load.sh [--quick] [--charts DIR] [--json FILE] [--store]
# --quick: 1 and 50 viewers. --store: table and chart in tests/reference/relay_load, which the README shows, become
#     those of this run.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

. scripts/charts/chart_options.sh
scripts/setup.sh --broker
scripts/build.sh release brachyd brachy brachy_crowd
/usr/bin/python3 scripts/campaigns/relay_load.py "$kept" "$charts" "${options[@]}"
