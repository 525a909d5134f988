#!/usr/bin/env bash
# Writes config/prostate.toml and config/KEYS.md from the list of scene keys in core/scene/file.
#   scripts/scene_keys.sh
set -euo pipefail
cd "$(dirname "$0")/.."
(($# == 0)) || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
scripts/build.sh release input_tests
BRACHY_WRITE_KEYS=1 build/release/bin/input_tests --gtest_filter='KeyText.*IsGenerated'
