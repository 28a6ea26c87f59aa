# Each target sets itself up: requirements/install.sh makes .venv once and costs milliseconds after that.
SHELL := /bin/sh
BIN := .venv/bin

.DEFAULT_GOAL := run
CATALOGUE := $(filter-out scale,$(notdir $(wildcard configs/*)))
.PHONY: run catalogue test test-slow lint bench mutation scale clean help set-up-run set-up-dev set-up-browser

run: set-up-run  ## run the default experiments and write results/index.html (this is what plain `make` does)
	@$(BIN)/vibsim run

test: set-up-dev  ## run the tests, without those marked slow
	$(BIN)/pytest -n 2 --dist worksteal --durations 10 -m "not slow"

test-slow: set-up-dev set-up-browser  ## run the tests marked slow
	$(BIN)/pytest -n 2 --dist worksteal --durations 10 -m slow

lint: set-up-dev  ## check style, types, layers, workflow and generated files
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python workflow/schemas.py --check
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/python workflow/lint.py

bench: set-up-dev  ## measure everything against C and other solvers, 10 minutes (PARTS="jobs storage" for some of it)
	$(BIN)/python bench/run.py $(PARTS)

mutation: set-up-run  ## seed faults, see which checks catch them, and write docs/mutation.md, 10 minutes
	$(BIN)/python tests/mutation/seeding.py

catalogue: set-up-run  ## run every experiment but those of scale: the source texts, section by section
	$(BIN)/vibsim run $(CATALOGUE)

scale: set-up-run  ## run what is too large for the default: 10^6 members, 10^9 steps
	$(BIN)/vibsim run scale

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

set-up-browser:
	@sh requirements/browser.sh
