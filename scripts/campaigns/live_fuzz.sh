#!/usr/bin/env bash
# Mutated messages against a running daemon, over TCP, WebSocket and OpenIGTLink, while a good viewer and a good
# device go on. Ends with 0 only if it lives and serves on, no memory or descriptor is lost, and ticks are as good as
# without.
#   scripts/campaigns/live_fuzz.sh [MESSAGES]      default: 100000, four minutes; 5000: half a minute, ticks not judged
set -euo pipefail
cd "$(dirname "$0")/../.."
messages=${1:-100000}
[[ $# -le 1 && $messages =~ ^[1-9][0-9]*$ ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/build.sh release brachyd live_fuzzer
work=$(mktemp -d)
. scripts/daemon.sh
# Needle 0 is the good device's; the other is anybody's.
cat >"$work/scene.toml" <<'SCENE'
name = "live fuzz"
[needle]
count = 2
[server]
port = 0
http_port = 0
igtl_port = 0
SCENE
start_daemon "$work" --config "$work/scene.toml"
until grep -q '^igtl on ' "$work/daemon.out"; do sleep 0.05; done
port() { sed -n "s/^$1 .*://p" "$work/daemon.out"; }
status=0
build/release/bin/live_fuzzer "$daemon" "$(port brachyd)" "$(port http)" "$(port igtl)" "$messages" || status=$?
end_daemon || status=1
sed -n '/^brachyd:/,/^  tick time/p' "$work/daemon.log"
if ((status)); then echo "live fuzz: the daemon's log is $work/daemon.log"; else rm -r "$work"; fi
exit $status
