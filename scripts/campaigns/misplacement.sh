#!/usr/bin/env bash
# How far seeds end from where they were planned, and why: the default plan, inserted through the template by a hand
# that does exactly as it should, with each reason for misplacement alone and with all of them, slowly and fast.
# Prints a table, row by row, a minute or two for each session: 18 without clinical noise, and for each of its N seeds
# 12; with needles that lock several minutes.
#   scripts/campaigns/misplacement.sh [--json FILE] [--seeds N] [--only TEXT]
#     N: of the clinical noise; default 1      TEXT: only reasons with it in their names, such as "all"
set -euo pipefail
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
json=/dev/null seeds=1 only=
while (($#)); do
  case $1 in
    --json) json=${2:-}; [[ $json ]] || usage; shift 2 ;;
    --seeds) seeds=${2:-}; [[ $seeds =~ ^[1-9][0-9]*$ ]] || usage; shift 2 ;;
    --only) only=${2:-}; shift 2 ;;
    *) usage ;;
  esac
done
scripts/build.sh release brachy
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
/usr/bin/python3 scripts/campaigns/misplacement.py build/release/bin/brachy "$work" "$seeds" "$json" "$only"
