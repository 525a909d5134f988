#!/usr/bin/env bash
# What TLS costs the daemon: the same viewers of full frames without it and with it, one after the other; the
# daemon's processor time for each MB that they got, its memory, the snapshots they lacked; and how many handshakes
# it does in a second.
#   scripts/campaigns/tls_cost.sh [SECONDS [VIEWERS]]      default: 10 s each, 8 viewers
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-10}
viewers=${2:-8}
[[ $seconds$viewers =~ ^[1-9][0-9]*$ ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/build.sh release brachyd brachy
bin=build/release/bin
work=$(mktemp -d)
. scripts/daemon.sh
trap 'kill_daemon; rm -rf "$work"' EXIT
openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=brachyd -addext \
    subjectAltName=IP:127.0.0.1 \
  -keyout "$work/key.pem" -out "$work/certificate.pem" 2>/dev/null
printf '[server]\ntls_certificate = "certificate.pem"\ntls_key = "key.pem"\n' >"$work/tls.toml"
printf '[server]\n' >"$work/plain.toml"

# Of the daemon, in ms: it is awake 200 times a second with nobody watching, too.
processor_ms() { awk -v tick="$(getconf CLK_TCK)" '{print ($14 + $15) * 1000 / tick}' "/proc/$daemon/stat"; }

for kind in plain tls; do
  options=()
  [[ $kind == tls ]] && options=(--tls-ca "$work/certificate.pem")
  start_daemon "$work" --config "$work/$kind.toml" --port 0
  sleep 1
  idle=$(processor_ms)
  sleep "$seconds"
  begin=$(processor_ms)
  watching=()
  for ((i = 0; i < viewers; ++i)); do
    $bin/brachy watch --connect "$address" --full --json --duration "$seconds" "${options[@]}" \
        >"$work/watch$i.json" 2>/dev/null &
    watching+=($!)
  done
  sleep $((seconds / 2))
  memory=$(awk '/^VmRSS/ {print $2 / 1024}' "/proc/$daemon/status")
  wait "${watching[@]}"
  cat "$work"/watch?*.json | /usr/bin/python3 -c '
import json, sys
kind, idle, begin, end, memory = sys.argv[1], *map(float, sys.argv[2:])
seen = [json.loads(line) for line in sys.stdin]
def total(key): return sum(client[key] for client in seen)
mb, cost = total("bytes") / 1e6, (end - begin) - (begin - idle)
print(f"{kind}: {len(seen)} viewers, {mb:.0f} MB, {cost / mb:.2f} ms of processor time a MB; "
      f"{memory:.0f} MB of memory;",
      total("drops"), "of", total("snapshots"), "snapshots dropped")' \
    "$kind" "$idle" "$begin" "$(processor_ms)" "$memory"
  if [[ $kind == tls ]]; then
    begin=$(processor_ms)
    count=$(openssl s_time -connect "$address" -CAfile "$work/certificate.pem" -new -time 3 2>/dev/null \
        | sed -n 's/^\([0-9]*\) connections in .* real seconds.*/\1/p')
    end=$(processor_ms)
    awk -v n="$count" -v ms="$(awk -v a="$begin" -v b="$end" 'BEGIN {print b - a}')" \
      'BEGIN {printf "handshakes, one after the other: %d a second, %.2f ms of processor time each\n", n / 3, ms / n}'
  fi
  end_daemon
done
