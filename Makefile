# make demo    reconstruct a sample panorama; scene, pictures and report.html in demo/
# make test    everything CI runs: tests, doctests, lint, types, documentation
# make lint    the checks of a commit, on all files
# make docs    the documentation, in site/
# make clean   remove what the commands above left behind
#
# Needs python3 (3.11 or newer) with venv, and make; everything else goes into .venv.
# Another interpreter: make demo PYTHON=python3.12. More options for pytest: PYTEST_FLAGS.

PYTHON ?= python3
PYTEST_FLAGS ?=
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install -qq --disable-pip-version-check

.DELETE_ON_ERROR:
.PHONY: demo test lint docs clean

demo: $(VENV)/.runtime-installed
	@$(BIN)/panoscene reconstruct src/panoscene/sample/photo.jpg -o demo
	@echo "Look around in the reconstructed room: open demo/report.html in a browser."

test: $(VENV)/.dev-installed
	@PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist worksteal --durations=10 $(PYTEST_FLAGS)

lint: $(VENV)/.dev-installed
	@$(BIN)/pre-commit run --all-files

docs: $(VENV)/.dev-installed
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "The documentation is in site/index.html"

clean:
	rm -rf demo site dist build .pytest_cache .ruff_cache .hypothesis .import_linter_cache .coverage

$(BIN)/python:
	@command -v "$(PYTHON)" >/dev/null || { \
	    echo "$(PYTHON) was not found. Install it: sudo apt install python3 python3-venv" >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "panoscene needs Python 3.11 or newer, but $(PYTHON) is $$("$(PYTHON)" --version)." >&2; \
	    echo "Install one and name it, for example:" >&2; \
	    echo "    sudo apt install python3.11 python3.11-venv && make $(MAKECMDGOALS) PYTHON=python3.11" >&2; \
	    exit 1; }
	@"$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null || { \
	    echo "$(PYTHON) cannot make virtual environments yet. Install the missing part:" >&2; \
	    echo "    sudo apt install $(notdir $(PYTHON))-venv" >&2; exit 1; }
	@echo "Making $(VENV) ..."
	@"$(PYTHON)" -m venv --clear $(VENV)

# A stamp is as new as the last installation: nothing is installed again until pyproject.toml changes.
$(VENV)/.runtime-installed: pyproject.toml $(BIN)/python
	@echo "Installing panoscene into $(VENV); the first time takes minutes, for PyTorch is large ..."
	@$(INSTALL) -e .
	@touch $@

$(VENV)/.dev-installed: pyproject.toml $(BIN)/python
	@echo "Installing panoscene and its test tools into $(VENV); the first time takes minutes ..."
	@$(INSTALL) --upgrade 'pip>=25.1'
	@# what is imported is compiled then, and kept; compiling all that is there takes a minute
	@$(INSTALL) --no-compile -e '.[synth,ray,train]' --group dev
	@touch $@ $(VENV)/.runtime-installed
