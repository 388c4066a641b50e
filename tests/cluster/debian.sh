# Debian without installing it: trees made by debootstrap, and single packages pinned by checksum. Sourced, after settings.sh.
# shellcheck shell=bash

# Print Debian's mirror as this machine has it set up, or the public one.
debian_mirror() {
  local found
  # shellcheck disable=SC2016  # the dollar is apt's own
  found=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' 2>/dev/null | grep -E '/debian/?$' | head -1 || true)
  echo "${found:-http://deb.debian.org/debian}"
}

# Leave documentation and translations out, now and from later packages, but not the licences.
make_slim() {
  local tree=$1
  {
    printf 'path-exclude /usr/share/%s/*\n' doc man info locale
    echo 'path-include /usr/share/doc/*/copyright'
  } >"$tree/etc/dpkg/dpkg.cfg.d/slim"
  find "$tree/usr/share/doc" -mindepth 2 ! -type d ! -name copyright -delete
  rm -rf "$tree"/usr/share/{man,info,locale,lintian}/*
  rm -rf "$tree"/var/cache/apt/{*.bin,archives/*.deb} "$tree"/var/lib/apt/lists/* "$tree"/var/log/*
}

# Name the updates beside the release itself, as the official image does.
#   apt_sources MIRROR
apt_sources() {
  local keyring="signed-by=/usr/share/keyrings/debian-archive-keyring.gpg" suite
  for suite in trixie trixie-updates; do echo "deb [$keyring] $1 $suite main"; done
  echo "deb [$keyring] ${1%/}-security trixie-security main"
}

# Fill a folder with trixie, less documentation and translations as in the official slim image.
#   debian_tree FOLDER [PACKAGE,PACKAGE…]
debian_tree() {
  local tree=$1 packages=${2:-} log="$1.log"
  rm -rf "$tree"
  mkdir -p "$tree"
  say "making a Debian trixie tree from $(debian_mirror)"
  isolated debootstrap --variant=minbase ${packages:+--include="$packages"} trixie "$tree" "$(debian_mirror)" >"$log" 2>&1 ||
    die "debootstrap failed: $(tail -1 "$log") (all of it: $log). Is Debian's mirror reachable?"
  make_slim "$tree"
  apt_sources "$(debian_mirror)" >"$tree/etc/apt/sources.list"
  rm -f "$log" "$tree/etc/resolv.conf" "$tree/etc/hostname" # the last two are those of this machine
}

# Unpack a package of trixie into a folder.
#   debian_unpack PATH_BELOW_THE_MIRROR SHA256 FOLDER
debian_unpack() {
  local path=$1 sha256=$2 folder=$3 file
  mkdir -p "$folder"
  file="$folder/$(basename "$path")"
  /usr/lib/apt/apt-helper download-file "$(debian_mirror)/$path" "$file" "SHA256:$sha256" >"$file.log" 2>&1 ||
    die "$(debian_mirror)/$path could not be had with checksum $sha256: $(tail -1 "$file.log")
  Debian keeps only the newest version: if there is a newer one, set it and its checksum where they stand below $HERE."
  dpkg-deb -x "$file" "$folder"
  rm "$file" "$file.log"
}
