#!/usr/bin/env bash
# Looks for a torn frame in the triple buffer: two threads that never rest hand each other frames of the default
# scene's size, each looked through whole. First a mutant, which must be caught. Ends with 0 only where no frame was
# torn or out of order.
#   scripts/campaigns/torn_frames.sh [SECONDS]      default: half an hour
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-1800}
[[ $# -le 1 && $seconds =~ ^[1-9][0-9]*$ ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/build.sh release torn_frames
build/release/bin/torn_frames "$seconds"
