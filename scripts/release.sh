#!/usr/bin/env bash
# A release: the packages, their bill of materials (SPDX) and the checksums of all of them, in out/release.
#   scripts/release.sh [--reproducible]    --reproducible: only if two builds have the same bytes (half an hour)
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in
  '') ;;
  --reproducible) scripts/package/reproducible.sh ;;
  *) sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2 ;;
esac
[[ -z $(git status --porcelain --untracked-files=no) ]] \
    || { echo "release: there are changes that no commit has" >&2; exit 1; }
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
scripts/package.sh
rm -rf out/release
mkdir -p out/release
cp build/release/*.deb out/release
scripts/package/sbom.py out/release/*.deb >out/release/brachyd.spdx.json
(cd out/release && sha256sum -- *.deb *.spdx.json >SHA256SUMS && sha256sum --check --quiet SHA256SUMS)
ls -sh out/release
