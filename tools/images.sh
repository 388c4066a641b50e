#!/usr/bin/env bash
# Build the container images that have changed; --help lists the options.
set -euo pipefail
cd "$(dirname "$0")/.."
exec .venv/bin/python -m tools.images "$@"
