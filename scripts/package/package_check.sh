#!/usr/bin/env bash
# Whether the packages install, run and go away again: in a fresh Debian 12 of their own (debootstrap, chroot) they
# are installed by apt, the daemon serves a client, everything is removed and purged, and the files before and after
# are compared. As root; some minutes.
#   scripts/package/package_check.sh [--consumer] [--boot] [--lintian]
#     --consumer: also builds a program against libbrachy-dev there (300 MB of compiler)
#     --boot: also boots that Debian (systemd-nspawn), where the daemon is a service
#     --lintian: also what Debian's checker says of the packages
# Packages are those of scripts/package.sh. The fresh Debian is kept for the next time: out/package-check/debian.tar
set -euo pipefail
cd "$(dirname "$0")/../.."
consumer=0 boot=0 lintian=0
for option in "$@"; do
  case $option in
    --consumer) consumer=1 ;;
    --boot) boot=1 ;;
    --lintian) lintian=1 ;;
    *) sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2 ;;
  esac
done
[[ $(id -u) == 0 ]] || { echo "package_check: must be root: sudo $0" >&2; exit 2; }
shopt -s nullglob
packages=(build/release/brachyd_*.deb build/release/libbrachy-dev_*.deb
          build/release/libbrachyd-client0_*.deb build/release/libbrachyd-client-dev_*.deb
          build/release/python3-brachyd_*.deb)
import=(build/release/brachyd-import_*.deb)
lab=(build/release/brachyd-lab_*.deb)
[[ ${#packages[@]} == 5 && ${#import[@]} == 1 && ${#lab[@]} == 1 ]] \
    || { echo "package_check: build the packages first: scripts/package.sh" >&2; exit 2; }
scripts/setup.sh --packages

fail() { echo "package_check: $1" >&2; exit 1; }
say() { echo "package_check: $1"; }
root=$(mktemp -d /tmp/brachy-package-XXXXXX)
log=$root.log
running=()  # pids of ours
mounted=()
clean_up() {
  local pid at
  for pid in "${running[@]}"; do kill "$pid" 2>/dev/null && wait "$pid" 2>/dev/null || true; done
  for at in "${mounted[@]}"; do umount "$at"; done
  rm -rf --one-file-system "$root" "$log"
}
trap clean_up EXIT
trap 'exit 1' HUP INT PIPE TERM
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive "$@"; }
quietly() { "$@" >"$log" 2>&1 || { tail -n 30 "$log" >&2; fail "failed: $*"; }; }
apt() { quietly inside apt-get -qq -o Dpkg::Use-Pty=0 --no-install-recommends -y "$@"; }

base=out/package-check/debian.tar
sources=$(apt-get indextargets --format 'deb $(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' \
    'Origin: Debian' | sort -u)
if [[ ! -f $base ]]; then
  mirror=$(awk '$3 == "bookworm" {print $2; exit}' <<<"$sources")
  say "a fresh Debian 12 from ${mirror:=http://deb.debian.org/debian}"
  quietly debootstrap --variant=minbase bookworm "$root" "$mirror"
  mkdir -p "$(dirname $base)"
  tar -C "$root" -cf "$base.part" . && mv "$base.part" "$base"
else
  tar -C "$root" -xf "$base"
fi
chmod 755 "$root"  # mktemp's is root's alone
mount -t proc proc "$root/proc" && mounted+=("$root/proc")
[[ -z $sources ]] || echo "$sources" >"$root/etc/apt/sources.list"
cp /etc/resolv.conf "$root/etc/resolv.conf"
printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d" && chmod 755 "$root/usr/sbin/policy-rc.d"
cp "${packages[@]}" "$root/tmp/"
apt update
# What they depend on comes first, so that what is compared is theirs alone.
for package in "${packages[@]}"; do
  depends=$(dpkg-deb -f "$package" Depends | sed -E 's/(^|, )libbrachyd-client0 \([^)]*\)//')
  [[ -z $depends ]] || apt satisfy "$depends"
done
if ((consumer)); then apt install cmake make g++; fi
if ((boot)); then apt install systemd systemd-sysv dbus; fi

# files: all paths but those where apt and dpkg keep their books.
files() {
  (cd "$root" && find . -xdev \( -path ./proc -o -path ./tmp -o -path ./run -o -path ./var/cache -o -path ./var/log \
      -o -path ./var/lib/dpkg \
    -o -path ./var/lib/apt \) -prune -o -print | LC_ALL=C sort)
}
new_files() { comm -13 <(echo "$before") <(files); }
before=$(files)

names=(brachyd libbrachy-dev libbrachyd-client0 libbrachyd-client-dev python3-brachyd)
install() { apt install "${packages[@]/#*\//\/tmp\/}"; }
install
say "installed: $(new_files | wc -l) files and folders; $(inside brachyd --version)"
inside dpkg --audit
[[ -z $(inside dpkg --verify "${names[@]}") ]] || fail \
    "files are not what the package says: $(inside dpkg --verify "${names[@]}")"

for program in brachyd brachy; do scripts/package/hardening.sh "$root/usr/bin/$program"; done
say "hardened: position independent, full RELRO, BIND_NOW, stack protector, FORTIFY"

inside /usr/share/brachyd-protocol/scripts/conformance/run.py --help >"$log" || fail "the judge of clients does not run"
say "the judge of clients runs: $(head -n 1 "$log")"

# serve: the daemon as the service runs it, but by nobody, on free ports; a device and a viewer.
mkfifo "$root/tmp/said"
# shellcheck disable=SC2094
chroot --userspec=65534:65534 "$root" /usr/bin/brachyd --config /etc/brachyd/scene.toml --port 0 \
    --http-port 0 >"$root/tmp/said" 2>"$root/tmp/daemon.log" &
daemon=$!
running+=("$daemon")
exec 3<"$root/tmp/said"
read -r -t 60 -u 3 listening || { cat "$root/tmp/daemon.log" >&2; fail "brachyd did not start"; }
read -r -t 60 -u 3 http
address=${listening##* }
chroot "$root" /usr/bin/brachy watch --connect "$address" --duration 4 \
    --json >"$root/tmp/watched" 2>"$root/tmp/watch.log" &
viewer=$!
running+=("$viewer")
inside brachy replay /usr/share/brachy/insertion.csv --connect "$address" --speed 4 --json >"$root/tmp/replayed"
wait "$viewer" || { cat "$root/tmp/watch.log" >&2; fail "brachy watch failed"; }
say "served: $(python3 - "$root/tmp" <<'EOF'
import json, pathlib, sys
folder = pathlib.Path(sys.argv[1])
watched, replayed = (json.loads((folder / name).read_text().splitlines()[-1]) for name in ("watched", "replayed"))
assert watched["snapshots"] > 0 and replayed["poses_accepted"] > 0, (watched, replayed)
print(f"{watched['snapshots']} snapshots seen, {replayed['poses_accepted']} poses taken")
EOF
)"
page=$(curl -sS --compressed --max-time 20 "http://${http##* }/")
grep -qi '<title>' <<<"$page" || fail "no page at ${http##* }"
kill -TERM "$daemon"
wait "$daemon" || fail "brachyd ended with $?"
running=()
exec 3<&-

if ((consumer)); then
  # tests/package builds sources of apps/examples, which a user takes along; all else is installed.
  mkdir -p "$root/tmp/consumer/tests" "$root/tmp/consumer/apps"
  cp -r tests/package "$root/tmp/consumer/tests/"
  cp -r apps/examples "$root/tmp/consumer/apps/"
  quietly inside cmake -S /tmp/consumer/tests/package -B /tmp/consumer/build -DCMAKE_BUILD_TYPE=Release
  quietly inside cmake --build /tmp/consumer/build
  said="$(inside /tmp/consumer/build/deform); $(inside /tmp/consumer/build/driver)"
  say "programs built against libbrachy-dev say: $said"
  inside /tmp/consumer/build/watch 1 2>"$log" && fail "the program in C found a daemon where none is"
  grep -q "nothing listens" "$log" || fail "the program in C says: $(cat "$log")"
  inside /tmp/consumer/build/adapter 127.0.0.1:1 2>"$log" && fail "the adapter found a daemon where none is"
  grep -q "nothing listens" "$log" || fail "the adapter says: $(cat "$log")"
fi

# DICOM is read by a program and a package of its own; what serves the operator links none of its libraries.
for program in brachyd brachy; do
  libraries=$(inside ldd /usr/bin/$program)
  ! grep -iE 'libdcm|liboflog|libofstd' <<<"$libraries" || fail "$program links DCMTK"
done
# Not grep -q: it may end before dpkg-deb has written all, whose failure then counts.
! dpkg-deb -f "${packages[0]}" Depends | grep dcmtk >/dev/null || fail "brachyd depends on DCMTK"
dpkg-deb -f "${import[0]}" Depends | grep dcmtk >/dev/null || fail "brachyd-import does not name DCMTK"
dpkg-deb -c "${import[0]}" | grep ' ./usr/bin/brachy-import$' >/dev/null || fail "brachyd-import has no brachy-import"
say "no DCMTK in brachyd and brachy, only in brachyd-import"
# So is the laboratory.
! dpkg-deb -c "${packages[0]}" | grep -E ' ./usr/(bin/brachy-study|share/brachy/reference)' >/dev/null \
    || fail "brachyd has parts of the laboratory"
dpkg-deb -c "${lab[0]}" | grep ' ./usr/bin/brachy-study$' >/dev/null || fail "brachyd-lab has no brachy-study"
said=$(inside brachy compare 2>&1) && fail "brachy compare ran without brachyd-lab"
grep -q "install the package brachyd-lab" <<<"$said" || fail "brachy compare says: $said"

# Python's package steers, with what it depends on alone; nothing is left of it afterwards, its byte code neither.
cp tests/package/python_package.py "$root/tmp/"
said=$(inside python3 /tmp/python_package.py /usr/lib/python3/dist-packages) || fail "python3-brachyd does not run"
say "python3-brachyd: $said"

# A changed scene outlives an upgrade and a removal.
echo '# mine' >>"$root/etc/brachyd/scene.toml"
apt install --reinstall /tmp/"$(basename "${packages[0]}")"
apt remove "${names[@]}"
left=$(new_files)
[[ $left == $'./etc/brachyd\n./etc/brachyd/scene.toml' ]] || fail "removed, but these are left: $left"
[[ $(tail -n 1 "$root/etc/brachyd/scene.toml") == '# mine' ]] || fail "the changed scene is gone"
say "removed: what is left is /etc/brachyd/scene.toml"
install
apt purge "${names[@]}"
left=$(new_files)
[[ -z $left ]] || fail "purged, but these are left: $left"
gone=$(comm -23 <(echo "$before") <(files))
[[ -z $gone ]] || fail "purged, and with it went: $gone"
say "purged: nothing is left"

if ((boot)); then
  install
  . scripts/package/boot.sh
fi
if ((lintian)); then lintian --fail-on error --allow-root "${packages[@]}"; fi
say "all is well"
