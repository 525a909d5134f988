#!/usr/bin/env bash
# What takes too long for every change: the campaigns, whole generators, charts and the other sanitizers' runs, in named
# parts of at most 30 minutes each on two idle cores. Ends with one page: each part, its time, and what fell short.
#   scripts/nightly.sh [PART…]     default: all parts, one after the other
#   scripts/nightly.sh --list      the parts, and what each runs
# Logs and page: out/nightly. Exits with 1 if any part fell short.
set -euo pipefail
cd "$(dirname "$0")/.."

# PART, its command. A part passes if its command exits with 0.
parts=(
  'fields      scripts/campaigns/campaign.sh fields'
  'contact     scripts/campaigns/campaign.sh contact'
  'nodules     scripts/campaigns/campaign.sh nodules'
  'implants    scripts/campaigns/campaign.sh implants'
  'planner     /usr/bin/python3 scripts/campaigns/planner.py'
  'saved       scripts/campaigns/campaign.sh saved'
  'inputs      scripts/campaigns/campaign.sh inputs'
  'laboratory  scripts/campaigns/campaign.sh laboratory'
  'asan        scripts/campaigns/campaign.sh asan'
  'tsan        scripts/campaigns/campaign.sh tsan'
  'torn        scripts/campaigns/torn_frames.sh 1200'
  'compare     scripts/charts/compare.sh --charts out/nightly/compare'
  'ticks       scripts/charts/ticks.sh --charts out/nightly/ticks'
  'lag         scripts/charts/lag.sh'
  'stability   scripts/charts/stability.sh --charts out/nightly/stability'
  'zwidth      scripts/charts/zwidth.sh --charts out/nightly/zwidth'
  'dose        scripts/charts/dose.sh --charts out/nightly/dose'
  'stress      scripts/campaigns/stress.sh'
  'poses       scripts/campaigns/hostile_poses.sh'
  'devices     /usr/bin/python3 tests/doors/hostile_devices.py build/release/bin/brachyd 1000'
  'faults      scripts/campaigns/faults.sh'
  'sanitized   scripts/campaigns/faults.sh --short --sanitized lies flood attack requests load kills sigterm'
  'live_fuzz   scripts/campaigns/live_fuzz.sh 100000'
  'soak        scripts/campaigns/soak.sh --short'
  'latency     scripts/campaigns/latency.sh'
  'seeds       scripts/campaigns/dose_latency.sh'
  'findings    scripts/campaigns/findings.sh'
  'cases       tests/apps/import/import_cases.py build/release/bin/brachy 2000'
  'timed       scripts/campaigns/timed.sh'
  'hdr_plans   tests/apps/import/hdr_plans.py build/release/bin/brachy-import config/sources 400'
  'fractions   tests/apps/score/fraction_sessions.py build/release/bin/brachy 50'
  'drift       tests/apps/score/drift_sessions.py build/release/bin/brachy 20'
  'teacher     scripts/campaigns/browser.sh teacher'
  'keys        scripts/campaigns/browser.sh trainee keys'
  'mouse       scripts/campaigns/browser.sh trainee mouse'
  'touch       scripts/campaigns/browser.sh trainee touch'
  'keys_whole  scripts/campaigns/browser.sh whole keys'
  'mouse_whole scripts/campaigns/browser.sh whole mouse'
  'touch_whole scripts/campaigns/browser.sh whole touch'
  'package     scripts/package.sh'
  'installed   scripts/package/package_check.sh --lintian'
  'robust      tests/apps/brachy/robust_draws.py build/release/bin/brachy 60'
)
name_of() { echo "${1%% *}"; }
command_of() { echo "${1#"${1%% *}"}" | sed 's/^ *//'; }

chosen=()
case "${1:-}" in
  --list) printf '%s\n' "${parts[@]}"; exit 0 ;;
  -*) sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2 ;;
esac
if (($# == 0)); then chosen=("${parts[@]}"); fi
for asked in "$@"; do
  found=
  for part in "${parts[@]}"; do
    if [[ $(name_of "$part") == "$asked" ]]; then found=$part; fi
  done
  [[ $found ]] || { echo "nightly: no part '$asked'; scripts/nightly.sh --list" >&2; exit 2; }
  chosen+=("$found")
done

mkdir -p out/nightly
page=out/nightly/page.txt
: >"$page"
short=0
for part in "${chosen[@]}"; do
  name=$(name_of "$part")
  log=out/nightly/$name.log
  echo "nightly: $name: $(command_of "$part")"
  began=$SECONDS
  # shellcheck disable=SC2046
  if $(command_of "$part") >"$log" 2>&1; then
    printf '%-10s %5d s  passed\n' "$name" $((SECONDS - began)) >>"$page"
  else
    short=$((short + 1))
    printf '%-10s %5d s  FELL SHORT (exit %d), %s:\n' "$name" $((SECONDS - began)) $? "$log" >>"$page"
    tail -n 5 "$log" | sed 's/^/             /' >>"$page"
  fi
done
echo "nightly: $((${#chosen[@]} - short)) of ${#chosen[@]} parts passed" >>"$page"
cat "$page"
((short == 0))
