#!/usr/bin/env bash
# Whether two builds of this commit have the same bytes: builds the packages twice, in two directories of different
# names, without ccache, and compares them. Half an hour on two cores.
#   scripts/package/reproducible.sh    0 if they are the same
set -euo pipefail
cd "$(dirname "$0")/../.."
[[ $# == 0 ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
work=$(mktemp -d)
trap 'git worktree remove --force "$work/one"; git worktree remove --force "$work/another-name"; rm -rf "$work"' EXIT
export CCACHE_DISABLE=1
for name in one another-name; do
  git worktree add --detach --quiet "$work/$name" HEAD
  (cd "$work/$name" && scripts/package.sh >/dev/null)
  (cd "$work/$name/build/release" && sha256sum ./*.deb) >"$work/$name.sums"
done
diff "$work/one.sums" "$work/another-name.sums" || { echo "reproducible: the packages differ" >&2; exit 1; }
cat "$work/one.sums"
echo "reproducible: both builds have these bytes"
