#!/usr/bin/env bash
# Configures and builds one preset, and the page; prints little unless something fails.
# usage: deploy/build.sh [PRESET [TARGET]]
#   PRESET: release (default), debug, asan, tsan, permissive, native;  TARGET: all (default), programs
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${1:-release}
target=${2:-all}
log=build/$preset/build.log
mkdir -p "build/$preset"

[ -f "build/$preset/build.ninja" ] || cmake --preset "$preset" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
echo "build: $preset $target (log: $log)"
if [ -t 1 ]; then
  cmake --build --preset "$preset" --target "$target" || exit 1
else
  cmake --build --preset "$preset" --target "$target" >"$log" 2>&1 || { grep -E -A8 'error|FAILED' "$log" | tail -n 80 >&2; exit 1; }
fi

web=client/viewer/web
if [ -f $web/package.json ]; then
  newest=$(find $web -path $web/node_modules -prune -o -path $web/dist -prune -o -type f -printf '%T@\n' | sort -n | tail -n 1)
  built=$(stat -c %Y $web/dist/index.html 2>/dev/null || echo 0)
  if [ "${newest%.*}" -ge "$built" ]; then
    echo "build: the page"
    (cd $web && npm run --silent build >/dev/null)
  fi
fi
