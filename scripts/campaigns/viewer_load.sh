#!/usr/bin/env bash
# What viewers cost: for every model, on the default scene with the needle of config/insertion.csv moving, the bytes a
# second that a page gets which subscribes to the surface, and to the volume, and the daemon's memory with pages that
# read nothing. Ends with 0 only if the surface stays within 2 MB in every second.
#   scripts/campaigns/viewer_load.sh [SECONDS [PAGES [KERNEL…]]]      default: 16 s each, the whole way; 32 pages
#       asleep; every kernel
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-16}
pages=${2:-32}
[[ $seconds$pages =~ ^[1-9][0-9]*$ ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
kernels=("${@:3}")
((${#kernels[@]})) || mapfile -t kernels < <(scripts/charts/kernel_list.py)

scripts/build.sh release brachyd
work=$(mktemp -d)
. scripts/daemon.sh
trap 'kill_daemon; rm -rf "$work"' EXIT
status=0
for kernel in "${kernels[@]}"; do
  sed -e "s|^kernel = .*|kernel = \"$kernel\"|" -e 's|^kind = "network"|kind = "scripted"|' \
    -e "s|^trajectory = .*|trajectory = \"$PWD/config/insertion.csv\"|" -e 's|^loop = .*|loop = true|' \
    config/prostate.toml >"$work/scene.toml"
  start_daemon "$work" --config "$work/scene.toml" --port 0 --http-port 0
  until port=$(sed -n 's/^http on .*://p' "$work/daemon.out"); [[ $port ]]; do sleep 0.05; done
  /usr/bin/python3 scripts/campaigns/viewer_load.py "$kernel" "$port" "$daemon" "$seconds" "$pages" || status=1
  end_daemon
done
exit $status
