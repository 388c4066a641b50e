# The commands for people who work in this repository. `make help` lists them.
SHELL := /bin/bash
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

BIN := .venv/bin
PACKAGES := operator trainer sim_image
SOURCES := operator/src trainer/src sim_image/src
WEBOTS_ROS := $(addprefix sim_image/src/,palaestra_protocol/ros/definitions.txt palaestra_sim/message_package/files.py)
SIM := stub
JOB := manifests/examples/move-to-target$(addprefix -,$(SIM:stub=)).yaml
COMPILE := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header

# Python must write bytecode even if the environment forbids it; otherwise every process compiles PyTorch and all other
# modules again, which takes seconds.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup test-packages run notebook test check e2e images cluster cluster-down format bench peers soak golden lock

help: ## list the commands
	@grep -E '^[a-z0-9-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z0-9-]+):.*## (.*)/\1\t\2/' | expand -t 15

setup: .venv/ready ## install what is needed into .venv; needs no root and no package of ROS

# If the index has changed since the last setup, PyTorch is installed again from the new index.
export TORCH_INDEX
ifneq ($(TORCH_INDEX),)
ifneq ($(TORCH_INDEX),$(shell cat .venv/torch-index 2>/dev/null))
.PHONY: .venv/ready
endif
endif

.venv/ready: requirements.lock $(PACKAGES:%=%/pyproject.toml) tools/setup.sh $(WEBOTS_ROS)
	@tools/setup.sh

test-packages: .venv/test-packages ## install what only tests need from the distribution: ROS, a compiler, OpenGL, a browser

.venv/test-packages: .venv/ready tools/test-packages.sh
	@tools/test-packages.sh

run: setup ## train move-to-target on this machine, from a TrainingJob to a policy; SIM=mujoco: in MuJoCo
	@$(BIN)/palaestra run $(JOB)

notebook: setup ## open JupyterLab with the notebooks of examples/notebooks
	@tools/notebook.sh

# Four workers run at the same time, also on two processors, because many tests mostly wait for processes, leases and deadlines.
test: setup test-packages ## run all tests, and check that generated files are current
	@$(BIN)/pytest -n 4 --dist loadfile --no-loadscope-reorder --durations=10

# The checks run in parallel, the longest first. Make prints the output of each check in one piece, and reports all checks that fail.
CHECKS := check-mypy check-pyright check-lint check-format check-imports
.PHONY: $(CHECKS)

check: setup ## lint, format, types and the allowed imports
	@$(MAKE) --no-print-directory --jobs=2 --keep-going --output-sync $(CHECKS)

check-mypy:
	@$(BIN)/mypy

check-pyright:
	@$(BIN)/pyright --warnings

check-lint:
	@$(BIN)/ruff check

check-format:
	@$(BIN)/ruff format --check --quiet

check-imports:
	@$(BIN)/lint-imports

e2e: setup ## start a cluster, run the end-to-end tests on it, and delete it
	@tests/cluster/e2e.sh

images: setup ## build the container images, with docker or with buildah
	@tools/images.sh

cluster: setup ## start a cluster on this machine, and load the images into it
	@tests/cluster/up.sh >/dev/null
	@archives=$$(tools/images.sh --archives) && tests/cluster/load.sh $$(cut -d= -f2 <<<"$$archives")

cluster-down: ## delete that cluster
	@tests/cluster/down.sh

format: setup ## rewrite the sources in the common format
	@$(BIN)/ruff check --fix --quiet || true
	@$(BIN)/ruff format

bench: setup test-packages ## measure speed and memory against the project's limits; prints JSON
	@$(BIN)/python -m tests.bench

PEERS := clients collection plain startup recoveries goodput operators
RLLIB :=
peers: setup test-packages ## measure the figures of docs/explain/peers.md again; RLLIB=PYTHON: those of RLlib too
	@$(BIN)/python -m tests.bench --record docs/explain/peers.json $(PEERS) $(if $(RLLIB),--rllib $(RLLIB) rllib)
	@$(BIN)/python -m tests.golden

soak: setup test-packages ## inject faults for hours, and check that unattended training continues; prints JSON
	@$(BIN)/python -m tests.soak

golden: setup ## record the plans of the examples and other generated files again
	@$(BIN)/python -m tests.golden

lock: setup ## resolve the dependencies again, within the bounds of the pyproject files
	@$(COMPILE) --no-emit-package palaestra-sim --group dev --extra deploy --extra docker --extra mujoco --extra export --extra film --extra install --extra kubernetes --extra sweeps --extra train --extra view $(PACKAGES:%=%/pyproject.toml) -o requirements.lock
	@$(COMPILE) --group notebook --constraint requirements.lock -o images/notebook/requirements.lock
	@$(COMPILE) --group checkov -o tests/chart/checkov.lock
	@$(COMPILE) --group ros2 --constraint requirements.lock -o tests/ros2.lock
