# compsim: the verbs of the house. Everything happens in .venv, made here when it is missing.
PYTHON ?= python3
BIN := .venv/bin
CAMPAIGN := PYTHONPATH=tests $(BIN)/python tests/campaigns
STAMP := .venv/installed
PURE := $(addprefix tests/physics/test_,kinematics.py loads.py contact.py motion.py tally.py steppers.py) \
  tests/analysis/test_cam.py
.DEFAULT_GOAL := help
.PHONY: help install run figures test test-bare test-oldest test-pure check format calibration accuracy validation page sweep-bench peers tradeoff identify nameplate stress chaos mutants measurements pages docs release lock clean

help:  ## show this help
	@awk 'BEGIN {FS = ":.*## "} /^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

install: $(STAMP)  ## create .venv with compsim and what its tests need

$(STAMP): pyproject.toml
	@command -v $(PYTHON) >/dev/null || { echo "$(PYTHON) not found: install Python 3.11 or newer"; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "compsim needs Python 3.11 or newer: make PYTHON=python3.12 install"; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $(STAMP)

run: install  ## simulate the paper's eleven cases and draw the report
	$(BIN)/compsim run configs/*.yaml
	$(BIN)/compsim report

figures: install  ## draw the report again from the stored results
	$(BIN)/compsim report

test: install  ## run the whole test suite
	$(BIN)/python -m pytest -n 2

test-bare:  ## run it on a fresh clone with nothing but Python, make, git, sh and coreutils
	@place=$$(mktemp -d) && trap 'rm -rf "$$place"' EXIT && git clone --quiet . "$$place/compsim" \
	  && $(PYTHON) tests/bare.py $(MAKE) -C "$$place/compsim" test

test-oldest:  ## run a sample of it with the oldest libraries that pyproject.toml allows
	$(PYTHON) tests/oldest.py --tests

test-pure: install  ## run the physics tests on the same source with the JIT off
	COMPSIM_JIT=0 $(BIN)/python -m pytest -n 2 -m 'not slow and not compiled' $(PURE)

check: install  ## ruff (format and lint) and mypy
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: install  ## let ruff format and mend what it can
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

calibration: install  ## measure what estimates of errors are worth, on cases that judge nothing (8 minutes)
	$(CAMPAIGN)/calibrate_errors.py tests/results/calibration.json

accuracy: install  ## judge promises and error bars on 1,000 other random cases (7 minutes)
	$(CAMPAIGN)/measure_accuracy.py tests/results/accuracy.json

page: install  ## test the report's page in a browser, measure how it is written and opens (ten minutes)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check selenium
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps axe-playwright-python
	$(BIN)/python -m pytest tests/report/test_browser.py
	$(CAMPAIGN)/measure_page.py tests/results/page.json

sweep-bench: install  ## measure start-up and 100,000 short jobs, killed three times and resumed (ten minutes or more)
	$(CAMPAIGN)/measure_sweep.py tests/results/sweep.json

validation: install  ## compare with what others have published (a minute)
	$(CAMPAIGN)/measure_validation.py tests/results/validation.json

peers: install  ## time other tools and ours in turn on one problem (about six minutes)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,peers]'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check numbalsoda \
	  || echo "going on without numbalsoda: it needs a Fortran compiler"
	$(CAMPAIGN)/measure_peers.py tests/results/peers.json
	$(CAMPAIGN)/measure_validation.py tests/results/validation.json

tradeoff: install  ## measure speed against accuracy, and what the model's features do (ten minutes)
	$(CAMPAIGN)/measure_tradeoff.py tests/results/tradeoff.json

identify: install  ## measure what is identified of other machines, and under another friction law (15 minutes)
	$(CAMPAIGN)/measure_identify.py tests/results/identify.json

stress: install  ## run and judge 3,000 extreme cases (two hours on two cores)
	$(CAMPAIGN)/measure_stress.py tests/results/stress.json

chaos: install  ## inject faults, thousands, and count what did not survive (two to three hours)
	$(CAMPAIGN)/measure_chaos.py tests/results/chaos.json

nameplate: install  ## run the case file of compsim init machine, for its page (two minutes)
	$(CAMPAIGN)/measure_nameplate.py tests/results/nameplate.json

mutants: install  ## plant bugs and see whether the fast tests catch them (half an hour)
	$(CAMPAIGN)/measure_mutants.py tests/results/mutants.json

measurements: test-oldest calibration accuracy validation page tradeoff identify nameplate sweep-bench peers pages  ## all of these (about three hours)

pages: install  ## write the pages' generated tables, compressor/API.md
	$(BIN)/python tests/page_tables.py
	$(CAMPAIGN)/result_pages.py
	$(BIN)/python tests/api_page.py

docs: install  ## build the pages as a site with search: site/index.html
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'compsim[docs]'
	$(BIN)/python -m sphinx -W --keep-going --quiet -c compressor/docs -d site/.doctrees . site
	@echo site/index.html

release: install  ## build wheel and sdist in dist/, check them, and run the paper's cases by the wheel alone
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'compsim[release]'
	rm -rf dist
	$(BIN)/python -m build --outdir dist .
	$(BIN)/python -m twine check --strict dist/*
	$(BIN)/python tests/release.py dist

lock:  ## write the versions that a fresh environment for tests and site gets: .ci/requirements.lock
	@place=$$(mktemp -d) && trap 'rm -rf "$$place"' EXIT && $(PYTHON) -m venv "$$place" \
	  && "$$place/bin/python" -m pip install --quiet --disable-pip-version-check --editable '.[dev,docs]' \
	  && { echo "# make lock, $$(date +%F), $$($(PYTHON) -VV | cut -d' ' -f1-2); to install them:"; \
	    echo "# pip install -c .ci/requirements.lock -e '.[dev,docs]'"; \
	    "$$place/bin/python" -m pip --disable-pip-version-check freeze --exclude-editable; } > .ci/requirements.lock

clean:  ## remove results, report, claims, stress, identify, site, dist and caches; .venv stays
	rm -rf results report claims stress identify site dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
