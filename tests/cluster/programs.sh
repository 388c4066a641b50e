#!/usr/bin/env bash
# Build the programs of a cluster and print the folder that holds them. A program comes from a Go module
# (programs/*/go.mod) or from a Debian package (programs/*/debian: its path below a mirror, and its SHA-256).
#
#   programs.sh [PROGRAM…]             all of programs/list if no program is named
#
#   programs.sh --built [PROGRAM…]     build nothing; exit 3 without output if a program is missing
#
# The cache key of a program is a digest of its module. A complete program is renamed to its final name, so no call uses an
# incomplete program.
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"
# shellcheck source-path=SCRIPTDIR source=debian.sh
. "$HERE/debian.sh"

KEPT_DAYS=14 # days for which programs of earlier versions stay in the cache

build() {
  local program=$1 module=$2 package=$3 target=$4 part="$4.part"
  [[ ! -x $target ]] || return 0
  mkdir -p "$(dirname "$target")"
  if [[ -e $HERE/programs/$module/debian ]]; then
    unpack "$module" "$package" "$part"
  else
    compile "$program" "$module" "$package" "$part"
  fi
  mv "$part" "$target"
}

compile() {
  local program=$1 module=$2 package=$3 part=$4
  command -v go >/dev/null || die "$program can't be built: Go is missing. Install Go 1.26 (https://go.dev/dl) and repeat."
  say "building $program"
  "$HERE/programs/build.sh" "$module" "$package" "$part" ||
    die "$program could not be built from $HERE/programs/$module: Go's message is above."
}

unpack() {
  local module=$1 path_inside=$2 part=$3 path sha256
  read -r path sha256 <"$HERE/programs/$module/debian"
  debian_unpack "$path" "$sha256" "$part.tree"
  mv "$part.tree/$path_inside" "$part"
  rm -rf "$part.tree"
}

# Make sure that a program is in the folder of this version.
provide() {
  local program=$1 module package kept
  [[ ! -x $folder/$program ]] || return 0
  [[ $build == yes ]] || exit 3
  read -r _ module package < <(grep -E "^$program " "$HERE/programs/list") || die "$program is not in $HERE/programs/list."
  kept="$CACHE/programs/$module-$(content_key programs/build.sh "programs/$module")/$program"
  locked "program-$program" build "$program" "$module" "$package" "$kept"
  mkdir -p "$folder"
  ln -f "$kept" "$folder/$program"
}

remove_old_versions() {
  find "$CACHE/programs" -mindepth 1 -maxdepth 1 -mtime "+$KEPT_DAYS" ! -samefile "$folder" -exec rm -rf {} +
}

build=yes
if [[ ${1:-} == --built ]]; then
  build=no
  shift
fi
folder="$CACHE/programs/$(content_key programs)"
programs=("$@")
[[ $# -gt 0 ]] || mapfile -t programs < <(awk '!/^#/ {print $1}' "$HERE/programs/list")
for program in "${programs[@]}"; do
  provide "$program"
done
[[ $build == no ]] || remove_old_versions
echo "$folder"
