#!/usr/bin/env bash
# Findings of `brachy score` against random sessions with planted causes (tests/apps/score/findings_campaign_test.cpp):
# how many causes are named, whether anybody else is, and whether costs are right. Prints the table.
#   scripts/campaigns/findings.sh [SESSIONS [FROM]]     default: 300 from 1000; exit 1: a limit is missed
set -euo pipefail
cd "$(dirname "$0")/../.."

BRACHY_SESSIONS=${1:-300} BRACHY_SESSIONS_FROM=${2:-1000} \
  build/release/bin/apps_tests --gtest_filter='FindingsCampaign.*'
