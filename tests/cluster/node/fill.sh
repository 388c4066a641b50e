#!/usr/bin/env bash
# Put programs, units, network and images into the node's file system. Runs isolated: its mounts go with it.
#   fill.sh WORK     a folder with tree/, programs/ and images/
set -euo pipefail
work=$1 tree=$1/tree
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

install_files() {
  install -m755 "$work"/programs/{kubelet,kubectl,kubeadm} "$tree/usr/bin/"
  install -Dm755 "$here/entrypoint" "$tree/usr/local/bin/entrypoint"
  install -Dm644 "$here/containerd.toml" "$tree/etc/containerd/config.toml"
  install -Dm644 -t "$tree/kind/manifests" "$here"/manifests/*.yaml
  install -Dm644 "$here/network.conflist" "$tree/kind/network.conflist"
  "$work/programs/kubectl" version --client -o yaml | awk '/gitVersion/ {print $2}' >"$tree/kind/version"
  mkdir -p "$tree"/opt/cni/bin "$tree"/etc/kubernetes/manifests "$tree"/etc/cni/net.d
  rm -f "$tree"/etc/cni/net.d/*
  (cd "$tree/usr/lib/cni" && ln -f ptp host-local loopback portmap bridge "$tree/opt/cni/bin/")
  printf 'net.ipv4.conf.all.route_localnet=1\nnet.ipv4.conf.all.arp_ignore=0\n' >"$tree/etc/sysctl.d/10-node.conf"
  rm -f "$tree/usr/sbin/policy-rc.d" # debootstrap's: no service was to start
  : >"$tree/etc/resolv.conf"
}

# Leave to systemd only what a container needs: no devices, no consoles, no temporary files of a machine.
configure_systemd() {
  local system="$tree/lib/systemd/system"
  rm -f "$system"/{multi-user,local-fs,basic}.target.wants/* "$tree"/etc/systemd/system/*.wants/* "$system"/sockets.target.wants/*udev*
  rm -f "$system"/sysinit.target.wants/{systemd-udevd,systemd-udev-trigger,systemd-tmpfiles-setup,systemd-binfmt,proc-sys-fs-binfmt_misc}*
  install -Dm644 -t "$tree/etc/systemd/system" "$here"/units/*
  chroot "$tree" systemctl enable -q containerd kubelet real-cgroups pod-network
  chroot "$tree" systemctl mask -q systemd-binfmt.service
  printf '[Journal]\nReadKMsg=no\n' >>"$tree/etc/systemd/journald.conf"
  ln -sf /usr/lib/systemd/systemd "$tree/sbin/init"
}

# The node's own containerd, in a chroot, takes the images in, so that a new node has them at once.
import_images() {
  local archive containerd deadline=$((SECONDS + 30))
  mkdir "$tree/images"
  mount -t proc proc "$tree/proc"
  mount --rbind /sys "$tree/sys"
  mount --rbind /dev "$tree/dev"
  mount -t tmpfs tmpfs "$tree/run"
  mount --bind "$work/images" "$tree/images"
  printf 'version = 2\ndisabled_plugins = ["io.containerd.grpc.v1.cri"]\n' >"$tree/run/containerd.toml"
  chroot "$tree" containerd -c /run/containerd.toml &
  containerd=$!
  until chroot "$tree" ctr version >/dev/null 2>&1; do
    ((SECONDS < deadline)) || { echo "containerd did not start in 30 s"; return 1; }
    sleep 0.1
  done
  for archive in "$tree"/images/*.tar; do
    chroot "$tree" ctr -n k8s.io images import --discard-unpacked-layers --all-platforms "/images/$(basename "$archive")"
  done
  kill "$containerd"
  wait "$containerd" || true
  umount --recursive "$tree"/{images,run,dev,sys,proc}
  rmdir "$tree/images"
  rm -rf "$tree/var/lib/containerd/io.containerd.snapshotter.v1.blockfile"
}

install_files
configure_systemd
import_images
