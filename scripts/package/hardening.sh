#!/usr/bin/env bash
# Whether a program was linked and compiled as Debian hardens its own: position independent, full RELRO with BIND_NOW,
# no executable stack, stack protector, FORTIFY. By readelf, and by Debian's hardening-check where it is installed
# (devscripts).
#   scripts/package/hardening.sh PROGRAM…    0 if all are
set -euo pipefail
(($#)) || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
status=0
for program in "$@"; do
  missing=()
  # OPTION PATTERN NAME. Not grep -q: it may end before readelf has written all, whose failure then counts.
  has() { readelf -W "$1" "$program" | grep -E "$2" >/dev/null || missing+=("$3"); }
  has -h 'Type: +DYN' 'position independent'
  has -l 'GNU_RELRO' RELRO
  has -d 'BIND_NOW|FLAGS_1.*NOW' BIND_NOW
  has -l 'GNU_STACK +([^ ]+ +){5}RW ' 'stack without execution'
  has --dyn-syms '__stack_chk_fail' 'stack protector'
  has --dyn-syms '__[a-z]+_chk(@|$)' FORTIFY
  if command -v hardening-check >/dev/null && ! hardening-check --nocfprotection "$program" >/dev/null; then
    missing+=("hardening-check: $(hardening-check --nocfprotection "$program" | grep -E ': no' | tr '\n' ';')")
  fi
  if ((${#missing[@]})); then
    printf 'hardening: %s lacks %s\n' "$program" "$(IFS=,; echo "${missing[*]}")" >&2
    status=1
  fi
done
exit $status
