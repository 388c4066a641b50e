# Functions that add the cluster to the person's own kubeconfig, as kind does, and that remove it again. So plain kubectl works.
# Source this file after settings.sh.
# shellcheck shell=bash

PUBLISHED=$STATE/published # has the path of the changed kubeconfig, because down.sh may run with another KUBECONFIG

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
  } >/dev/null 2>&1 || true # another program may have removed the entry
}
