#!/usr/bin/env bash
# Shows a scene: builds what is missing, starts the server and the page, and prints their addresses and the progress.
# usage: ./demo.sh [--scene NAME] [--headless] [--steps N] [--build-only] [--port N]
#   --scene NAME    a scene of deploy/scenes (default crash.json)
#   --headless      no page wanted: no browser is opened
#   --steps N       ends, with success, when the world has taken N steps (default: runs until Ctrl-C)
#   --build-only    stops after building
#   --port N        of the page (default 8080; 0: any free one)
set -euo pipefail
cd "$(dirname "$0")"
scene=crash.json; headless=0; steps=0; build_only=0; port=8080
while [ $# -gt 0 ]; do
  case "$1" in
    --scene) scene=${2:?}; shift ;;
    --steps) steps=${2:?}; shift ;;
    --port) port=${2:?}; shift ;;
    --headless) headless=1 ;;
    --build-only) build_only=1 ;;
    -h|--help) sed -n '2,9p' "$0" | cut -c3-; exit 0 ;;
    *) echo "demo.sh: unknown option $1 (see --help)" >&2; exit 2 ;;
  esac
  shift
done
case "$scene" in *.json) ;; *) scene=$scene.json ;; esac
deploy/setup.sh
deploy/build.sh release programs
if [ $build_only = 1 ]; then exit 0; fi

bin=build/release/bin
log=$(mktemp -d)
pids=()
stop() {
  trap - EXIT INT TERM
  for pid in "${pids[@]}"; do kill -TERM "$pid" 2>/dev/null || true; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null || true; done
  rm -rf "$log"
}
trap stop EXIT
trap 'echo; stop; exit 0' INT TERM

# await FILE PATTERN PID: the first line of FILE that matches, or fails with the file if the program ends
await() {
  for _ in $(seq 300); do
    if grep -m1 -oE "$2" "$1"; then return 0; fi
    kill -0 "$3" 2>/dev/null || break
    sleep 0.1
  done
  cat "$1" >&2
  return 1
}
$bin/crumple-server --listen 127.0.0.1:0 --scenes deploy/scenes --threads 2 --quiet >"$log/server" 2>&1 &
pids+=($!)
server=$(await "$log/server" '127\.0\.0\.1:[0-9]+' $!)
$bin/crumple-viewer --server "$server" --scene "$scene" --port "$port" >"$log/viewer" 2>&1 &
pids+=($!)
page=$(await "$log/viewer" 'http://[^ ]+' $!)
echo "server  $server"
echo "page    $page"
if [ $headless = 0 ] && [ -n "${DISPLAY:-}" ] && command -v xdg-open >/dev/null; then xdg-open "$page" >/dev/null 2>&1 || true; fi
[ $headless = 1 ] || echo "Open the page; click a body to push it. Ctrl-C ends."

until=()
if [ "$steps" -gt 0 ]; then until=(--until "$steps"); fi
$bin/crumple --server "$server" progress 1 "${until[@]}" &
watcher=$!
pids+=("$watcher")
wait "$watcher"
