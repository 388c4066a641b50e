#!/usr/bin/env bash
# Print everything that a removed cluster has left on this machine: processes, mounts, links, routes, firewall rules, control
# groups and files. The script succeeds if nothing is left. If this machine runs a Docker Engine of its own, the bridges, rules
# and routes of that engine do not count.
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"

# Print the processes whose command line contains our folder, and the processes in the engine's control groups.
processes() {
  local folder
  for folder in /proc/[0-9]*; do
    if [[ ${folder#/proc/} != "$$" ]] &&
      { tr '\0' ' ' <"$folder/cmdline" | grep -F "$STATE/" || grep -F ":/$CONTROL_GROUP/" "$folder/cgroup"; } >/dev/null 2>&1; then
      echo "process ${folder#/proc/}: $(tr '\0' ' ' <"$folder/cmdline" 2>/dev/null)"
    fi
  done
}

network() {
  ip -o link show palaestra0 2>/dev/null | sed 's/^/link /' || true
  ip route show | grep -E '(^| )198\.1[89]\.' | grep -E 'unreachable|palaestra0' | sed 's/^/route /' || true
  ip netns list | grep -i palaestra | sed 's/^/network namespace /' || true
}

# Print the nodes in this machine's own Docker Engine. Without such an engine, print the links and rules that only an engine of
# ours can have created outside of its network namespace, by an error.
containers() {
  if docker_at_hand; then
    docker ps --all --filter "label=io.x-k8s.kind.cluster=$CLUSTER" --format 'container {{.Names}}'
    return
  fi
  ip -o link show | grep -oE '(docker0|br-[0-9a-f]{12})[@:]' | sed 's/.$//; s/^/link /' || true
  for table in filter nat mangle; do
    iptables -t "$table" -S 2>/dev/null | grep -E 'DOCKER|KUBE-|198\.1[89]\.|palaestra' | sed "s/^/rule in $table: /" || true
  done
}

files() {
  awk '{print "mount " $5}' /proc/self/mountinfo | grep -F -e " $STATE/" -e " $CACHE/node/" -e " $CACHE/base/" || true
  find /sys/fs/cgroup -maxdepth 2 -type d -name "$CONTROL_GROUP" -printf 'control group %p\n'
  [[ ! -e $STATE ]] || echo "folder $STATE"
}

found=$(processes; network; containers; files)
[[ -z $found ]] || { echo "$found"; exit 1; }
