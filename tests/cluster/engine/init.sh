#!/usr/bin/env bash
# The first process of the engine's namespaces. It sets up the fence, and then starts containerd and dockerd. When one of these
# two ends, everything ends.
#   init.sh STATE DOCKER CONTROL_GROUP
set -euo pipefail
state=$1 docker=$2 control_group=$3

# Until the starting script writes "stay" into the pipe, this process ends with that script, because the pipe then closes.
(read -r word <"$state/owner" && [[ $word == stay ]] && exec sleep infinity) &

# The fence. The link to this machine does not exist yet. When it exists, these rules drop every connection that begins here.
ip link set lo up
echo 1 >/proc/sys/net/ipv6/conf/default/disable_ipv6
iptables -t mangle -A FORWARD -o host -m conntrack --ctstate NEW,INVALID -j DROP
iptables -t mangle -A OUTPUT -o host -m conntrack --ctstate NEW,INVALID -j DROP
ip route add unreachable default

mount --make-rshared / # the node must see the volumes of pods; outside of this mount namespace they are invisible
mkdir -p "$state"/{containerd,docker}

cat >"$state/containerd.toml" <<END
version = 2
root = "$state/containerd/root"
state = "$state/containerd/state"
disabled_plugins = ["io.containerd.grpc.v1.cri"]
[grpc]
  address = "$state/containerd.sock"
END

cat >"$state/docker.json" <<END
{"bip": "198.18.0.1/24", "default-address-pools": [{"base": "198.18.128.0/18", "size": 24}], "dns": ["198.18.0.1"], "ipv6": false,
 "storage-driver": "overlay2", "exec-opts": ["native.cgroupdriver=cgroupfs"], "cgroup-parent": "/$control_group",
 "userland-proxy-path": "$docker/usr/sbin/docker-proxy"}
END

containerd --config "$state/containerd.toml" &
until [[ -S $state/containerd.sock ]]; do sleep 0.05; done
"$docker/usr/sbin/dockerd" --config-file "$state/docker.json" --containerd "$state/containerd.sock" --host "unix://$state/docker.sock" \
  --data-root "$state/docker/root" --exec-root "$state/docker/exec" --pidfile "$state/docker.pid" &
wait -n
