# To be sourced: start_daemon FOLDER OPTIONS… starts brachyd with these options and waits until it listens. Then
# $daemon is its process id and $address its HOST:PORT; its output is in FOLDER/daemon.out and FOLDER/daemon.log. It
# ends with the script, or by end_daemon, which waits for its last words.
daemon=
start_daemon() {
  local folder=$1; shift
  : >"$folder/daemon.out"  # before the daemon's shell gets to it: lines of an earlier one are not this one's
  build/release/bin/brachyd "$@" >"$folder/daemon.out" 2>"$folder/daemon.log" &
  daemon=$!
  # With --json the line is {"listening_on":"HOST:PORT"}.
  local says='s/^brachyd listening on \(.*\)$/\1/p; s/^{"listening_on":"\(.*\)"}$/\1/p'
  until [[ $(sed -n "$says" "$folder/daemon.out") ]]; do
    kill -0 "$daemon" 2>/dev/null || { cat "$folder/daemon.log" >&2; exit 2; }
    sleep 0.05
  done
  # shellcheck disable=SC2034
  address=$(sed -n "$says" "$folder/daemon.out")
}
end_daemon() {
  local pid=$daemon
  daemon=
  kill -TERM "$pid"
  wait "$pid"
}
kill_daemon() { if [[ $daemon ]]; then kill "$daemon" 2>/dev/null || true; fi; }
trap kill_daemon EXIT
