#!/usr/bin/env bash
# Installs what is missing, once: Debian packages by name (deploy/packages.txt) and the page's npm packages.
# usage: deploy/setup.sh [--browser]     --browser: also Chromium, for the page's test
set -euo pipefail
cd "$(dirname "$0")/.."

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
have() { dpkg-query -W -f '${db:Status-Abbrev}' "$1" 2>/dev/null | grep -q '^ii'; }

wanted=$(grep -vE '^\s*(#|$)' deploy/packages.txt)
command -v node >/dev/null || wanted="$wanted nodejs"
command -v npm >/dev/null || wanted="$wanted npm"
if [ "${1:-}" = --browser ]; then wanted="$wanted chromium"; fi
missing=""
for package in $wanted; do have "$package" || missing="$missing $package"; done
if [ -n "$missing" ]; then
  echo "setup: installing$missing"
  export DEBIAN_FRONTEND=noninteractive
  as_root apt-get update -qq
  # shellcheck disable=SC2086
  as_root apt-get install -y -qq --no-install-recommends $missing >/dev/null
fi

web=client/viewer/web
if [ -f $web/package-lock.json ] && [ ! $web/node_modules/.package-lock.json -nt $web/package-lock.json ]; then
  echo "setup: npm packages of the page"
  (cd $web && npm ci --no-audit --no-fund --loglevel=error && touch node_modules/.package-lock.json)
fi
