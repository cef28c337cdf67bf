# Two commands do everything on a fresh machine: `make run` and `make test`.
# Both create .venv from $(PYTHON) and install the project with all that they need.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
OUT ?= results

.PHONY: run test lint format types tests clean

run: $(STAMP)
	@for experiment in $$($(BIN)/geoimp list | cut -d ' ' -f 1); do \
		echo "== $$experiment" && \
		$(BIN)/geoimp run $$experiment --html --out $(OUT)/$$experiment || exit 1; \
	done

test: lint types tests

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

tests: $(STAMP)
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder # files share costly runs

format: $(STAMP)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	@touch $@

clean:
	rm -rf $(VENV) $(OUT) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
