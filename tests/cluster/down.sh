#!/usr/bin/env bash
# Remove the cluster for the tests and everything that it started, even if a killed run has left it behind. You can repeat this
# script safely. It does not change an existing cluster (PALAESTRA_CLUSTER=existing).
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"
# shellcheck source-path=SCRIPTDIR source=debian.sh
. "$HERE/debian.sh"
# shellcheck source-path=SCRIPTDIR source=processes.sh
. "$HERE/processes.sh"
# shellcheck source-path=SCRIPTDIR source=engine.sh
. "$HERE/engine.sh"
# shellcheck source-path=SCRIPTDIR source=context.sh
. "$HERE/context.sh"

remove_stock_nodes() {
  local nodes
  docker_at_hand || return 0
  mapfile -t nodes < <(docker ps --all --quiet --filter "label=io.x-k8s.kind.cluster=$CLUSTER")
  [[ ${#nodes[@]} -eq 0 ]] || docker rm --force --volumes "${nodes[@]}" >/dev/null
}

down() {
  remove_stock_nodes
  retract_context
  if [[ -p $STATE/owner ]]; then
    needs_root
    engine_down
    "$HERE/leftovers.sh" >&2 || die "the lines above are what is left of the cluster, and should not be."
  fi
  rm -rf "$STATE"
}

if [[ ${1:-} == --locked ]]; then # up.sh has called this script, and holds the lock
  down
elif [[ ${PALAESTRA_CLUSTER:-} != existing ]]; then
  take_lock
  down 9>&-
fi
