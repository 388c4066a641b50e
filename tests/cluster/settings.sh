# Paths, versions and common functions of the scripts in this folder, which source this file.
# shellcheck shell=bash disable=SC2034

HERE=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
CACHE=${PALAESTRA_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/palaestra}

# A message that cannot be written, for example to a full disk or to a pipe without a reader, does not end a script, because the
# script must still remove the cluster.
say() { (trap '' PIPE && echo "cluster: $*" >&2) || true; }
die() { say "$*"; exit 1; }

# Print 12 hexadecimal digits of a digest of the named files and folders; their paths are relative to this folder.
content_key() {
  (cd "$HERE" && find "$@" -type f -print0 | LC_ALL=C sort -z | xargs -0 sha256sum) | sha256sum | cut -c1-12
}

# Run a command while holding the lock with this name, so that two calls never build the same file at the same time.
locked() {
  local name=$1
  shift
  mkdir -p "$CACHE/locks"
  (
    exec 9>"$CACHE/locks/$name"
    flock 9
    "$@" 9>&-
  )
}

needs_root() {
  [[ $EUID -eq 0 ]] || die "this makes root file systems and network namespaces, so it must run as root: repeat it with sudo."
}

# Run a command in namespaces of its own, so that its mounts and processes end with it, even if it is killed.
isolated() { unshare --mount --pid --fork --kill-child --mount-proc -- "$@"; }

CLUSTER=palaestra
STATE=$CACHE/kind # all files of a running cluster; removed together with the cluster
CONTROL_GROUP=palaestra-$(sha256sum <<<"$STATE" | cut -c1-8)
CPU_SHARES=8192 # CPU weight of the control group; one process has 1024
KUBECONFIG_FILE=$STATE/kubeconfig

# With PALAESTRA_CLUSTER=stock: kind's own node image, for the version of kind in programs/kind. PALAESTRA_NODE_IMAGE names
# another node image, for another version of Kubernetes.
STOCK_NODE_IMAGE=${PALAESTRA_NODE_IMAGE:-kindest/node:v1.36.1@sha256:3489c7674813ba5d8b1a9977baea8a6e553784dab7b84759d1014dbd78f7ebd5}

# With PALAESTRA_CLUSTER=built: Docker Engine, unpacked from the packages of Debian trixie. The Docker Engine of Debian bookworm
# cannot start privileged containers without CAP_SYS_RESOURCE.
DOCKER_VERSION=26.1.5+dfsg1-9+deb13u1
DOCKER_ENGINE_SHA256=142fe32f839a20720b2e6074b8d28d883b01bc45345f7315586b0c2d348dae87
DOCKER_CLIENT_SHA256=e78ac35b7a21652546ca1a739f63e4f31fe52e4385a9baf7020be400c594f23d
DOCKER=$CACHE/docker/$DOCKER_VERSION

# All addresses in a built cluster are from the block for benchmarks (RFC 2544), which no real network uses.
CLUSTER_BLOCK=198.18.0.0/15
NODE_SUBNET=198.18.64.0/24

# Let kind and docker connect to our own engine, for a built cluster.
use_own_docker() { export DOCKER_HOST=unix://$STATE/docker.sock PATH=$DOCKER/usr/bin:$PATH; }

NODE_PROGRAMS=(etcd kube-apiserver kube-controller-manager kube-scheduler kubelet kube-proxy kubeadm kubectl coredns local-path-provisioner)

docker_at_hand() { command -v docker >/dev/null && timeout 10 docker version >/dev/null 2>&1; }

# Take the lock for starting and removing the cluster, and hold it in file descriptor 9 until this script ends. Callers run the
# work with 9>&-, so that a process that outlives the script does not hold the lock.
take_lock() {
  mkdir -p "$CACHE/locks"
  exec 9>"$CACHE/locks/cluster"
  flock 9
}
