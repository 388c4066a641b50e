#!/bin/sh
# Make a folder with the sidecar, the controller for Webots, and all that they need except a shell: Python, Python's
# libraries, the C library. Users copy the folder into their own simulator images. It works in every Linux image for the same processor type.
# Run this script inside the stub's image, after the packages are installed.
# Arguments: the folder; optionally the folder in which the packages are installed.
set -eu
target=$1
python=$(readlink -f /usr/bin/python3)
name=$(basename "$python")
installed=${2:-/usr/local/lib/$name/dist-packages}
own=$target/lib/python3/dist-packages # Debian's Python searches this folder below its prefix

mkdir -p "$target/bin" "$own"
cp "$python" "$target/lib/$name.program"
cp -a "/usr/lib/$name" "$target/lib/"
cd "$target/lib/$name"
rm -rf EXTERNALLY-MANAGED config-* ensurepip idlelib lib2to3 pydoc_data sitecustomize.py tkinter turtledemo test unittest
rm -f lib-dynload/_curses* lib-dynload/_dbm* lib-dynload/_sqlite3* lib-dynload/readline*

cp -a "$installed"/prometheus_client* "$installed"/palaestra_protocol "$installed"/palaestra_sim* "$own/"
rm -rf "$own/palaestra_sim/stub" "$own/palaestra_sim/mujoco" "$own/palaestra_sim/message_package"

for program in "$target/lib/$name.program" lib-dynload/*.so; do
  ldd "$program"
done | grep -o '/[^ ]*' | sort -u | while read -r library; do
  cp -L "$library" "$target/lib/"
done
loader=$(basename "$(ldd "$target/lib/$name.program" | grep -o '/[^ ]*/ld-linux[^ ]*')")

# The script starts the copied dynamic loader by its path, because that of the image may be older or missing.
# It sets no environment variables, because the simulator would inherit them.
cat >"$target/bin/python3" <<SCRIPT
#!/bin/sh
root=\$(cd "\${0%/*}/.." && pwd)
exec "\$root/lib/$loader" --argv0 "\$root/bin/python3" --library-path "\$root/lib" "\$root/lib/$name.program" "\$@"
SCRIPT
cat >"$target/palaestra-sidecar" <<'SCRIPT'
#!/bin/sh
exec "${0%/*}/bin/python3" -I -B -u -m palaestra_sim.sidecar.entry "$@"
SCRIPT
chmod 755 "$target/bin/python3" "$target/palaestra-sidecar"
"$target/palaestra-sidecar" --help >/dev/null
