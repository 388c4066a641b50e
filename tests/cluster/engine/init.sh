#!/usr/bin/env bash
# The first process of the engine's namespaces: fence, then containerd and dockerd. When one of them ends, everything ends.
#   init.sh STATE DOCKER CONTROL_GROUP
set -euo pipefail
state=$1 docker=$2 control_group=$3

# Until the script that started this says "stay", end with it: the other end of the pipe closes.
(read -r word <"$state/owner" && [[ $word == stay ]] && exec sleep infinity) &

# The fence. There is no link yet; the one that comes leads to this machine, and nothing new may begin on it from here.
ip link set lo up
echo 1 >/proc/sys/net/ipv6/conf/default/disable_ipv6
iptables -t mangle -A FORWARD -o host -m conntrack --ctstate NEW,INVALID -j DROP
iptables -t mangle -A OUTPUT -o host -m conntrack --ctstate NEW,INVALID -j DROP
ip route add unreachable default

mount --make-rshared / # pods' volumes must be seen by the node; the other side of this mount namespace sees nothing
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
