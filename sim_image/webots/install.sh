#!/bin/sh
# Unpack the archive of a Webots release, and check it: its digest, its release, its library for controllers, and
# that no shared library is missing. Optionally unpack the archive of the assets, from which Webots loads PROTOs,
# meshes and textures without a network.
# Arguments: the archive, its SHA-256, the release, the new folder of Webots; optionally the archive of the assets, its
# SHA-256, and the new folder of the assets. Needs bzip2 and Python.
set -eu

refuse() {
  echo "install.sh: $1" >&2
  exit 1
}

checked() { # the file, its SHA-256
  [ -f "$1" ] || refuse "$1: does not exist; give the archive of a Webots release"
  echo "$2  $1" | sha256sum --check --status || refuse "$1: does not have the SHA-256 $2; download it again"
}

checked "$1" "$2"
archive=$1 release=$3 home=$4
mkdir -p "$home"
tar --extract --bzip2 --no-same-owner --strip-components=1 --directory="$home" --file="$archive"

[ -f "$home/resources/version.txt" ] || refuse "$archive: has no webots/resources/version.txt; give webots-$release-x86-64.tar.bz2"
found=$(head -n 1 "$home/resources/version.txt")
case $found in
"$release" | "$release "*) ;;
*) refuse "$archive: is Webots $found, not $release; give the archive of $release, or build for $found" ;;
esac
for file in webots bin/webots-bin; do
  [ -x "$home/$file" ] || refuse "$archive: has no program webots/$file; give webots-$release-x86-64.tar.bz2"
done

library=$home/lib/controller/libController.so
python3 - "$library" <<'PYTHON' || refuse "$library: cannot be loaded; the archive is not for this processor, or is damaged"
import ctypes
import sys

ctypes.CDLL(sys.argv[1]).wb_robot_init
PYTHON
for binary in "$home/bin/webots-bin" "$home"/lib/webots/qt/plugins/platforms/libqxcb.so; do
  [ -e "$binary" ] || continue
  missing=$(LD_LIBRARY_PATH=$home/lib/webots ldd "$binary" | sed -n 's/^[[:space:]]*\(.*\) => not found$/\1/p' | sort -u | tr '\n' ' ')
  [ -z "$missing" ] || refuse "$binary: needs ${missing% }, which the image lacks; add its Debian package to Dockerfile.webots"
done
# Files that only people use, such as sample worlds' pictures and sources, stay: PROTOs and controllers may need them.

[ $# -gt 4 ] || exit 0
checked "$5" "$6"
mkdir -p "$7"
python3 -m zipfile --extract "$5" "$7"
# The archive holds the files directly, or in one folder `assets`.
if [ -d "$7/assets" ]; then
  mv "$7/assets"/* "$7/"
  rmdir "$7/assets"
fi
chmod -R a+rX "$7"
