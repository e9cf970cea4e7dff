# Two commands do everything on a fresh clone with only Python 3.11+ and make:
#   make demo    install into .venv, run the paper's experiment, end with the path of a report
#   make test    build the wheel, install it into a clean environment, test that
# Others: make check (lint, types, tests), make bench, make fuzz, make docs, make clean.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
MAKEFLAGS += --no-print-directory

# The first Python that is new enough; PYTHON=... chooses another.
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$p; break; }; done)

# Nothing of the caller's environment may leak into ours.
unexport PYTHONDONTWRITEBYTECODE PYTHONPATH PYTHONHOME PIP_TARGET PIP_PREFIX PIP_USER VIRTUAL_ENV
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_NO_INPUT := 1

# Processes of tests: one a core. One more was not faster.
JOBS ?= $(shell $(PYTHON) -c 'import os; print(min(8, max(2, os.cpu_count() or 1)))')
PYTEST_ARGS ?=
DEMO_OUT ?= demo-out

RUN := .venv
TEST := .venv-test
TREE := build/types
PACKAGES := cli core reports fixtures
SOURCES := $(shell find $(PACKAGES) -type f -not -name '*.pyc' 2>/dev/null)
SETUP := setup.cfg pyproject.toml
# As pip does for a wheel: where PYTHONDONTWRITEBYTECODE is set, every command would compile all its modules again (0.3 s).
COMPILED = $(RUN)/bin/python -m compileall -q $(PACKAGES)

.PHONY: demo test check lint types bench fuzz sharpness spoilt plan-bench docs clean bounds lock sbom vulnerabilities wheel-twice soak

demo: $(RUN)/.installed
	$(RUN)/bin/collaudit demo -o $(DEMO_OUT)

test: $(TEST)/.wheel
	rm -f build/test-results.xml
	cd tests && COLLAUDIT_TEST_WHEEL=$$(ls $(CURDIR)/build/wheel/collaudit-*.whl) \
		../$(TEST)/bin/pytest -n $(JOBS) --dist worksteal --junit-xml=../build/test-results.xml $(PYTEST_ARGS) .

check: lint types test

lint: $(RUN)/.dev
	$(RUN)/bin/ruff check .
	$(RUN)/bin/ruff format --check .

# mypy cannot follow setup.cfg's package mapping, so it sees the packages through a folder of links.
types: $(RUN)/.dev
	mkdir -p $(TREE)/collaudit
	for p in $(PACKAGES); do ln -sfn ../../../$$p $(TREE)/collaudit/$$p; done
	cd $(TREE) && MYPYPATH=. ../../$(RUN)/bin/mypy --config-file ../../setup.cfg \
		$(foreach p,$(PACKAGES),-p collaudit.$(p))

bench: $(RUN)/.dev
	cd tests && ../$(RUN)/bin/pytest -m bench -s -q .

# Damaged logs, ever new ones, so many of every kind. FUZZ_ARGS="--kinds csv,db3 --state build/fuzz.jsonl" chooses kinds,
# and goes on where an earlier run with that file was ended.
FUZZ_CASES ?= 10000
FUZZ_ARGS ?=
fuzz: $(RUN)/.dev
	$(RUN)/bin/python tests/bench/fuzz_logs.py $(FUZZ_CASES) $(FUZZ_ARGS)

# How sharp residual and thresholds are on real logs (DATA) and simulated arms, and what becomes of spoilt logs: the tables
# of docs/evidence.md. Both go on where they were ended; another SEED is another campaign.
DATA ?= ../shared/data
SHARPNESS_ARGS ?=
SEED ?= 9100
sharpness: $(RUN)/.dev
	$(RUN)/bin/python tests/bench/sharpness.py --data $(DATA) $(SHARPNESS_ARGS) -o docs/evidence.md

spoilt: $(RUN)/.dev
	$(RUN)/bin/python tests/bench/spoilt_logs.py --seed $(SEED) -o docs/evidence.md
	$(RUN)/bin/python tests/bench/spoilt_nights.py --seed $(SEED) -o docs/evidence.md
	$(RUN)/bin/python tests/bench/spoilt_touches.py --data $(DATA) -o docs/evidence.md

# What planned motions deliver on simulated arms, and whether thousands of plans keep all limits (docs/plan.md).
PLAN_ARGS ?= --seeds 3 --default
PLANS ?= 100
plan-bench: $(RUN)/.dev
	$(RUN)/bin/python tests/bench/plan_table.py --data $(DATA) $(PLAN_ARGS) -o build/plan-table.md
	$(RUN)/bin/python tests/bench/plan_limits.py --data $(DATA) --plans $(PLANS)

# Supply chain. bounds: selftest with the oldest and the newest dependencies allowed; lock: exact versions for CI and the
# bill of materials; sbom: CycloneDX; vulnerabilities: pip-audit, which fails where it could not ask about a package.
bounds: $(RUN)/.dev
	$(RUN)/bin/python -m pip install --quiet uv
	PATH=$(CURDIR)/$(RUN)/bin:$$PATH $(RUN)/bin/python tests/bench/install_matrix.py

LOCK_FLAGS := --universal --python-version 3.11 --no-header --no-annotate --no-emit-index-url --no-emit-find-links
lock: $(RUN)/.dev
	$(RUN)/bin/python -m pip install --quiet uv
	$(RUN)/bin/uv pip compile --quiet $(LOCK_FLAGS) --generate-hashes setup.cfg --extra test -o requirements/ci.txt
	$(RUN)/bin/uv pip compile --quiet $(LOCK_FLAGS) setup.cfg --extra hdf5 -o requirements/run.txt

sbom: $(RUN)/.dev
	$(RUN)/bin/python -m pip install --quiet 'cyclonedx-bom >= 7'
	mkdir -p build
	$(RUN)/bin/cyclonedx-py requirements requirements/run.txt --output-reproducible --of JSON -o build/sbom.cdx.json

vulnerabilities: $(RUN)/.dev
	$(RUN)/bin/python -m pip install --quiet pip-audit
	$(RUN)/bin/pip-audit --strict --disable-pip --require-hashes -r requirements/ci.txt

# Built twice from what is committed; SOURCE_DATE_EPOCH is the time of the commit.
wheel-twice: $(RUN)/.made
	rm -rf build/twice && mkdir -p build/twice
	for k in 1 2; do git archive --prefix=$$k/ HEAD | tar -x -C build/twice; \
		SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) $(RUN)/bin/python -m pip wheel --quiet --no-deps \
			--wheel-dir build/twice/wheel$$k build/twice/$$k; done
	cmp build/twice/wheel1/*.whl build/twice/wheel2/*.whl && sha256sum build/twice/wheel1/*.whl

# A night of 500 logs whose workers are killed, whose disk is full, and that is ended and resumed.
soak: $(RUN)/.dev
	$(RUN)/bin/python tests/bench/night_soak.py

# The generated pages: configuration, its JSON Schema, findings, commands, JSON Schemas of results.
docs: $(RUN)/.dev
	PYTHONPATH=tests/helpers $(RUN)/bin/python -m user_guide.pages docs

clean:
	rm -rf $(RUN) $(TEST) build dist $(DEMO_OUT) *.egg-info

$(RUN)/.made $(TEST)/.made:
	@test -n "$(PYTHON)" || { echo "collaudit needs Python 3.11 or newer: make PYTHON=/path/to/python3.11" >&2; exit 2; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "$(PYTHON) is older than Python 3.11: make PYTHON=/path/to/python3.11" >&2; exit 2; }
	$(PYTHON) -m venv --clear $(@D)
	touch $@

$(RUN)/.installed: $(RUN)/.made $(SETUP)
	$(RUN)/bin/python -m pip install --quiet --editable .
	$(COMPILED)
	touch $@

$(RUN)/.dev: $(RUN)/.installed
	$(RUN)/bin/python -m pip install --quiet --editable '.[dev]'
	$(COMPILED)
	touch $@

# LOCK=requirements/ci.txt installs the locked versions; without it the newest that setup.cfg allows are tested.
# Dependencies first, in their own step: a change of code then only swaps the wheel.
$(TEST)/.wheel: $(TEST)/.made $(SETUP) $(SOURCES) README.md LICENSE
	rm -rf build/lib build/bdist.* build/wheel
	$(TEST)/bin/python -m pip wheel --quiet --no-deps --wheel-dir build/wheel .
	@if [ -n "$(LOCK)" ]; then $(TEST)/bin/python -m pip install --quiet --require-hashes -r $(LOCK); fi
	wheel=$$(ls build/wheel/collaudit-*.whl); \
		$(TEST)/bin/python -m pip install --quiet --no-compile "$$wheel[test]"; \
		$(TEST)/bin/python -m pip install --quiet --no-deps --force-reinstall "$$wheel"
	touch $@
