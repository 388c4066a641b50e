#!/usr/bin/env bash
# Follow docs/start/laptop.md as an ordinary user of a minimal Debian: clone, then `make run`, without apt and without root.
#   first_run.sh bookworm|trixie [ARGUMENT OF MAKE…]
# The Debian has ca-certificates, git, make and python3-venv. `make` installs everything else from this machine's package index.
# This takes minutes, and 9 GB of disk until the script ends. Only this script needs root, to build and to mount the Debian.
set -euo pipefail
# shellcheck source-path=SCRIPTDIR source=settings.sh
. "$(dirname "${BASH_SOURCE[0]}")/settings.sh"
# shellcheck source-path=SCRIPTDIR source=debian.sh
. "$HERE/debian.sh"

suite=${1:-}
[[ $suite == bookworm || $suite == trixie ]] || die "which Debian? Give bookworm or trixie."
shift
needs_root
"$HERE/packages.sh" debootstrap >&2
mkdir -p "$CACHE"
top=$(mktemp -d "$CACHE/first-run.XXXXXX")
trap 'rm -rf --one-file-system "$top"' EXIT

say "making a Debian $suite from $(debian_mirror)"
isolated debootstrap --variant=minbase --include=ca-certificates,git,make,python3-venv "$suite" "$top/root" "$(debian_mirror)" \
  >"$top/log" 2>&1 || die "debootstrap failed: $(tail -1 "$top/log"). Is Debian's mirror reachable?"
mkdir -m 777 "$top/root/work"
git clone --quiet --bare --no-hardlinks "$HERE/../.." "$top/root/work/palaestra.git"
chown -R 1000:1000 "$top/root/work"
# The user has this machine's network: its name servers, certificates, and settings of the package index.
for file in /etc/resolv.conf /etc/hosts /etc/pip.conf /etc/ssl/certs/ca-certificates.crt; do
  [[ ! -e $file ]] || cp --dereference "$file" "$top/root$file"
done
mapfile -t network < <(env | grep -iE '^(https?_proxy|no_proxy|pip_[a-z_]*|uv_[a-z_]*index[a-z_]*|ssl_cert_[a-z]*)=' || true)

cat >"$top/root/work/as-a-user.sh" <<'SCRIPT'
set -euo pipefail
cd "$HOME"
git clone --quiet palaestra.git palaestra
cd palaestra
began=$SECONDS
make setup
installed=$SECONDS
make run "$@"
for run in runs/*/0; do
  test -s "$run/model.zip" && test -s "$run/report.html"
  echo "as user $(id -u) in Debian $(cat /etc/debian_version): installed in $((installed - began)) s, trained in $((SECONDS - installed)) s; $run has a policy and a report"
done
SCRIPT
isolated bash -c '
  set -e
  mount -t proc proc "$1/proc"
  mount --rbind /dev "$1/dev"
  exec chroot --userspec=1000:1000 "$1" /usr/bin/env -i HOME=/work LANG=C.UTF-8 PATH=/usr/bin:/bin "${@:2}"
' bash "$top/root" "${network[@]}" bash /work/as-a-user.sh "$@"
