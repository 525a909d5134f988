#!/usr/bin/env bash
# The long form of the property tests: many random scenes through every model, verdicts against brute force;
# and the tests under AddressSanitizer and ThreadSanitizer that scripts/test.sh --all has no time for.
#   scripts/campaigns/campaign.sh [SCENES]     default 100000 through the fields, a tenth of them against a grid of
#       0.25 mm
set -euo pipefail
cd "$(dirname "$0")/../.."
scenes=${1:-100000}
[[ $# -le 1 && $scenes =~ ^[1-9][0-9]*$ ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
scripts/build.sh release core_tests haptics_tests
echo "campaign: $scenes scenes, every result finite and within its certificate or flagged, at single points too"
BRACHY_SCENES=$scenes build/release/bin/core_tests --gtest_brief=1 --gtest_filter='Property/*'
echo "campaign: $((scenes / 10)) scenes, verdicts against det(I + grad u) on a grid of 0.25 mm"
BRACHY_SCENES=$((scenes / 10)) build/release/bin/core_tests --gtest_brief=1 --gtest_filter='InjectivitySearch.IsNever*'
echo "campaign: 1,000 loops of the hand through the template, 200 ways past the gland from the side, 50 needles at rest"
BRACHY_SCENES=250 build/release/bin/haptics_tests --gtest_brief=1 --gtest_filter='*Guide*'
BRACHY_SCENES=200 build/release/bin/core_tests --gtest_brief=1 --gtest_filter='LateralTouch.*'
BRACHY_SCENES=50 build/release/bin/core_tests --gtest_brief=1 --gtest_filter='*Rest.*'
echo "campaign: the engine, the models, the daemon and the tools under AddressSanitizer"
scripts/build.sh asan core_tests models_tests daemon_tests apps_tests
build/asan/bin/core_tests --gtest_brief=1
build/asan/bin/models_tests --gtest_brief=1
build/asan/bin/daemon_tests --gtest_brief=1
build/asan/bin/apps_tests --gtest_brief=1
echo "campaign: devices and server under ThreadSanitizer"
scripts/build.sh tsan haptics_tests net_tests
build/tsan/bin/haptics_tests --gtest_brief=1 --gtest_filter='*Device*'
build/tsan/bin/net_tests --gtest_brief=1
