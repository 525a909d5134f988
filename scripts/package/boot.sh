# Sourced by scripts/package/package_check.sh: boots its Debian, in which the packages are installed; brachyd is a
# service there.
rm "$root/usr/sbin/policy-rc.d"
umount "$root/proc"  # it gets one of its own
mounted=()
cp "${packages[0]}" "$root/root/brachyd.deb"
systemd-nspawn --quiet --directory="$root" --boot --register=no --keep-unit --private-network \
    --console=read-only >"$root/tmp/console" 2>&1 </dev/null &
nspawn=$!
running+=("$nspawn")  # ended, it shuts the system down

# booted COMMAND…: in that system.
booted() {
  local init
  init=$(pgrep -P "$nspawn" | head -n 1)
  nsenter --target "$init" --all --root --wd=/ /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "$@"
}
pid_of() { booted systemctl show --property=MainPID --value brachyd; }
state_of() { booted systemctl is-active "$1" || true; }
for _ in {1..120}; do
  kill -0 "$nspawn" 2>/dev/null || { cat "$root/tmp/console" >&2; fail "the system did not boot"; }
  [[ $(state_of multi-user.target 2>/dev/null) == active ]] && break
  sleep 0.5
done
journal() { booted journalctl --no-pager -u brachyd >&2 || true; }
[[ $(state_of brachyd) == active ]] || { journal; fail "booted, and brachyd is $(state_of brachyd)"; }
booted brachy watch --connect 127.0.0.1:18950 --duration 2 --json &>/dev/null \
    || { journal; fail "no client gets to the service"; }
user=$(booted stat -c %u "/proc/$(pid_of)")
((user > 0)) || fail "the service runs as root"
say "booted: brachyd is $(state_of brachyd), run by user $user"
booted systemctl reload brachyd || { journal; fail "the service does not reload"; }
booted systemctl restart brachyd || { journal; fail "the service does not restart"; }
stuck=$(pid_of)
booted kill -STOP "$stuck"
for _ in {1..60}; do
  now=$(pid_of)
  [[ $now != 0 && $now != "$stuck" && $(state_of brachyd) == active ]] && break
  sleep 0.5
done
[[ $now != "$stuck" && $(state_of brachyd) == active ]] || { journal; fail \
    "stuck, and the watchdog did not restart it"; }
say "reloaded, restarted, and restarted by the watchdog when it was stuck"
booted systemctl disable --now --quiet brachyd 2>/dev/null
quietly booted dpkg --remove brachyd
quietly booted dpkg --install /root/brachyd.deb
[[ $(state_of brachyd) == inactive ]] || fail "an administrator had disabled the service, and it runs"
booted systemctl enable --now --quiet brachyd 2>/dev/null
[[ $(state_of brachyd) == active ]] || { journal; fail "enabled, and brachyd is $(state_of brachyd)"; }
quietly booted dpkg --purge brachyd
[[ $(state_of brachyd) == inactive ]] || fail "purged, and brachyd is $(state_of brachyd)"
left=$(find "$root/var/lib" "$root/etc" -name '*brachy*' -not -path '*/dpkg/*')
[[ -z $left ]] || fail "purged while it ran, but these are left: $left"
say "stopped and purged while it ran: nothing is left"
kill "$nspawn"
wait "$nspawn" || true
running=()
