# make demo | test | check | test-slow | bench | clean. The first target that needs it makes .venv.

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
INSTALLED := $(VENV)/.installed
LINK := build/path/supple
# Tests run side by side in this many processes, a file in one of them, since tests of a file share
# what is costly; JOBS=0 runs them in one.
JOBS ?= 2

.PHONY: demo test check test-slow bench clean install
.DELETE_ON_ERROR:

demo: $(INSTALLED)
	$(BIN)/supple demo --out demo-report
	@echo "Open demo-report/report.html in a browser."

test: check
	$(BIN)/python -m pytest -q -n $(JOBS) --dist loadfile -m "not slow"

check: $(INSTALLED) $(LINK)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright --warnings

test-slow: $(INSTALLED) $(LINK)
	$(BIN)/python -m pytest -q -m slow

bench: $(INSTALLED)
	@PYTHONWARNINGS=ignore $(PIP) --no-build-isolation -e '.[dev,bench]'
	$(BIN)/python -m supple.studies.benchmark

install: $(INSTALLED) $(LINK)

# Takes the first Python that is new enough and able to make an environment.
$(BIN)/python:
	@for python in $(PYTHON) python3 python3.13 python3.12 python3.11 python3.14; do \
	    "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || continue; \
	    found="$$found $$python"; \
	    "$$python" -c 'import ensurepip, venv' 2>/dev/null || continue; \
	    echo "Making $(VENV) with $$("$$python" -V)"; \
	    exec "$$python" -m venv $(VENV); \
	done; \
	if [ -n "$$found" ]; then \
	    echo "make: Python is here ($$found ) but cannot make a virtual environment, because its" \
	        "module ensurepip is missing. On Debian and Ubuntu: apt-get install python3-venv" >&2; \
	else \
	    echo "make: no Python 3.11 or newer was found. Install one, or name it:" \
	        "make PYTHON=/path/to/python3" >&2; \
	fi; exit 1

$(INSTALLED): pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing the versions of constraints.txt into $(VENV)"
	@$(PIP) setuptools
	@PYTHONWARNINGS=ignore $(PIP) --no-build-isolation -e '.[dev]'
	@touch $@

# Type checkers read the tree, not the installed package: this link shows it to them as `supple`.
$(LINK):
	@mkdir -p $(@D) && ln -sfn ../.. $@

clean:
	rm -rf $(VENV) build dist demo-report bench-report *.egg-info .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
