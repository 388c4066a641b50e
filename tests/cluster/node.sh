#!/usr/bin/env bash
# Print the path of the node image that kind starts where no registry is reachable. The image is built once.
# It holds Debian trixie with systemd and containerd, the Kubernetes programs built from Go modules, and the unpacked images
# of the control plane.
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"
# shellcheck source-path=SCRIPTDIR source=debian.sh
. "$HERE/debian.sh"

make_debian() {
  local target=$1 tree="${1%.tar}.tree"
  [[ ! -e $target ]] || return 0
  debian_tree "$tree" "$(paste -sd, "$HERE/node/packages")"
  tar -C "$tree" --numeric-owner --exclude='./dev/*' --xattrs -cf "$target.part" .
  mv "$target.part" "$target"
  rm -rf "$tree"
}

make_node() {
  local target=$1 debian=$2 programs=$3 work="${1%.tar}.work"
  [[ ! -e $target ]] || return 0
  say "making the node image"
  rm -rf "$work"
  mkdir -p "$work"/{tree,images,programs}
  tar -C "$work/tree" --xattrs -xf "$debian"
  ln "$programs"/* "$work/programs/"
  gcc -static -O2 -s -o "$work/programs/pause" "$HERE/node/pause.c"
  PYTHONPATH=$HERE/../.. PYTHONDONTWRITEBYTECODE=1 python3 -m tests.cluster.images "$work/programs" "$work/tree" "$work/images"
  isolated "$HERE/node/fill.sh" "$work" >"$work/log" 2>&1 || die "the node's file system could not be made: $(tail -3 "$work/log")"
  tar -C "$work/tree" --numeric-owner --exclude='./dev/*' --xattrs -cf "$target.part" .
  mv "$target.part" "$target"
  rm -rf "$work"
}

needs_root
"$HERE/packages.sh" debootstrap gcc libc6-dev python3 >&2
programs=$("$HERE/programs.sh" "${NODE_PROGRAMS[@]}")
debian="$CACHE/node/debian-$(content_key debian.sh node/packages).tar"
target="$CACHE/node/node-$(content_key debian.sh node.sh archive.py images.py node programs).tar"
mkdir -p "$CACHE/node"
locked node-debian make_debian "$debian"
locked node make_node "$target" "$debian" "$programs"
find "$CACHE/node" -name '*.tar' ! -path "$debian" ! -path "$target" -delete # earlier versions
echo "$target"
