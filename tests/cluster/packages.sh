#!/usr/bin/env bash
# Install the Debian packages that were named, if they are missing; when not root, print the one line that does it and stop.
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
  # Services that come with a package (containerd) are not to run beside ours, hence the temporary policy.
  [[ -e /usr/sbin/policy-rc.d ]] || {
    trap 'rm -f /usr/sbin/policy-rc.d' EXIT
    printf '#!/bin/sh\nexit 101\n' >/usr/sbin/policy-rc.d
    chmod 755 /usr/sbin/policy-rc.d
  }
  DEBIAN_FRONTEND=noninteractive $install -qq >/dev/null
}
locked packages install_missing # images are built while the cluster comes up, and apt can't do two things at once
