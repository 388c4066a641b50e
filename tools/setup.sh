#!/usr/bin/env bash
# Install what Palaestra needs into .venv, on a machine with Python 3.11 or newer; needs no root.
# Safe to repeat; a failed run leaves no .venv/ready behind, so the next one starts over.
set -euo pipefail
cd "$(dirname "$0")/.."

# The environment is made from the system's interpreter and sees its packages: Debian's rospy, where it is
# installed, is in /usr/lib/python3.
PYTHON=/usr/bin/python3
uv_pin=$(grep -oE '^uv==[0-9.]+' requirements.lock)
rm -f .venv/ready
if [[ ! -x .venv/bin/uv ]]; then
  if $PYTHON -c "import ensurepip" 2>/dev/null; then
    echo "setup: making .venv"
    $PYTHON -m venv --clear --system-site-packages .venv
    .venv/bin/python -m pip install --quiet --disable-pip-version-check "$uv_pin"
  elif command -v uv >/dev/null; then
    echo "setup: making .venv with uv"
    rm -rf .venv
    uv venv --quiet --system-site-packages --python "$PYTHON" .venv
    uv pip install --quiet --python .venv "$uv_pin"
  else
    echo "$PYTHON cannot make an environment without ensurepip. Install uv, or type this line; then repeat the command:"
    echo "  sudo apt-get update && sudo apt-get install -y --no-install-recommends python3-venv"
    exit 1
  fi
fi
echo "setup: installing the locked packages (PyTorch with CUDA is 3 GB; the first time takes minutes)"
export VIRTUAL_ENV="$PWD/.venv" UV_LINK_MODE="${UV_LINK_MODE:-hardlink}"
.venv/bin/uv pip install --quiet --require-hashes -r requirements.lock
.venv/bin/uv pip install --quiet --no-deps --no-build-isolation -e operator -e trainer -e sim_image
# For programs with rospy and ROS's own tools, where ROS is installed.
if .venv/bin/python -c "import genmsg, genpy" 2>/dev/null; then
  .venv/bin/palaestra-webots-ros --importable .venv/share
fi
touch .venv/ready
