#!/usr/bin/env bash
# Install what Palaestra needs into .venv, on a machine with Python 3.11 or newer; needs no root.
# With TORCH_INDEX, PyTorch comes from that package index, for example from PyTorch's index with builds for CPUs.
# You can repeat this script safely: a failed run leaves no .venv/ready behind, so the next run starts over.
set -euo pipefail
cd "$(dirname "$0")/.."

# The environment uses the system's interpreter and can import its packages: if Debian's rospy is installed, it is
# in /usr/lib/python3.
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
export VIRTUAL_ENV="$PWD/.venv" UV_LINK_MODE="${UV_LINK_MODE:-hardlink}"
uv=.venv/bin/uv

# Print the lock without PyTorch, and without the packages that only its build for CUDA needs.
without_torch() { awk '/^[^ #]/ { dropped = /^(torch|triton|nvidia-[a-z0-9-]+)==/ } !dropped' requirements.lock; }

# The chosen index is stored, so that a later `make setup` without TORCH_INDEX does not install the large build again.
index=${TORCH_INDEX:-$(cat .venv/torch-index 2>/dev/null || true)}
if [[ -z $index ]]; then
  echo "setup: installing the locked packages (PyTorch with CUDA is 3 GB to download, 5 GB on the disk;" \
    "docs/start/laptop.md has a smaller one for a machine without a GPU)"
  $uv pip install --quiet --require-hashes -r requirements.lock
else
  torch=$(grep -oE '^torch==[0-9.]+' requirements.lock)
  echo "setup: installing the locked packages, and $torch from $index (a build for the processor alone is 0.2 GB)"
  without_torch >.venv/without-torch.lock
  # The lock names every dependency, so --no-deps suffices; a resolver would fail, because this copy lacks PyTorch.
  $uv pip install --quiet --require-hashes --no-deps -r .venv/without-torch.lock
  mapfile -t cuda < <($uv pip freeze | grep -oE '^(triton|nvidia-[a-z0-9-]+)==' | tr -d '=')
  if ((${#cuda[@]})); then
    $uv pip uninstall --quiet "${cuda[@]}" torch
  fi
  $uv pip install --quiet --no-deps --index-url "$index" "$torch"
  echo "$index" >.venv/torch-index
fi
$uv pip install --quiet --no-deps --no-build-isolation -e operator -e trainer -e sim_image
# If ROS is installed, programs with rospy and ROS's own tools need the package webots_ros.
if .venv/bin/python -c "import genmsg, genpy" 2>/dev/null; then
  .venv/bin/palaestra-webots-ros --importable .venv/share
fi
touch .venv/ready
