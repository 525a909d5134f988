#!/usr/bin/env bash
# Builds the Debian packages: build/release/brachyd_VERSION_ARCH.deb, to run, brachyd-import_…, brachyd-lab_…,
# libbrachy-dev_…, to build against, libbrachyd-client0_… and libbrachyd-client-dev_…, the C API, and
# python3-brachyd_…, with Debian's hardening flags (dpkg-buildflags) in a build of their own, build/package. Two builds
# of a commit have the same bytes: scripts/package/reproducible.sh.
#   scripts/package.sh      then: sudo apt install ./build/release/brachyd_*.deb
# Whether they install, run and go away again in a fresh Debian 12: scripts/package/package_check.sh
set -euo pipefail
cd "$(dirname "$0")/.."
[[ $# == 0 ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/setup.sh --viewer --broker --import --python
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
export SOURCE_DATE_EPOCH DEB_BUILD_MAINT_OPTIONS=hardening=+all
# Debug information would be stripped; what CMake adds for a release comes last: -O3.
CXXFLAGS="$(dpkg-buildflags --get CXXFLAGS) $(dpkg-buildflags --get CPPFLAGS) -g0"
LDFLAGS=$(dpkg-buildflags --get LDFLAGS)
export CXXFLAGS LDFLAGS
# A build that was configured without npm does not know of it yet.
if [[ ! -f build/package/viewer/index.html ]]; then cmake --preset package >/dev/null; fi
cmake --build --preset package --target brachyd brachy brachy-study brachy-import brachy_core brachy_net \
    brachy_haptics brachyd_client brachyd_engine viewer man_pages
mkdir -p build/release
rm -f build/release/*.deb
cpack --config build/package/CPackConfig.cmake -B build/release >build/package/cpack.log 2>&1 \
    || { cat build/package/cpack.log >&2; exit 1; }
rm -rf build/release/_CPack_Packages
for program in brachyd brachy brachy-study brachy-import; do
  scripts/package/hardening.sh build/package/bin/$program
done
scripts/package/hardening.sh build/package/net/libbrachyd-client.so build/package/python/brachyd_engine*.so
ls -sh build/release/*.deb
