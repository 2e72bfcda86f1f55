# Every target but test-oldest, lock, clean and help works in .venv, which is built from requirements.lock when it is
# missing or out of date. Another interpreter: make setup PYTHON=python3.12 (after make clean).

PYTHON ?= python3
UV ?= uv
OLDEST_PYTHON ?= python3.11

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --no-input
LOCKED := $(VENV)/.locked
READY := $(VENV)/.ready
OBJECTS := kerrcaustics/beams/kernels/objects
COMPILED := $(OBJECTS)/.sources
SOURCES := $(shell find kerrcaustics/beams kerrcaustics/spacetime kerrcaustics/lens_map/crossing_formulas.py \
	kerrcaustics/lens_map/newton_formulas.py kerrcaustics/lens_map/newton_limits.py kerrcaustics/waves/wave_formulas.py \
	$(wildcard kerrcaustics/scenes/*_formulas.py kerrcaustics/scenes/disk/*_formulas.py) \
	-name '*.py' -o -name '*.h' -o -name '*.cc')
# Sources that were renamed, added or removed since the kernels were compiled, whatever their dates.
LISTED := $(shell cat $(COMPILED) 2>/dev/null)
MOVED := $(if $(LISTED),$(filter-out $(SOURCES),$(LISTED)) $(filter-out $(LISTED),$(SOURCES)))

# One core, so that times compare from machine to machine.
ONE_CORE := NPROC=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
	XLA_FLAGS="$$XLA_FLAGS --xla_cpu_multi_thread_eigen=false"

# Two processes; the tests of one file share what is kept between calls. In their own order: by number, long ones would
# come last.
PARALLEL := -n 2 --dist loadfile --no-loadscope-reorder

MAKEFLAGS += --no-print-directory
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: setup kernels demo test test-all test-oldest lint bench figures docs docs-quick lock clean force help

help: ## List the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1	\2/p' Makefile | expand -t 18

setup: $(COMPILED) ## Build .venv from the lock file, with all that the other targets need
	@echo "$(VENV) is ready"

# First pip and setuptools of the lock, in the place of those that Python brings; they install the rest.
$(LOCKED): requirements.lock
	@command -v "$(PYTHON)" >/dev/null || { echo "No $(PYTHON) here: install Python 3.11 or newer, or name one with make PYTHON=..." >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "$(PYTHON) is older than Python 3.11: name a newer one with make PYTHON=..." >&2; exit 1; }
	@"$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null || { echo "$(PYTHON) cannot make virtual environments: install its venv module (Debian: python3-venv)" >&2; exit 1; }
	@echo "Setting up $(VENV) (one time, some minutes)"
	@"$(PYTHON)" -m venv --clear $(VENV)
	@sed -nE '/^(pip|setuptools)==/,/# via/p' requirements.lock >$(VENV)/installers.lock
	@$(PIP) install -qq --require-hashes --requirement $(VENV)/installers.lock
	@$(PIP) install -qq --require-hashes --requirement requirements.lock
	@touch $@

$(READY): $(LOCKED) pyproject.toml
	@echo "Installing kerrcaustics into $(VENV), and compiling its kernels"
	@$(PIP) install -qq --no-deps --no-build-isolation --editable .
	@found=$$($(PIP) check) || { echo "$$found" >&2; echo "requirements.lock and pyproject.toml disagree: run make lock" >&2; exit 1; }
	@touch $@

kernels: $(COMPILED) ## Compile the kernels, where their sources are newer
	@echo "The kernels fit their sources"

# Nothing is compiled twice where the installation has just done it.
$(COMPILED): $(READY) $(SOURCES) $(if $(strip $(MOVED)),force)
	@test -z "$(strip $(MOVED))$$(find $(SOURCES) -newer $(OBJECTS)/kernels.json 2>&1)" || \
		{ echo "Compiling the kernels"; $(BIN)/python -m kerrcaustics.beams.kernels.build; }
	@echo $(SOURCES) >$@

force:

demo: $(COMPILED) ## Draw the caustics seen from r = 6.03 and r = 2.6, and write a page with a star to drag, into demo/
	@echo "Drawing the demo into demo/"
	@$(BIN)/kerrcaustics demo

# Tests as pytest has rewritten them are kept, whatever the environment says: they are collected in half the time then.
test test-all: export PYTHONDONTWRITEBYTECODE :=

test: $(COMPILED) ## Run the fast tests
	@echo "Running the fast tests"
	@$(BIN)/python -m pytest $(PARALLEL)

test-all: $(COMPILED) ## Run all tests, the slow ones too
	@echo "Running all tests, the slow ones too"
	@$(BIN)/python -m pytest $(PARALLEL) -m ""

# Python 3.11 has wheels of all of them; no hashes, as the file constrains other installs too (packaging/check.sh).
test-oldest: ## Run the fast tests with the oldest dependencies that pyproject.toml allows
	@echo "Setting up .venv-oldest"
	@"$(OLDEST_PYTHON)" -m venv --clear .venv-oldest
	@.venv-oldest/bin/python -m pip --disable-pip-version-check --no-input install -qq --requirement requirements-oldest.lock
	@.venv-oldest/bin/python -m pip --disable-pip-version-check --no-input install -qq --no-deps --no-build-isolation --editable .
	@echo "Running the fast tests with the oldest dependencies"
	@.venv-oldest/bin/python -m pytest $(PARALLEL)

lint: $(READY) ## Check style, formatting and types
	@echo "Checking style"
	@$(BIN)/ruff check --quiet .
	@echo "Checking formatting"
	@$(BIN)/ruff format --quiet --check .
	@echo "Checking types"
	@$(BIN)/basedpyright

bench: $(COMPILED) ## Time the benchmarks on one core
	@echo "Timing tests/bench on one core"
	@$(ONE_CORE) $(BIN)/python -m pytest tests/bench --benchmark-only

figures: $(COMPILED) ## Make every figure into figures/out
	@echo "Making the figures into figures/out"
	@$(BIN)/kerrcaustics figures

docs: $(COMPILED) ## Build the documentation into docs/_build/html
	@echo "Building docs/_build/html (the first time with all figures, some ten minutes)"
	@$(BIN)/sphinx-build -q -W -b html docs docs/_build/html

docs-quick: $(COMPILED) ## The same without running figures and lessons, into docs/_build/quick
	@echo "Building docs/_build/quick, without figures"
	@KERRCAUSTICS_DOCS=quick $(BIN)/sphinx-build -q -W -b html docs docs/_build/quick

COMPILE = $(UV) pip compile pyproject.toml --quiet --no-config \
	--universal --python-version 3.11 --fork-strategy fewest \
	--extra space --extra films --extra catalogues --extra exr --extra astro --extra explore --extra notebook --extra sweep --extra inference \
	--extra test --group build --custom-compile-command "make lock"

# Versions in the file are kept where they still fit; remove it first for newer ones.
lock: ## Bring the two lock files in line with pyproject.toml (needs uv)
	@command -v "$(UV)" >/dev/null || { echo "No $(UV) here: install uv, or name it with make lock UV=..." >&2; exit 1; }
	@echo "Resolving requirements.lock"
	@$(COMPILE) --generate-hashes --extra docs --extra lint --output-file requirements.lock
	@echo "Resolving requirements-oldest.lock"
	@$(COMPILE) --resolution lowest-direct --output-file requirements-oldest.lock

clean: ## Remove .venv, kernels, builds and caches
	@echo "Removing .venv, kernels, builds and caches"
	@rm -rf $(VENV) .venv-oldest $(OBJECTS) build dist docs/_build docs/gallery docs/howto docs/notebooks docs/tutorial .benchmarks .hypothesis .pytest_cache .ruff_cache
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
