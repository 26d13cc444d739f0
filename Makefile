PYTHON ?= python3
BIN := .venv/bin

.PHONY: demo test bench paper soak
demo: .venv/installed
	$(BIN)/cmmlink demo --out demo-result

test: .venv/test-installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest -n 2 $(PYTEST_OPTIONS)
	@tests/page/check $(PAGE_OPTIONS)

# A hundred recording processes killed at random moments; every acknowledged point must be there.
soak: .venv/test-installed
	$(BIN)/python -m tests.integration.killed soak 100

# Ours against the rivals of the package index, in one run; takes some minutes and wants a quiet machine.
bench: .venv/bench-installed
	$(BIN)/python -m tests.benchmarks.projection_benchmark --rivals --millions

# The published paper's tables and the registration's figures; MH42=FILE gives the coordinates that may not be shipped.
paper: .venv/bench-installed
	$(BIN)/python -m tests.benchmarks.paper_tables $(if $(MH42),--mh42 $(MH42))
	$(BIN)/python -m tests.benchmarks.registration_benchmark $(if $(MH42),--mh42 $(MH42))

# One clear line for the two things newcomers meet: an old Python, and Debian's Python without its venv package.
.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "cmmlink needs Python 3.11 or newer; this is $$($(PYTHON) -V). Try: make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || { echo "This Python cannot make virtual environments. On Debian or Ubuntu: apt install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@$(BIN)/python -m cmmlink.commands.open3d_doctor
	touch $@

.venv/bench-installed: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test,bench]'
	touch $@ .venv/installed .venv/test-installed

.venv/test-installed: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@$(BIN)/python -m cmmlink.commands.open3d_doctor
	touch $@ .venv/installed
