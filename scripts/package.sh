#!/usr/bin/env bash
# Builds the Debian packages: build/release/brachyd_VERSION_ARCH.deb, to run, and libbrachy-dev_…, to build against.
#   scripts/package.sh      then: sudo apt install ./build/release/brachyd_*.deb
# Whether they install, run and go away again in a fresh Debian 12: scripts/package/package_check.sh
set -euo pipefail
cd "$(dirname "$0")/.."
[[ $# == 0 ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/setup.sh --viewer --broker
# A build that was configured without npm does not know of it yet.
if [[ -f build/release/build.ninja && ! -f build/release/viewer/index.html ]]; then cmake \
    --preset release >/dev/null; fi
scripts/build.sh release brachyd brachy brachy-study brachy_core viewer man_pages
rm -f build/release/*.deb
cpack --config build/release/CPackConfig.cmake -B build/release >build/release/cpack.log 2>&1 \
    || { cat build/release/cpack.log >&2; exit 1; }
rm -rf build/release/_CPack_Packages
ls -sh build/release/*.deb
