#!/usr/bin/env bash
# Installs what building, testing and running need, where it is missing. Debian 12.
#   scripts/setup.sh [--viewer] [--broker] [--tests] [--all] [--fuzz] [--charts] [--reference] [--pictures] [--latency]
#       [--packages] [--planning] [--python]
#     --viewer: also what building the viewer needs (node and npm)
#     --broker: also what publishing to NATS needs (libnats), and a NATS server
#     --tests: also what `scripts/test.sh` needs, so that it skips no test (the viewer, a browser for its tests;
#            OpenIGTLink's own programs, as peers; numpy, venv and mypy for Python's client, --python; mono and freeglut
#            for clients in C# and OpenGL, and a virtual screen; a wall clock that jumps; systemd's check of the unit; a
#            model checker; --broker)
#     --all: also what `scripts/test.sh --all` needs (--tests; format; names; --fuzz)
#     --fuzz: also what the preset asan needs (clang with its sanitizers and libFuzzer; DCMTK, whose files are fuzzed)
#     --import: also what brachy-import needs (DCMTK); --tests has it, with what checks its files
#     --charts: also what draws the charts of scripts/bench.sh
#     --pictures: also what scripts/charts/screenshots.sh needs, beside --all
#     --latency: also what scripts/campaigns/latency.sh compares with
#     --planning: also what scripts/charts/planning.sh and `brachy plan --method integer` need (CBC as a program, numpy)
#     --packages: also what scripts/package/package_check.sh needs, with all its options
#     --python: also what the engine as a Python module needs (pybind11)
#     --reference: also what apps/lab/reference needs (CalculiX and gmsh as programs, numpy, scipy)
set -euo pipefail

packages=(cmake ninja-build g++ lld ccache libeigen3-dev libboost-dev libassimp-dev libcli11-dev libtomlplusplus-dev
          libspdlog-dev nlohmann-json3-dev libgtest-dev libbenchmark-dev libssl-dev libcap-dev libsystemd-dev
          pkgconf zlib1g-dev python3 openssl curl dpkg-dev)  # zlib: also for assimp, whose package forgets it
broker=(libnats-dev nats-server)
python=(pybind11-dev python3-dev python3-numpy)
import=(libdcmtk-dev)
# Clients in C#, and the OpenGL example on a virtual screen.
clients=(mono-mcs mono-runtime freeglut3-dev libglu1-mesa-dev xvfb)
fuzz=(clang-14 libclang-rt-14-dev)
for option in "$@"; do
  case $option in
    --viewer | --tests | --all)
      # Another vendor's node stays as it is; Debian's packages would replace it.
      command -v npm >/dev/null || packages+=(nodejs npm)
      if [[ $option != --viewer ]]; then
        packages+=(relacy-dev faketime systemd chromium libopenigtlink-dev openigtlink-examples "${broker[@]}"
                   "${python[@]}" python3-venv mypy "${import[@]}" dicom3tools plastimatch python3-pydicom
                   "${clients[@]}")
      fi
      if [[ $option == --all ]]; then packages+=(clang-format-14 clang-tidy-14 "${fuzz[@]}"); fi
      ;;
    --python) packages+=("${python[@]}") ;;
    --broker) packages+=("${broker[@]}") ;;
    --import) packages+=("${import[@]}") ;;
    --fuzz) packages+=("${fuzz[@]}" "${import[@]}") ;;
    --pictures) packages+=(pngquant) ;;
    --latency) packages+=(rt-tests) ;;
    --packages) packages+=(debootstrap lintian systemd-container devscripts binutils) ;;
    --charts) packages+=(python3-matplotlib python3-numpy) ;;
    --planning) packages+=(coinor-cbc python3-numpy) ;;
    --reference) packages+=(calculix-ccx gmsh python3-numpy python3-scipy) ;;
    *) echo "setup: unknown option $option; there are --viewer, --broker, --tests, --all, --fuzz, --import, --charts," \
         "--pictures, --latency, --packages, --planning, --python and --reference" >&2; exit 2 ;;
  esac
done

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done
if ((${#missing[@]} == 0)); then exit 0; fi

echo "setup: installing ${missing[*]}"
as_root=()
if [[ $(id -u) != 0 ]]; then
  command -v sudo >/dev/null || { echo "setup: run as root, or install these packages first" >&2; exit 2; }
  as_root=(sudo)
fi
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
