#!/usr/bin/env bash
# Where ultrasound images show tips, seeds, the capsule and the urethra, against where the simulation has them, over
# random states with certified fields.
# usage: scripts/campaigns/ultrasound_truth.sh [STATES] [BUILD]     default 1000 states, build/release; exit 1: one is
#        more than 0.2 mm off
set -euo pipefail
cd "$(dirname "$0")/../.."
export BRACHY_TRUTH_STATES=${1:-1000}
exec nice -n 19 "${2:-build/release}/bin/core_tests" --gtest_brief=1 --gtest_filter='UltrasoundTruth.*'
