#!/usr/bin/env bash
# The scan must fail on a planted breach and pass on an innocent tree.
set -eu
scan=$(dirname "$(readlink -f "$0")")/include_scan.sh
root=$(mktemp -d); trap 'rm -rf "$root"' EXIT
mkdir -p "$root/server/sim/fem" "$root/common"
echo '#include <Eigen/Core>' >"$root/server/sim/fem/a.cpp"
"$scan" "$root"
echo '#include <grpcpp/grpcpp.h>' >"$root/server/sim/fem/b.cpp"
if "$scan" "$root"; then echo "the planted breach was not found"; exit 1; fi
