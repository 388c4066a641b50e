#!/usr/bin/env bash
# Install the named Debian packages that are missing. If you are not root, the script prints the command for it, and fails.
#   packages.sh PACKAGE…
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"

command -v dpkg-query >/dev/null || die "this is not Debian, so these packages can't be installed here: $*"

missing=()
for package in "$@"; do
  [[ $(dpkg-query -W -f '${db:Status-Abbrev}' "$package" 2>/dev/null) == ii* ]] || missing+=("$package")
done
[[ ${#missing[@]} -gt 0 ]] || exit 0

install="apt-get install -y --no-install-recommends ${missing[*]}"
[[ $EUID -eq 0 ]] || die "packages are missing. Type this line, then repeat the command:
  sudo apt-get update && sudo $install"

install_missing() {
  say "installing ${missing[*]}"
  apt-get update -qq
  # This temporary policy prevents that apt starts the services of the packages, such as containerd, next to our own processes.
  [[ -e /usr/sbin/policy-rc.d ]] || {
    trap 'rm -f /usr/sbin/policy-rc.d' EXIT
    printf '#!/bin/sh\nexit 101\n' >/usr/sbin/policy-rc.d
    chmod 755 /usr/sbin/policy-rc.d
  }
  DEBIAN_FRONTEND=noninteractive $install -qq >/dev/null
}
locked packages install_missing # the build of the images and the start of the cluster run at the same time, but apt runs only once
