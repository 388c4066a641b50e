#!/usr/bin/env bash
# Put images into the cluster's node.
#   load.sh ARCHIVE|NAME…     archives of images (OCI or docker save), or names of images that the Docker Engine at hand holds
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"

# Print a line that changes when the archive changes.
fingerprint() { stat -c '%n %s %Y' "$(realpath "$1")"; }

load_archive() {
  ! grep -qxF "$(fingerprint "$1")" "$STATE/loaded" 2>/dev/null || return 0
  say "loading $(basename "$1")"
  kind load image-archive --name "$CLUSTER" "$1" || die "$1 could not be loaded: is it an archive of an image?"
  fingerprint "$1" >>"$STATE/loaded"
}

load_named() {
  [[ $(cat "$STATE/way") == stock ]] || die "there is no file $1. The engine of the built way holds no images by name: give archives."
  kind load docker-image --name "$CLUSTER" "$1" || die "image $1 could not be loaded: docker image ls shows what there is."
}

if [[ ${PALAESTRA_CLUSTER:-} == existing ]]; then
  say "an existing cluster loads no images from here: it must be able to pull or already hold $*"
  exit 0
fi
[[ -f $STATE/way ]] || die "no cluster stands: make cluster"
programs=$("$HERE/programs.sh" kind)
PATH=$programs:$PATH
[[ $(cat "$STATE/way") != built ]] || use_own_docker
# All images are loaded at the same time, because one image takes nearly all of the time.
loads=()
for image in "$@"; do
  if [[ -f $image ]]; then load_archive "$image" & else load_named "$image" & fi
  loads+=($!)
done
failed=
for load in "${loads[@]}"; do wait "$load" || failed=yes; done
[[ -z $failed ]]
