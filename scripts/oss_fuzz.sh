#!/usr/bin/env bash
# Builds the fuzz targets as OSS-Fuzz and ClusterFuzzLite ask for them: into $OUT, each with its corpus and dictionary,
# by $CXX with $CXXFLAGS and linked to $LIB_FUZZING_ENGINE. Outside of their containers these have defaults.
#   OUT=/tmp/fuzzers scripts/oss_fuzz.sh [TARGET…]
set -euo pipefail
cd "$(dirname "$0")/.."
if [[ ${1:-} == -* ]]; then sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; fi
out=${OUT:-$PWD/out/fuzzers}
work=${WORK:-$PWD/build/oss_fuzz}
engine=${LIB_FUZZING_ENGINE:--fsanitize=fuzzer}
export CXX=${CXX:-clang++-14}
# OSS-Fuzz passes its sanitizers by CXXFLAGS; fuzzer-no-link tells CMake that the libraries are instrumented.
cmake -S . -B "$work" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS="${CXXFLAGS:-}" \
    -DBRACHY_SANITIZE="${BRACHY_SANITIZE:-address,undefined,fuzzer-no-link}" -DBRACHY_FUZZING_ENGINE="$engine" \
    -DBRACHY_BENCH=OFF -DBRACHY_OPENMP=OFF -DBRACHY_NATS=OFF >/dev/null
targets=("$@")
if ((${#targets[@]} == 0)); then
  for file in tests/fuzz/*_fuzz.cpp tests/apps/lab/fuzz/*_fuzz.cpp; do
    file=${file##*/}; targets+=("${file%_fuzz.cpp}")
  done
fi
cmake --build "$work" --target "${targets[@]/%/_fuzz}"
mkdir -p "$out"
for target in "${targets[@]}"; do
  cp "$work/bin/${target}_fuzz" "$out/"
  (cd "tests/fuzz/corpus/$target" && /usr/bin/python3 -m zipfile -c "$out/${target}_fuzz_seed_corpus.zip" -- *)
  case $target in
    http*) dictionary=http ;;
    igtl*) dictionary=igtl ;;
    scene | plan) dictionary=toml ;;
    trajectory | tables | beads | session) dictionary=csv ;;
    mesh) dictionary=mesh ;;
    nrrd | label_nrrd) dictionary=nrrd ;;
    label_nifti) dictionary=nifti ;;
    label_meta) dictionary=meta ;;
    rt_*) dictionary=dicom ;;
    *) dictionary=wire ;;
  esac
  cp "tests/fuzz/dictionaries/$dictionary.dict" "$out/${target}_fuzz.dict"
done
ls "$out"
