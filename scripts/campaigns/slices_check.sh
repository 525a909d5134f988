#!/usr/bin/env bash
# Whether a sweep in slices equals the whole sweep: runs `stability` and `compare` whole, then in slices by GNU parallel
# and by Slurm (one node on 127.0.0.1, its configuration and keys in a temporary directory), and compares the merged
# results: stability byte for byte, compare in everything but its times and allocated bytes. Installs both. As root; two
# minutes on two idle cores.
#   scripts/campaigns/slices_check.sh [parallel] [slurm]   default: both. BRACHY: program to run, none: builds it
set -euo pipefail
cd "$(dirname "$0")/../.."
engines=("$@")
((${#engines[@]})) || engines=(parallel slurm)
for engine in "${engines[@]}"; do
  [[ $engine == parallel || $engine == slurm ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
done
[[ $(id -u) == 0 ]] || { echo "slices_check: must be root, to start Slurm: sudo $0" >&2; exit 2; }
if ! command -v parallel slurmctld slurmd sbatch munged >/dev/null; then
  echo "slices_check: installing parallel and Slurm"
  DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 install -y --no-install-recommends \
    parallel slurmctld slurmd slurm-client munge >/dev/null
fi
if [[ -z ${BRACHY:-} ]]; then
  scripts/build.sh release brachy-study
  BRACHY=$PWD/build/release/bin/brachy-study
fi
export BRACHY OMP_NUM_THREADS=1

work=$(mktemp -d /tmp/brachy-slices-XXXXXX)
chmod 755 "$work"
running=()
clean_up() {
  local pid
  for pid in "${running[@]}"; do kill "$pid" 2>/dev/null && wait "$pid" 2>/dev/null || true; done
  rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 1' HUP INT TERM
fail() { echo "slices_check: $1" >&2; exit 1; }
say() { echo "slices_check: $1"; }

slices=3
declare -A options=([stability]="--quick"
  [compare]="--quick --models psi31_a12,compact_elastic,thin_plate --scenes push,lateral")
wait_until() {  # SECONDS COMMAND…
  local end=$((SECONDS + $1)); shift
  until "$@" >/dev/null 2>&1; do ((SECONDS < end)) || return 1; sleep 0.2; done
}

# The rows of compare without what is measured (times, allocated bytes) and the number of the slice.
figures() {
  python3 - "$1" <<'EOF'
import json, sys
def without_times(value):
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if not k.endswith("_ms") and k not in ("bytes", "slice")}
    return [without_times(v) for v in value] if isinstance(value, list) else value
print(json.dumps(without_times(json.load(open(sys.argv[1]))["rows"]), indent=1, sort_keys=True))
EOF
}

run_whole() {
  # shellcheck disable=SC2086
  "$BRACHY" "$1" ${options[$1]} --json "$work/whole-$1.json" >"$work/whole-$1.md" 2>"$work/$1.err" ||
    fail "$(cat "$work/$1.err")"
}

check() {  # ENGINE TOOL
  "$BRACHY" "$2" --merge "$work/$1-$2"/*.json --json "$work/$1-$2.json" >"$work/$1-$2.md" ||
    fail "$1: slices of $2 do not merge"
  if [[ $2 == stability ]]; then
    cmp "$work/whole-$2.json" "$work/$1-$2.json" || fail "$1: stability differs"
    cmp "$work/whole-$2.md" "$work/$1-$2.md" || fail "$1: stability's table differs"
  else
    diff <(figures "$work/whole-$2.json") <(figures "$work/$1-$2.json") || fail "$1: compare differs"
  fi
  local how=", byte for byte"
  if [[ $2 == compare ]]; then how=", except times and allocated bytes"; fi
  say "$1: $2 in $slices slices equals the whole run$how"
}

by_parallel() {
  mkdir "$work/parallel-$1"
  # shellcheck disable=SC2086
  parallel --jobs 2 --halt now,fail=1 \
    "$BRACHY" "$1" ${options[$1]} --slice "{}/$slices" --json "$work/parallel-$1/{}.json" ::: $(seq $slices) \
    >"$work/parallel.out" 2>"$work/parallel.err" || fail "parallel: $(tail -n 5 "$work/parallel.err")"
}

free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

start_slurm() {
  local node
  node=$(hostname -s)
  mkdir "$work/munge" "$work/state" "$work/spool"
  chmod 700 "$work/munge"
  (umask 077; head -c 1024 /dev/urandom >"$work/munge/key")
  munged --foreground --force --key-file "$work/munge/key" --socket "$work/munge/socket" \
    --pid-file "$work/munge/pid" --log-file "$work/munge/log" --seed-file "$work/munge/seed" >"$work/munged.out" 2>&1 &
  running+=($!)
  wait_until 20 test -S "$work/munge/socket" || fail "munged did not start: $(tail -n 3 "$work/munged.out")"
  cat >"$work/slurm.conf" <<EOF
ClusterName=slices
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket=$work/munge/socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=4096 State=UNKNOWN
PartitionName=main Nodes=$node Default=YES MaxTime=INFINITE State=UP
EOF
  export SLURM_CONF=$work/slurm.conf
  slurmctld -D -f "$work/slurm.conf" >"$work/slurmctld.log" 2>&1 &
  running+=($!)
  slurmd -D -f "$work/slurm.conf" -N "$node" >"$work/slurmd.log" 2>&1 &
  running+=($!)
  wait_until 60 idle || fail "Slurm did not start: $(tail -n 3 "$work/slurmctld.log") $(tail -n 3 "$work/slurmd.log")"
  say "slurm: $(sinfo --noheader -o '%D node, %c processors, %t')"
}
idle() { [[ $(sinfo --noheader -o %t) == idle ]]; }
finished() { [[ -z $(squeue --noheader --job "$1" 2>/dev/null) ]]; }

by_slurm() {
  local job
  # shellcheck disable=SC2086
  job=$(sbatch --parsable --array=1-$slices --output="$work/slurm-$1-%a.log" \
    scripts/campaigns/sweep.slurm "$1" "$work/slurm-$1" ${options[$1]})
  wait_until 900 finished "$job" || fail "slurm: job $job does not end"
  [[ $(find "$work/slurm-$1" -name '*.json' | wc -l) == "$slices" ]] || fail "slurm: $(cat "$work/slurm-$1-"*.log)"
}

for tool in stability compare; do run_whole $tool; done
for engine in "${engines[@]}"; do
  if [[ $engine == slurm ]]; then start_slurm; fi
  for tool in stability compare; do
    "by_$engine" $tool
    check "$engine" $tool
  done
done
say "all is well"
