# `make demo`, `make test`, `make test-all` and `make attack` each do the set-up they need, in .venv, with Python 3.11
# or newer.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV   := .venv
BIN    := $(VENV)/bin

# The kinds of tests (pyproject.toml) that take long: `make test-all` runs them, `make test` all others.
LONG   := attack or kill or browser or benchmark or slow
PYTEST := OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 MALLOC_ARENA_MAX=2 $(BIN)/python -m pytest -n 2 --dist loadscope

.PHONY: demo test test-all attack docs docs-build setup clean

demo: $(VENV)/.demo
	$(BIN)/bisplat demo

test: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(PYTEST) --durations=10 -m "not ($(LONG))"

test-all: setup
	$(PYTEST) -m "$(LONG)"

attack: setup
	mkdir -p runs
	$(BIN)/python -m benchmarks.product.attack --json > runs/attack.json

docs: setup  # builds the documentation, opens it in the browser, and builds it again when a page changes
	$(BIN)/sphinx-autobuild --open-browser --watch bisplat --watch learn --watch simulate --watch scenes docs build/docs

docs-build: setup
	$(BIN)/sphinx-build -W --keep-going docs build/docs

setup: $(VENV)/.ready

# The demo needs neither documentation nor test tools. What needs those installs them in addition.
$(VENV)/.demo: pyproject.toml constraints.txt simulate/rays/core/llvm.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "bisplat needs Python 3.11 or newer; name one with: make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
	  { echo "Python's venv module is missing; as root: apt-get install python3-venv"; exit 1; }
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[rays,viewer]'
	$(BIN)/python -m simulate.rays.core.llvm --install
	@touch $@

$(VENV)/.ready: $(VENV)/.demo
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[test,docs]'
	$(BIN)/python -m pip install --quiet --no-deps deepmimo==4.0.5  # a test reads our export with it; its old NumPy is not needed
	@touch $@

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .ruff_cache .pytest_cache
