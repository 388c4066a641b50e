#!/usr/bin/env bash
# Start a cluster, install Palaestra in it, run the end-to-end tests, and remove everything that was started, even after a
# failure or Ctrl-C. A cluster that runs already is used and stays, unless a killed run of this script has left it behind.
#   e2e.sh [PYTEST ARGUMENT…]     such as -k suspend
# KEEP=1 keeps the cluster. PALAESTRA_CLUSTER chooses how the cluster is started, see up.sh.
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"
cd "$HERE/../.."

INSTALLATION=manifests/install.yaml
MARK=$STATE/by-e2e # exists if a run of this script has started the cluster, and so must remove it
ours=              # set before this run starts the cluster: a signal during the start is handled before the mark exists
tests=
images=
installed=

finish() {
  local status=$?
  trap '' INT TERM HUP
  trap - EXIT
  [[ -z $images ]] || kill "$images" 2>/dev/null || true
  if [[ ${KEEP:-} == 1 ]]; then
    rm -f "$MARK"
    say "KEEP=1: the cluster stands, KUBECONFIG=$(printf %q "${KUBECONFIG:-$KUBECONFIG_FILE}"); remove it with: make cluster-down"
  elif [[ ${PALAESTRA_CLUSTER:-} == existing ]]; then
    [[ -z $installed ]] || kubectl delete --ignore-not-found --timeout 120s -f "$INSTALLATION" >/dev/null || true
  elif [[ $ours || -f $MARK || ! -f $STATE/way ]]; then
    say "removing the cluster"
    "$HERE/down.sh"
  fi
  exit "$status"
}

# Send the signal to the tests, wait until they have cleaned up, and end. A Ctrl-C has already reached the tests, and a second
# signal would interrupt their cleanup. So the signal for a Ctrl-C is 0, which `kill` does not send.
stop() {
  [[ -z $tests ]] || { kill -s "$1" "$tests" && wait "$tests"; } || true
  exit 130
}

bring_up() {
  [[ ! -f $MARK ]] || { say "removing what a killed run left behind" && "$HERE/down.sh"; }
  [[ -f $STATE/way || ${PALAESTRA_CLUSTER:-} == existing ]] || ours=yes
  KUBECONFIG=$(setpriv --pdeathsig TERM "$HERE/up.sh") # up.sh ends with this script; otherwise a cluster without the mark could stay
  export KUBECONFIG
  [[ ! $ours ]] || touch "$MARK"
}

# Build the images, and write the names of their archives to a file, because this function runs in the background while the
# cluster starts. The builds end with this shell.
build_images() {
  { setpriv --pdeathsig TERM tools/images.sh --archives &&
    setpriv --pdeathsig TERM tools/images.sh --archives --tag next operator; } >"$CACHE/e2e-images"
}

install_palaestra() {
  local first rest
  wait "$images" || die "the images could not be built: the message is above."
  images=
  # The notebook's image has the layers of the trainer's image, and the operator `next` has those of this operator. So these two
  # images load in seconds after the others.
  mapfile -t first < <(sed -n '1,/^operator=/{/^notebook=/!s/.*=//p}' "$CACHE/e2e-images")
  mapfile -t rest < <(cut -d= -f2 "$CACHE/e2e-images" | grep -vxF "$(printf '%s\n' "${first[@]}")")
  "$HERE/load.sh" "${first[@]}"
  "$HERE/load.sh" "${rest[@]}"
  kubectl get namespace palaestra-system >/dev/null 2>&1 || installed=yes
  kubectl apply -f "$INSTALLATION" >/dev/null
  # A new image has the same name as the image that runs, so only a restart uses the new image.
  [[ $installed ]] || kubectl -n palaestra-system rollout restart deployment/palaestra-operator >/dev/null
  kubectl -n palaestra-system rollout status deployment/palaestra-operator --timeout 120s >/dev/null ||
    die "the operator does not become ready: kubectl -n palaestra-system describe pods"
}

trap finish EXIT
trap 'stop 0' INT
trap 'stop INT' TERM HUP
programs=$("$HERE/programs.sh" kubectl kind cyclonus helm kueue)
PATH=$programs:$PATH
mkdir -p "$CACHE"
build_images &
images=$!
bring_up
say "installing Palaestra"
install_palaestra
say "running the end-to-end tests"
# The tests run in the background, so that this shell handles a signal at once. The shell makes background processes ignore
# Ctrl-C, and `env` restores the default.
export PALAESTRA_E2E=1 PALAESTRA_REQUIRE_CLUSTER=1 PALAESTRA_E2E_IMAGES=$CACHE/e2e-images
env --default-signal=INT .venv/bin/pytest tests/e2e --durations=15 "$@" &
tests=$!
ended=0
wait "$tests" || ended=$? # `||` keeps a failure of `wait` from ending the script before the trap of a Ctrl-C runs
exit "$ended"
