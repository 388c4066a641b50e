# The cluster's entry in the person's own kubeconfig, as kind makes it, so that plain kubectl works. Sourced, after settings.sh.
# shellcheck shell=bash

PUBLISHED=$STATE/published # where the entry is: the environment of down.sh may be another one

publish_context() {
  local personal=${KUBECONFIG:-$HOME/.kube/config}
  personal=${personal%%:*}
  [[ $personal != "$KUBECONFIG_FILE" ]] || return 0
  mkdir -p "$(dirname "$personal")"
  echo "$personal" >"$PUBLISHED"
  (
    umask 077
    KUBECONFIG=$KUBECONFIG_FILE:$personal kubectl config view --flatten >"$personal.part"
  )
  mv "$personal.part" "$personal"
  say "kubectl's current context is kind-$CLUSTER (in $personal)"
}

retract_context() {
  [[ -f $PUBLISHED ]] || return 0
  local config
  config=("$("$HERE/programs.sh" kubectl)/kubectl" --kubeconfig "$(cat "$PUBLISHED")" config)
  {
    [[ $("${config[@]}" current-context) != "kind-$CLUSTER" ]] || "${config[@]}" unset current-context
    "${config[@]}" delete-context "kind-$CLUSTER"
    "${config[@]}" delete-cluster "kind-$CLUSTER"
    "${config[@]}" delete-user "kind-$CLUSTER"
  } >/dev/null 2>&1 || true # what isn't there any more need not be removed
}
