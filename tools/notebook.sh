#!/usr/bin/env bash
# Open JupyterLab with a copy of the notebooks of examples/notebooks. Your copies are in notebooks/, and are never overwritten.
set -euo pipefail
cd "$(dirname "$0")/.."

if [[ ! -x .venv/bin/jupyter-lab ]]; then
  echo "notebook: installing JupyterLab into .venv"
  VIRTUAL_ENV="$PWD/.venv" .venv/bin/uv pip install --quiet --require-hashes -r images/notebook/requirements.lock
fi
mkdir -p notebooks
for file in examples/notebooks/*; do
  [[ -e notebooks/${file##*/} ]] || cp "$file" notebooks/
done
cd notebooks
export PATH="$OLDPWD/.venv/bin:$PATH" # cells of the notebooks run palaestra's programs
as_root=()
((EUID)) || as_root=(--allow-root) # without this option, Jupyter does not start as root; the server listens only on this machine
exec jupyter lab "${as_root[@]}" --ServerApp.root_dir="$PWD" --LabApp.extension_manager=readonly "$@"
