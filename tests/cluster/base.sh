#!/usr/bin/env bash
# Print the path of a tar of a minimal Debian trixie tree, made once: the base of the images where no registry is reachable.
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"
# shellcheck source-path=SCRIPTDIR source=debian.sh
. "$HERE/debian.sh"

make_base() {
  local target=$1 tree="${1%.tar}.tree"
  [[ ! -e $target ]] || return 0
  debian_tree "$tree" ca-certificates
  tar -C "$tree" --numeric-owner --exclude='./dev/*' --xattrs -cf "$target.part" .
  mv "$target.part" "$target"
  rm -rf "$tree"
}

needs_root
"$HERE/packages.sh" debootstrap >&2
target="$CACHE/base/trixie-$(content_key base.sh debian.sh).tar"
mkdir -p "$CACHE/base"
locked base make_base "$target"
echo "$target"
