#!/usr/bin/env bash
# Print the folder that holds Kueue, built once from its Go module:
# - `image.tar`: the manager's image under its registry name.
# - `chart`: the chart that `helm install … oci://registry.k8s.io/kueue/charts/kueue` would pull. It refers to that image;
#   a node pulls the image only if it does not have it.
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"

# Print the folder of the module's own files; the build has downloaded it, unless the program was kept for longer.
module() {
  cd "$HERE/programs/kueue"
  go mod download sigs.k8s.io/kueue
  go list -m -f '{{.Dir}}' sigs.k8s.io/kueue
}

make_kueue() {
  local target=$1 program=$2 part="$1.part" source
  [[ ! -e $target ]] || return 0
  source=$(module) || die "Kueue's module can't be had: Go's message is above."
  rm -rf "$part"
  mkdir -p "$part"
  cp -r --no-preserve=mode "$source/charts/kueue" "$part/chart"
  PYTHONPATH=$HERE/../.. PYTHONDONTWRITEBYTECODE=1 python3 -m tests.cluster.kueue "$program" "$part/chart/values.yaml" "$part/image.tar"
  mv "$part" "$target"
}

programs=$("$HERE/programs.sh" kueue)
target="$CACHE/kueue/$(content_key kueue.sh kueue.py archive.py images.py programs/build.sh programs/kueue)"
mkdir -p "$CACHE/kueue"
locked kueue make_kueue "$target" "$programs/kueue"
find "$CACHE/kueue" -mindepth 1 -maxdepth 1 ! -path "$target" -exec rm -rf {} + # earlier versions
echo "$target"
