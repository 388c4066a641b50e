#!/usr/bin/env bash
# Start the cluster for the tests, and print the path of its kubeconfig. You can repeat this script safely: it does not change a
# cluster that runs, and it first removes everything that an interrupted run has left behind.
#
# PALAESTRA_CLUSTER chooses how the cluster is started:
# - "stock": kind's node image in the local Docker Engine.
# - "built": engine and node image built here from Debian packages and Go modules, as root.
# - "existing": the cluster of $KUBECONFIG; nothing is started.
# If PALAESTRA_CLUSTER is not set: "stock" if Docker and the node image are available, otherwise "built".
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

way_at_hand() {
  ! docker_at_hand || say "a Docker Engine is at hand; looking for $STOCK_NODE_IMAGE"
  if docker_at_hand && { docker image inspect "$STOCK_NODE_IMAGE" || timeout 300 docker pull "$STOCK_NODE_IMAGE"; } >/dev/null 2>&1; then
    echo stock
  else
    echo built
  fi
}

up_existing() {
  [[ -n ${KUBECONFIG:-} ]] || die "PALAESTRA_CLUSTER=existing needs KUBECONFIG, the file that says where the cluster is."
  local programs
  programs=$("$HERE/programs.sh" kubectl)
  "$programs/kubectl" version >/dev/null || die "the cluster of $KUBECONFIG does not answer."
  say "using the existing cluster of $KUBECONFIG"
  echo "$KUBECONFIG"
}

# Start kind, which is killed when this script ends. It runs in the background, so that this script handles a signal at once.
# The working directory must be this folder, because kind.yaml has relative paths of the files that it mounts.
create_cluster() {
  say "creating the cluster"
  setpriv --pdeathsig KILL env --chdir "$HERE" \
    kind create cluster --name "$CLUSTER" --image "$1" --config "$2" --kubeconfig "$STATE/kubeconfig.part" --wait 180s \
    >"$STATE/kind.log" 2>&1 8>&- &
  wait $! || die "kind could not create the cluster:
$(tail -40 "$STATE/kind.log")"
}

up_stock() {
  say "way: kind's own node image $STOCK_NODE_IMAGE, by the Docker Engine at hand"
  create_cluster "$STOCK_NODE_IMAGE" "$HERE/kind.yaml"
}

up_built() {
  say "way: engine and node image made here, from Debian packages and Go modules"
  local image node_image=palaestra.dev/node:built address
  image=$("$HERE/node.sh")
  use_own_docker
  engine_up
  say "taking in the node image"
  docker import -c 'ENV container=docker' -c 'STOPSIGNAL SIGRTMIN+3' -c 'ENTRYPOINT ["/usr/local/bin/entrypoint","/sbin/init"]' \
    "$image" "$node_image" >/dev/null
  cat "$HERE/kind.yaml" "$HERE/node/kind-patches.yaml" >"$STATE/kind.yaml"
  create_cluster "$node_image" "$STATE/kind.yaml"
  address=$(docker inspect -f '{{.NetworkSettings.Networks.kind.IPAddress}}' "$CLUSTER-control-plane")
  # kind wrote an address that is valid only in the engine's network namespace
  kubectl --kubeconfig "$STATE/kubeconfig.part" config set-cluster "kind-$CLUSTER" --server "https://$address:6443" >/dev/null
  engine_keep
}

clean_up() {
  local status=$?
  say "removing what was started"
  "$HERE/down.sh" --locked
  exit "$status"
}

is_standing() {
  [[ -f $STATE/way ]] && kubectl --kubeconfig "$KUBECONFIG_FILE" --request-timeout 5s get --raw /readyz >/dev/null 2>&1
}

wait_for_system() {
  local deployment
  for deployment in kube-system/coredns local-path-storage/local-path-provisioner; do
    kubectl --kubeconfig "$STATE/kubeconfig.part" -n "${deployment%/*}" rollout status "deployment/${deployment#*/}" --timeout 120s >/dev/null ||
      die "the cluster's own $deployment does not become ready."
  done
}

up() {
  local programs found
  found=$(command -v kubectl || true)
  programs=$("$HERE/programs.sh" kubectl kind)
  PATH=$programs:$PATH
  if is_standing; then
    say "the cluster stands already ($(cat "$STATE/way"))"
  else
    trap clean_up EXIT
    trap 'exit 130' INT TERM HUP
    "$HERE/down.sh" --locked
    mkdir -p "$STATE"
    "up_$1"
    wait_for_system
    mv "$STATE/kubeconfig.part" "$KUBECONFIG_FILE"
    publish_context
    echo "$1" >"$STATE/way"
    trap - EXIT
  fi
  [[ $found ]] || say "kubectl is not on the PATH; there is one here: export PATH=\$PATH:$(printf %q "$programs")"
  echo "$KUBECONFIG_FILE"
}

way=${PALAESTRA_CLUSTER:-$(way_at_hand)}
case $way in
existing) up_existing ;;
stock | built)
  take_lock
  up "$way" 9>&-
  ;;
*) die "PALAESTRA_CLUSTER is \"$way\", but it is one of stock, built, existing, or not set." ;;
esac
