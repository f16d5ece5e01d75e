# Everything runs in .venv, made from requirements.lock; `make test` and `make lint` add requirements-dev.lock. No compiler
# is needed.
SHELL := /bin/bash
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
SITE := .venv-site
DRAKE := .venv-drake
VERSION = $(shell sed -n 's/^VERSION = "\(.*\)"/\1/p' biped/base/__init__.py)
TOOLS := $(VENV)/.tools
# Short tests of compiled kernels: `make coverage` runs them as plain Python too.
KERNEL_TESTS := tests/control tests/engines/rigid tests/numerics tests/engines/planar/test_mujoco.py tests/dynamics/test_linalg.py \
	tests/robot/planar/test_posture.py tests/base/test_kernels.py::test_compiled_kernels_do_what_they_do_as_plain_python
# One BLAS thread: 9x9 problems gain nothing from more and can lose milliseconds.
export OPENBLAS_NUM_THREADS := 1
# Tests on all cores; one that is done takes over from another. `make test ABREAST=` runs them one after another.
ABREAST := -n auto --dist worksteal
export PIP_DISABLE_PIP_VERSION_CHECK := 1
LOCK = $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
	--custom-compile-command 'make lock'

.PHONY: boundscheck drake wheel docs gallery fuzz help setup tools run view test test-all stress coverage check regress bench lint format lock site versions clean

help: ## this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(STAMP) ## make .venv and install what running needs

tools: $(TOOLS) ## add what tests and checks need

$(STAMP): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "biped needs Python 3.11 or newer (set PYTHON=...)" >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@$(BIN)/biped demo --compile
	@touch $@

$(TOOLS): $(STAMP) requirements-dev.lock
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements-dev.lock
	@touch $@

run: setup ## push a walker in two simulators: numbers, a page and a recording
	@$(BIN)/biped demo --push

view: setup ## the newest recording in the rerun viewer
	$(BIN)/biped view

test: tools ## the default tests (minutes), side by side on all cores
	$(BIN)/python -m pytest $(ABREAST) --durations=10

test-all: tools ## every test, the slow ones too
	$(BIN)/python -m pytest $(ABREAST) -m "slow or not slow"

stress: tools ## extremes: steps, contacts, masses, starts, pushes, sensors; random physical models
	$(BIN)/python -m pytest $(ABREAST) tests/test_stress.py tests/test_properties.py -m "slow or not slow"

fuzz: tools ## ten thousand hostile scenarios, gaits, models, command lines, results folders and journals
	$(BIN)/python -m tests.fuzz

drake: tools ## the tests of the engine drake, which is downloaded once (230 MB)
	@test -d $(DRAKE) || $(BIN)/python -m pip install --quiet --no-deps --target $(DRAKE) "drake>=1.51"
	PYTHONPATH=$(DRAKE) $(BIN)/python -m pytest $(ABREAST) tests/engines/test_drake*.py tests/studies/bench/test_engines.py

boundscheck: tools ## a second of every shipped scenario with kernels that check every index
	$(BIN)/python -m tests.boundscheck

coverage: tools ## the default tests, those of kernels once more as plain Python; fails below 90 % of lines
	$(BIN)/coverage erase
	$(BIN)/coverage run -m pytest
	# Compiled code overflows to inf without a word; as plain Python it would warn.
	NUMBA_DISABLE_JIT=1 $(BIN)/coverage run -m pytest $(KERNEL_TESTS) -W ignore::RuntimeWarning
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report --skip-covered

check: setup ## the fixed-seed regression scenarios, as in CI
	$(BIN)/biped check scenarios/ci/*.toml --junit checks.xml

regress: setup ## every shipped scenario against its recorded numbers; what a tick costs against what it did
	$(BIN)/biped regress
	$(BIN)/biped bench regress

bench: setup ## run time against error
	$(BIN)/biped bench throughput
	$(BIN)/biped bench walking
	$(BIN)/biped bench mechanisms

lint: tools ## ruff, the type checker and which room may import which
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright
	$(BIN)/lint-imports --no-logo

format: tools ## reformat the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

lock: setup ## refresh both lock files from pyproject.toml
	$(BIN)/python -m pip install --quiet uv
	$(LOCK) --extra tune --group install pyproject.toml -o requirements.lock
	$(LOCK) --group dev -c requirements.lock -o requirements-dev.lock
	$(LOCK) --group site -o requirements-site.lock

gallery: setup ## draw the clips of docs/gallery.md again, which takes some minutes
	$(BIN)/python -m biped.cli.gallery --clips

docs: setup ## write the pages that are made from the code
	$(BIN)/python -m biped.cli.reference
	$(BIN)/python -m biped.scenario.reference
	$(BIN)/python -m biped.show.references
	$(BIN)/python -m biped.cli.gallery
	$(BIN)/python -m biped.show.standing
	$(BIN)/python -m biped.show.readings
	$(BIN)/python -m biped.show.programme
	$(BIN)/python -m biped.show.certify
	$(BIN)/python -m biped.show.walks
	$(BIN)/python -m biped.show.atlas

wheel: setup ## a wheel for x86-64 with compiled kernels in it, which elsewhere compiles them, in dist/
	rm -rf biped/compiled biped/__pycache__/kernels-*
	BIPED_PORTABLE_KERNELS=1 $(BIN)/biped demo --compile
	$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

site: $(SITE)/.installed ## the documentation as a site in build/site, to open from there or to publish
	$(SITE)/bin/mkdocs build --strict --quiet
	@echo build/site/index.html

versions: $(SITE)/.installed ## add the site of this version to those in the branch gh-pages, with a list to choose from
	PATH="$(CURDIR)/$(SITE)/bin:$$PATH" $(SITE)/bin/mike deploy --update-aliases --alias-type=copy $(VERSION) latest
	$(SITE)/bin/mike set-default latest

$(SITE)/.installed: requirements-site.lock
	$(PYTHON) -m venv $(SITE)
	$(SITE)/bin/python -m pip install --quiet --require-hashes -r requirements-site.lock
	@touch $@

clean: ## remove the environment and caches (never runs/)
	rm -rf $(VENV) $(SITE) $(DRAKE) build/site .pytest_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
