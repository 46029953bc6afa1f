# The newest supported Python that can make a virtual environment; `make PYTHON=...` overrides it.
PYTHON ?= $(shell for python in python3.13 python3.12 python3.11 python3; do \
	$$python -c 'import ensurepip, sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' 2>/dev/null \
	&& echo $$python && break; done)
BIN := .venv/bin
# warnings are errors (mkdocs.yml); the variable silences an advertisement for the theme's successor
MKDOCS := NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

.PHONY: demo test check docs clean

demo: .venv/.runtime
	$(BIN)/rebody demo

# a worker that crashes ends the run: replaced, it can leave the others waiting for ever
test: check
	$(BIN)/pytest -n 2 --dist loadfile --max-worker-restart 0
	scripts/smoke_wheel.sh

check: .venv/.installed
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright
	$(BIN)/lint-imports
	$(MKDOCS) --site-dir build/site

docs: .venv/.installed
	$(MKDOCS)

clean:
	rm -rf .venv build dist site src/*.egg-info .pytest_cache .ruff_cache .hypothesis .import_linter_cache

.venv/.runtime: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/pip install --quiet --editable . --constraint constraints.txt
	@touch $@

# what `demo` needs is part of it
.venv/.installed: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/pip install --quiet --editable '.[dev]' --constraint constraints.txt
	@touch .venv/.runtime $@

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "rebody needs Python 3.11, 3.12 or 3.13 with its venv module: install" \
		"one (on Debian or Ubuntu also python3-venv), or say where it is: make PYTHON=/path/to/python" >&2; exit 1; }
	$(PYTHON) -m venv .venv
