#!/usr/bin/env bash
# Load the archive of an image into the Docker Engine that runs the cluster, and run a command in the network namespace of this
# engine's host.
#   beside_containers.sh ARCHIVE COMMAND…
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"
# shellcheck source-path=SCRIPTDIR source=processes.sh
. "$HERE/processes.sh"
# shellcheck source-path=SCRIPTDIR source=engine.sh
. "$HERE/engine.sh"

[[ -f $STATE/way ]] || die "no cluster stands, so no engine runs: make cluster"
archive=$1
shift
if [[ $(cat "$STATE/way") == stock ]]; then
  docker load --quiet --input "$archive" >/dev/null
  exec "$@"
fi
use_own_docker
docker load --quiet --input "$archive" >/dev/null
exec nsenter --target "$(engine_first_process)" --net -- "$@"
