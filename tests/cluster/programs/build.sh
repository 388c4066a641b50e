#!/usr/bin/env bash
# Build one program of one Go module.
#   build.sh MODULE PACKAGE TARGET     MODULE is a folder beside this file
set -euo pipefail
module=$1 package=$2 target=$3
cd "$(dirname "${BASH_SOURCE[0]}")/$module"

settings="-s -w"
if [[ $module == kubernetes ]]; then # without its version it doesn't even start
  version=$(go list -m -f '{{.Version}}' k8s.io/kubernetes)
  IFS=. read -r major minor _ <<<"${version#v}"
  for place in k8s.io/component-base/version k8s.io/client-go/pkg/version; do
    settings+=" -X $place.gitVersion=$version -X $place.gitMajor=$major -X $place.gitMinor=$minor -X $place.gitTreeState=clean"
  done
fi
CGO_ENABLED=0 GOFLAGS=-mod=readonly nice -n 5 go build -trimpath -buildvcs=false -ldflags "$settings" -o "$target" "$package"
