# Functions for a separate Docker Engine, in its own network, mount and process namespaces. Source this file after settings.sh,
# debian.sh and processes.sh.
# shellcheck shell=bash
#
# The engine's network namespace has no route to the outside. Its only link leads to this machine, and the engine can open no
# connection over this link. This fence exists before the first program starts. When the first process of the namespaces ends,
# everything inside them ends too: bridges, mounts, rules, routes and containers.
# Until engine_keep is called, the engine ends with the script that started it, even if this script is killed.

ENGINE_PID_FILE=$STATE/engine.pid
LINK=palaestra0
HOST_ADDRESS=198.18.255.1
ENGINE_ADDRESS=198.18.255.2
FENCE=(unreachable "$CLUSTER_BLOCK" metric 4177) # the metric distinguishes this route from the routes of other programs

engine_fetch() {
  [[ ! -x $DOCKER/usr/sbin/dockerd ]] || return 0
  local part="$DOCKER.part" pool=pool/main/d/docker.io
  rm -rf "$part"
  debian_unpack "$pool/docker.io_${DOCKER_VERSION}_amd64.deb" "$DOCKER_ENGINE_SHA256" "$part"
  debian_unpack "$pool/docker-cli_${DOCKER_VERSION}_amd64.deb" "$DOCKER_CLIENT_SHA256" "$part"
  mv "$part" "$DOCKER"
}

engine_up() {
  needs_root
  "$HERE/packages.sh" containerd runc iptables iproute2 util-linux >&2
  locked docker engine_fetch
  ! ip link show "$LINK" >/dev/null 2>&1 || die "a cluster of another cache stands on this machine (link $LINK): remove it first."
  mkdir -p "$STATE"
  mkfifo "$STATE/owner"
  exec 8<>"$STATE/owner" # the kernel closes it when this script ends, even if this script is killed
  ip route replace "${FENCE[@]}"
  give_weight
  become_engine &
  disown
  wait_until 10 engine_is_fenced || die "the engine's network namespace could not be fenced: see $STATE/engine.log"
  link_to_engine
  wait_until 30 docker version >/dev/null 2>&1 || die "Docker Engine did not start: $(tail -3 "$STATE/engine.log")"
  docker network create kind --subnet "$NODE_SUBNET" >/dev/null
}

# On cgroup v1, a group below the root has by default the CPU weight of a single process. All pods together would then get as
# much CPU as one other process of this machine.
give_weight() {
  local shares=/sys/fs/cgroup/cpu/$CONTROL_GROUP/cpu.shares
  [[ -w /sys/fs/cgroup/cpu/cpu.shares ]] || return 0
  mkdir -p "${shares%/*}"
  echo "$CPU_SHARES" >"$shares"
}

engine_keep() { echo stay >&8; }

engine_down() {
  local outer inner
  if outer=$(recorded_process "$ENGINE_PID_FILE"); then
    inner=$(engine_first_process)
    kill -KILL "$outer" # then the first process of the namespaces is killed too, and with it all others
    wait_until 20 is_gone "$inner" || die "process $inner does not end, so the engine of an earlier run can't be removed."
  fi
  ip link del "$LINK" 2>/dev/null || true
  ip route del "${FENCE[@]}" 2>/dev/null || true
  wait_until 10 remove_control_groups || die "control groups of the engine are left: $(control_groups)"
  rm -rf "$STATE"
}

# Turn this subshell into the engine's outermost process. The record is written first, and `exec` keeps the process id. So even
# after a kill, no engine exists without a record.
become_engine() {
  record_process "$ENGINE_PID_FILE"
  exec setsid unshare --net --mount --pid --fork --kill-child --mount-proc -- \
    "$HERE/engine/init.sh" "$STATE" "$DOCKER" "$CONTROL_GROUP" >"$STATE/engine.log" 2>&1 </dev/null 8>&-
}

# Print the id of the first process of the engine's namespaces, as it is outside of these namespaces.
engine_first_process() {
  local outer inner
  outer=$(recorded_process "$ENGINE_PID_FILE") && inner=$(cat "/proc/$outer/task/$outer/children") && echo "${inner%% *}"
}

inside_engine() { nsenter --target "$(engine_first_process)" --net -- "$@"; }

engine_is_fenced() { [[ $(inside_engine ip route show default 2>/dev/null) == unreachable* ]]; }

link_to_engine() {
  ip link add "$LINK" type veth peer name host netns "$(engine_first_process)"
  echo 1 >"/proc/sys/net/ipv6/conf/$LINK/disable_ipv6"
  ip addr add "$HOST_ADDRESS/30" dev "$LINK"
  ip link set "$LINK" up
  inside_engine ip addr add "$ENGINE_ADDRESS/30" dev host
  inside_engine ip link set host up
  ip route add "$NODE_SUBNET" via "$ENGINE_ADDRESS" dev "$LINK"
}

control_groups() { find /sys/fs/cgroup -mindepth 1 -maxdepth 2 -type d -name "$CONTROL_GROUP"; }

remove_control_groups() {
  control_groups | while read -r group; do find "$group" -depth -type d -exec rmdir {} + 2>/dev/null || true; done
  [[ -z $(control_groups) ]]
}
