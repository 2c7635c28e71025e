# Targets for people and CI; every one makes its own environment in .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CONFIG ?= configs/thesis.yaml
LAW ?= fdns
SEED ?= 50000
CASES ?= 48
# the program itself divides its work over the cores; threads of the linear algebra in addition only compete with it
ONE_THREAD := OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
RUN_STAMP := $(VENV)/.installed
TEST_STAMP := $(VENV)/.installed-test
DOCS_STAMP := $(VENV)/.installed-docs
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet install -c constraints.txt
# a small part of what is installed is imported: modules are compiled to bytecode when they are first imported
KEEP_BYTECODE := PYTHONDONTWRITEBYTECODE=

.DEFAULT_GOAL := help
.PHONY: help run test suite lint docs bench bench-tracing reproduce train-inverse identify-frame simulate close-loop clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 20

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

$(RUN_STAMP): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) --no-compile -e .
	@touch $@

$(TEST_STAMP): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) --no-compile -e '.[test]'
	@touch $@ $(RUN_STAMP) $(DOCS_STAMP)

$(DOCS_STAMP): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) -e '.[docs]'
	@touch $@ $(RUN_STAMP)

run: $(RUN_STAMP)  ## the whole main job on the virtual laboratory; prints where the report is
	$(ONE_THREAD) $(KEEP_BYTECODE) $(BIN)/mrpipe run $(CONFIG)

lint: $(TEST_STAMP)  ## style, types and import rules
	$(BIN)/ruff check mrpipe tests benchmarks
	$(BIN)/ruff format --check mrpipe tests benchmarks
	$(BIN)/mypy
	$(BIN)/lint-imports

suite: $(TEST_STAMP)
	$(KEEP_BYTECODE) $(BIN)/python -m tests.compiled
	$(ONE_THREAD) $(KEEP_BYTECODE) $(BIN)/python -m pytest -n auto --dist worksteal

# the type checker works in one process, so it runs while the tests do
test: $(TEST_STAMP)  ## linters and the whole test suite
	$(MAKE) --no-print-directory --jobs=2 lint suite

docs: $(DOCS_STAMP)  ## the documentation site, in build/site
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

bench: $(RUN_STAMP)  ## timings: optimiser, closed loop
	$(BIN)/python -m benchmarks.levenberg_marquardt
	$(BIN)/python -m benchmarks.closed_loop

bench-tracing: $(RUN_STAMP)  ## how often planted effects are found on rigs independent of the program
	$(BIN)/python -m benchmarks.tracing --first-seed $(SEED) --cases $(CASES)

reproduce: $(RUN_STAMP)  ## results and statements of the thesis, recomputed from the run
	$(BIN)/mrpipe reproduce --config $(CONFIG)

train-inverse: $(RUN_STAMP)  ## the inverse network
	$(BIN)/mrpipe train-inverse --config $(CONFIG)

identify-frame: $(RUN_STAMP)  ## the frame's M, C, K and modes
	$(BIN)/mrpipe identify-frame --config $(CONFIG)

simulate: $(RUN_STAMP)  ## the closed loop under LAW (default fdns)
	$(BIN)/mrpipe simulate --law $(LAW) --config $(CONFIG)

close-loop: $(RUN_STAMP)  ## trace the residual to a missing effect
	$(BIN)/mrpipe close-loop --config $(CONFIG)

clean:  ## remove the environment, the runs and all caches
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist
	find runs -mindepth 1 ! -name README.md -delete
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
