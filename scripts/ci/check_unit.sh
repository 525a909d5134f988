#!/usr/bin/env bash
# Whether systemd takes the unit, and whether it is closed up as far as it says. Needs systemd-analyze (Debian:
# systemd), and no systemd that runs.
#   scripts/ci/check_unit.sh    0 if all is well
set -euo pipefail
cd "$(dirname "$0")/../.."
unit=config/systemd/brachyd.service
readonly exposure=15  # tenths; systemd calls up to 20 OK. It is 14: the network, SCHED_FIFO, capset.

command -v systemd-analyze >/dev/null || { echo "check_unit: systemd-analyze is missing: apt install systemd" >&2; \
    exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# It need not be installed here: any program that is there does for the one that is named.
sed 's|^ExecStart=/usr/bin/brachyd |ExecStart=/bin/true |' "$unit" >"$folder/brachyd.service"
said=$(systemd-analyze verify --man=no "$folder/brachyd.service" 2>&1) || { echo "$said" >&2; exit 1; }
# A key it does not know is only a warning.
if grep -q brachyd.service <<<"$said"; then echo "$said" >&2; exit 1; fi
grep -q '^LimitCORE=0$' "$unit" || { echo "check_unit: a core file would hold tokens: LimitCORE=0" >&2; exit 1; }
systemd-analyze security --offline=yes --no-pager --threshold=$exposure "$folder/brachyd.service" >"$folder/report" ||
  { grep -v '^✓' "$folder/report" >&2; exit 1; }
tail -n 1 "$folder/report"
