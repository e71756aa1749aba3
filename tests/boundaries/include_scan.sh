#!/usr/bin/env bash
# usage: include_scan.sh ROOT    Fails and names file and line where a room includes what it must not see.
set -u
cd "$1" || exit 2
breach=0
# forbid FOLDERS PATTERN WHY [EXCEPT]: no #include matching PATTERN below FOLDERS, but in files matching EXCEPT
forbid() {
  local hits
  # shellcheck disable=SC2086
  hits=$(grep -rnE --include='*.h' --include='*.cpp' "#include *[<\"]($2)" $1 2>/dev/null | grep -vE "${4:-^$}")
  if [ -n "$hits" ]; then
    printf '%s\n%s\n' "$3:" "$hits"
    breach=1
  fi
}
net='grpc|google/protobuf|dds/|crumple/v1'
forbid "common" "server/|client/|spdlog|$net" "common sees only Eigen, zstd and the standard library"
forbid "server/sim" "server/(authoring|io|runtime|grpc|dds|batch|lab|worker|rig|scene_convert)|client/|spdlog|fstream|filesystem|boost/|assimp|chrono|$net" \
  "the core knows no network, no files, no log and no clock"
forbid "server/sim" "btBullet|bullet|BulletCollision|BulletDynamics|LinearMath" "only rigid_world sees Bullet" \
  "^server/sim/rigid/"
forbid "server common client" "cholmod" "only cholesky.cpp sees CHOLMOD" "^server/sim/linear_solver/cholesky.cpp"
forbid "server common client" "metis" "only mesh_partition.cpp sees METIS" "^server/sim/islands/mesh_partition.cpp"
forbid "server/sim" "thread>|mutex>|atomic>" "only parallel_for knows threads" "^server/sim/parallel_for\\."
forbid "server/authoring" "server/(io|runtime|grpc|lab|worker|rig/|scene_convert)|client/|$net" "authoring sees the core only"
forbid "server/scene_convert" "grpc|server/(io|runtime|grpc|lab|worker)|fstream|filesystem" "conversion knows no files and no network"
forbid "server/io" "grpc|server/(runtime|grpc|lab|worker|rig/)|client/" "io knows no network"
forbid "server/runtime" "$net|server/(io|grpc|lab|worker|scene_convert)|client/" "runtime knows no messages"
forbid "server/lab server/worker server/rig" "grpc|server/(grpc|runtime)|client/" "lab, worker and rig know no network"
forbid "client" "server/" "clients see the wire only" "^client/sdk/in_process"
exit $breach
