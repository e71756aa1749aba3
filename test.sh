#!/usr/bin/env bash
# Builds everything and runs the tests. Does its own set-up; a second call does none of it again.
# usage: ./test.sh [--all] [--preset NAME] [--only REGEX]
#   --all       also the slow sweeps (label `slow`)
#   --preset    release (default), debug, asan, tsan, permissive, native
#   --only      ctest's -R
set -euo pipefail
cd "$(dirname "$0")"
preset=release; select=(-LE slow); only=()
while [ $# -gt 0 ]; do
  case "$1" in
    --all) select=() ;;
    --preset) preset=$2; shift ;;
    --only) only=(-R "$2"); shift ;;
    -h|--help) sed -n '2,6p' "$0" | cut -c3-; exit 0 ;;
    *) echo "test.sh: unknown option $1 (see --help)" >&2; exit 2 ;;
  esac
  shift
done
deploy/setup.sh --browser
if [ "$preset" = tsan ]; then  # the threaded parts
  deploy/build.sh tsan threaded_tests
  select+=(-L threaded)
  export TSAN_OPTIONS="suppressions=$PWD/tests/support/tsan.supp halt_on_error=1 history_size=7"
else
  deploy/build.sh "$preset"
fi
if [ "$preset" = asan ]; then
  export LSAN_OPTIONS="suppressions=$PWD/tests/support/lsan.supp" UBSAN_OPTIONS="print_stacktrace=1 halt_on_error=1"
fi
exec ctest --test-dir "build/$preset" --output-on-failure -j "$(nproc)" "${select[@]}" "${only[@]}"
