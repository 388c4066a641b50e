#!/usr/bin/env bash
# Bring a cluster up, install Palaestra in it, run the end-to-end tests, and remove all that was started: after success, after
# failure and after Ctrl-C. A cluster that stood before is used and left, unless a killed run of this script left it behind.
#   e2e.sh [PYTEST ARGUMENT…]     such as -k suspend
# KEEP=1 leaves the cluster standing. PALAESTRA_CLUSTER chooses the way to it, see up.sh.
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"
cd "$HERE/../.."

INSTALLATION=manifests/install.yaml
MARK=$STATE/by-e2e # this cluster was brought up here, and is to go with us
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
  elif [[ -f $MARK || ! -f $STATE/way ]]; then
    say "removing the cluster"
    "$HERE/down.sh"
  fi
  exit "$status"
}

# Let the tests clean up after themselves, and end. Ctrl-C has reached them already: a second signal would cut that short.
stop() {
  [[ -z $tests ]] || { kill -s "$1" "$tests" && wait "$tests"; } || true
  exit 130
}

bring_up() {
  [[ ! -f $MARK ]] || { say "removing what a killed run left behind" && "$HERE/down.sh"; }
  local stood=
  [[ ! -f $STATE/way ]] || stood=yes
  KUBECONFIG=$(setpriv --pdeathsig TERM "$HERE/up.sh") # ends with us, so that it leaves no cluster without the mark
  export KUBECONFIG
  [[ $stood || ${PALAESTRA_CLUSTER:-} == existing ]] || touch "$MARK"
}

# Name the archives in a file, as this goes on beside the cluster's coming up. What builds ends with this shell.
build_images() {
  { setpriv --pdeathsig TERM tools/images.sh --archives &&
    setpriv --pdeathsig TERM tools/images.sh --archives --tag next operator; } >"$CACHE/e2e-images"
}

install_palaestra() {
  local first rest
  wait "$images" || die "the images could not be built: the message is above."
  images=
  # The notebook has the layers of the trainer, and the next operator those of this one: behind them they take seconds.
  mapfile -t first < <(sed -n '1,/^operator=/{/^notebook=/!s/.*=//p}' "$CACHE/e2e-images")
  mapfile -t rest < <(cut -d= -f2 "$CACHE/e2e-images" | grep -vxF "$(printf '%s\n' "${first[@]}")")
  "$HERE/load.sh" "${first[@]}"
  "$HERE/load.sh" "${rest[@]}"
  kubectl get namespace palaestra-system >/dev/null 2>&1 || installed=yes
  kubectl apply -f "$INSTALLATION" >/dev/null
  # An image that was loaded again has the name of the one that runs.
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
# In the background, so that a signal is acted on at once; a shell makes such a process deaf to Ctrl-C, env mends that.
export PALAESTRA_E2E=1 PALAESTRA_REQUIRE_CLUSTER=1 PALAESTRA_E2E_IMAGES=$CACHE/e2e-images
env --default-signal=INT .venv/bin/pytest tests/e2e --durations=15 "$@" &
tests=$!
ended=0
wait "$tests" || ended=$? # a Ctrl-C that comes just before is acted on behind it, if this does not end the script
exit "$ended"
