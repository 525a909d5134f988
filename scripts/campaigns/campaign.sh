#!/usr/bin/env bash
# The long form of the property tests: many random scenes through every model, verdicts against brute force;
# whole generators of needles' ways; the laboratory's tests; and those under AddressSanitizer and ThreadSanitizer that
# scripts/test.sh --all has no time for.
#   scripts/campaigns/campaign.sh [fields [SCENES] | contact | nodules | implants | saved | inputs | laboratory | asan |
#                                  tsan]
#       default: all
#       fields: 100000 scenes through the fields, a tenth of them against a grid of 0.25 mm
set -euo pipefail
cd "$(dirname "$0")/../.."
part=${1:-all} scenes=${2:-100000}
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
[[ $# -le 2 && $scenes =~ ^[1-9][0-9]*$ ]] || usage
[[ $part =~ ^(all|fields|contact|nodules|implants|saved|inputs|laboratory|asan|tsan)$ ]] || usage
[[ $# -lt 2 || $part == fields ]] || usage
is_part() { [[ $part == all || $part == "$1" ]]; }

run() {  # PRESET PROGRAM FILTER [SCENES]
  if [[ ${4:-} ]]; then export BRACHY_SCENES=$4; else unset BRACHY_SCENES; fi
  "build/$1/bin/$2" --gtest_brief=1 --gtest_filter="$3"
}

if is_part fields; then
  scripts/build.sh release core_tests
  echo "campaign: $scenes scenes, every result finite and within its certificate or flagged, at single points too"
  run release core_tests 'Property/*' "$scenes"
  echo "campaign: $((scenes / 10)) scenes, verdicts against det(I + grad u) on a grid of 0.25 mm"
  run release core_tests 'InjectivitySearch.IsNever*' $((scenes / 10))
fi
if is_part contact; then
  scripts/build.sh release core_tests haptics_tests
  echo "campaign: 1,000 loops through the template, 200 ways past the gland from the side, 50 needles at rest"
  run release haptics_tests '*Guide*' 250
  run release core_tests 'LateralTouch.*' 200
  run release core_tests '*Rest.*' 50
fi
if is_part nodules; then
  scripts/build.sh release core_tests
  echo "campaign: 2,000 needles into 40 nodules"
  run release core_tests 'Nodule.*' 2000
fi
if is_part implants; then
  scripts/build.sh release core_tests
  echo "campaign: 200 implants of up to 20 needles come to rest: decided within a second, against determinants"
  run release core_tests 'RestingImplant.*' 200
fi
if is_part saved; then
  scripts/build.sh release core_tests
  echo "campaign: every shipped scene is saved in 50 random ticks and goes on from each with the same bits"
  run release core_tests 'Saved/*' 50
fi
if is_part inputs; then
  scripts/build.sh release core_tests input_tests
  echo "campaign: 2,000 requests for a plan, and the default scene cut off after each of its bytes"
  run release core_tests 'MakePlan.Never*' 2000
  run release input_tests 'Scene.AnyTruncation*' 2000
fi
if is_part laboratory; then
  echo "campaign: the laboratory's tests, and packages and manuals with it"
  scripts/build.sh release
  ctest --test-dir build/release --output-on-failure --no-tests=error -L laboratory
  ctest --test-dir build/release --output-on-failure --no-tests=error -R 'Package|Manuals'
fi
if is_part asan; then
  echo "campaign: the engine, the models, the daemon and the tools under AddressSanitizer"
  scripts/build.sh asan core_tests models_tests daemon_tests apps_tests lab_tests
  for program in core_tests models_tests daemon_tests apps_tests lab_tests; do run asan $program '*'; done
fi
if is_part tsan; then
  echo "campaign: devices and server under ThreadSanitizer, and the daemon where it makes plans"
  scripts/build.sh tsan haptics_tests net_tests daemon_tests
  run tsan haptics_tests '*Device*'
  run tsan net_tests '*'
  run tsan daemon_tests 'DaemonImplant.*'
fi
echo "campaign: passed"
