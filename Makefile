# What a change must pass, each command once. `make ci` runs all of it; .ci/run does so in a fresh clone.

BIN := .venv/bin

.PHONY: setup lint types docs audit test thorough ci

setup: # an environment with everything that the checks need
	python3 -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -e '.[dev]'

lint:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types:
	$(BIN)/mypy

docs: # in the folder site
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

audit: # known weaknesses of what is installed
	.ci/audit

test: # as the README says
	python3 -m venv .venv && .venv/bin/pip install -q -e '.[test]' && .venv/bin/pytest

thorough: # every page of the docs as written, and the tests that take longest
	$(BIN)/pytest -m as_written --dist load
	$(BIN)/pytest -m thorough

ci: setup lint types docs audit thorough test
