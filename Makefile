# Each target sets itself up: requirements/install.sh makes .venv once and costs milliseconds after that.
SHELL := /bin/sh
BIN := .venv/bin

.DEFAULT_GOAL := run
KILLS := tests/torture/test_torture.py::test_nothing_is_lost_and_nothing_wrong_in_silence
CATALOGUE := $(filter-out scale,$(notdir $(wildcard configs/*)))
.PHONY: run catalogue test test-slow cluster lint bench mutation docs torture fuzz sbom scale lowest clean help set-up-run set-up-dev set-up-browser \
	set-up-docs set-up-lowest

run: set-up-run  ## run the default experiments and write results/index.html (this is what plain `make` does)
	@$(BIN)/vibsim run

test: set-up-dev  ## run the tests, without those marked slow
	$(BIN)/pytest -n 2 --dist worksteal --durations 10 -m "not slow"

test-slow: set-up-dev set-up-browser  ## run the tests marked slow, but for `cluster` and the kills of `torture`
	$(BIN)/pytest -n 2 --dist worksteal --durations 10 -m slow --ignore tests/cluster --deselect $(KILLS)

cluster: set-up-dev  ## run a large sweep on a SLURM of this machine, and kill what runs there, 3 minutes
	$(BIN)/pytest -m slow tests/cluster

lint: set-up-dev  ## check style, types, layers, workflow and generated files
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy --config-file tests/mypy.ini
	$(BIN)/lint-imports
	$(BIN)/python workflow/schemas.py --check
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/python workflow/lint.py

bench: set-up-dev  ## measure everything against C and other solvers, 20 minutes (PARTS="jobs storage" for some of it)
	$(BIN)/python bench/run.py $(PARTS)

mutation: set-up-run  ## seed faults, see which checks catch them, and write docs/mutation.md, 10 minutes
	$(BIN)/python tests/mutation/seeding.py

docs: set-up-run set-up-docs  ## build the documentation site, results/docs/index.html
	@.venv-docs/bin/sphinx-build -q -W --keep-going -c docs/site -d build/docs . results/docs # no pickle in results
	@[ ! -f results/index.html ] || $(BIN)/vibsim report
	@echo "documentation: results/docs/index.html"

torture: set-up-dev  ## kill, damage, starve and edit small experiments: one case of each kind, then at random for MINUTES=5; OPTIONS="--seed 1 --case 7" repeats a case
	$(if $(OPTIONS),,$(BIN)/pytest -n 2 --dist worksteal -m slow tests/torture)
	PYTHONPATH=tests $(BIN)/python -m torture --minutes $(or $(MINUTES),5) $(OPTIONS)

fuzz: set-up-run  ## give the readers of users' files what a coverage-guided fuzzer finds, for MINUTES=5
	@sh requirements/install.sh fuzz
	PYTHONPATH=tests $(BIN)/python -m torture.fuzz --minutes $(or $(MINUTES),5) $(OPTIONS)

sbom: set-up-run  ## write build/vibsim.cdx.json, the bill of materials of a release (CycloneDX)
	$(BIN)/python requirements/sbom.py build/vibsim.cdx.json

catalogue: set-up-run  ## run every experiment but those of scale: the source texts, section by section
	$(BIN)/vibsim run $(CATALOGUE)

scale: set-up-run  ## run what is too large for the default: 10^6 members, 10^9 steps
	$(BIN)/vibsim run scale

lowest: set-up-lowest  ## run the default experiments with the oldest packages that pyproject.toml allows
	@.venv-lowest/bin/vibsim run

clean:  ## remove what runs and tools made; .venv stays
	find results -mindepth 1 -maxdepth 1 ! -name README.md -exec rm -rf {} +
	rm -rf .snakemake .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build vibsim.egg-info
	find vibsim tests bench -name __pycache__ -type d -prune -exec rm -rf {} +

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST)

set-up-run:
	@sh requirements/install.sh run

set-up-dev:
	@sh requirements/install.sh dev

set-up-docs:
	@sh requirements/install.sh docs

set-up-lowest:
	@sh requirements/install.sh lowest

set-up-browser:
	@sh requirements/browser.sh
