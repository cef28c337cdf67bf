# Two commands do everything on a fresh machine: `make run` and `make test`.
# Both create .venv from $(PYTHON) and install the project with all that they need.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
OUT ?= results
PDF_ENGINE ?= xelatex

.PHONY: run test lint format types laws tests coverage docs dist pypi-readme paper browser clean

run: $(STAMP) # prints where the report is; started again, it does what is missing
	@$(BIN)/geoimp reproduce --out $(OUT)

test: lint
	@$(MAKE) --no-print-directory -j 2 types laws
	@$(MAKE) --no-print-directory tests

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell

types: $(STAMP)
	$(BIN)/mypy

laws: $(STAMP) # compiled once, before each process of the tests would compile them for itself
	@$(BIN)/geoimp run plexiglas --duration 0.01 --no-figures --set form=compiled --out build/laws > /dev/null

tests: $(STAMP) browser
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 3 --dist loadfile --no-loadscope-reorder --max-worker-restart 0 --durations 20 # files share costly runs

# Lines and branches that tests run, in all of their processes. Folder by folder: a process that
# dies takes what it has measured along.
coverage: $(STAMP) browser
	$(BIN)/coverage erase
	for tests in tests/*/ tests/*.py; do \
		OPENBLAS_NUM_THREADS=1 $(BIN)/coverage run -m pytest -n 2 --dist loadfile $$tests || true; \
	done
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report

docs: $(STAMP) # what tests/test_documentation.py builds, to be read: build/docs/index.html
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet docs build/docs

dist: $(STAMP) # the archives of a release, checked; a test looks at what they contain
	rm -rf dist build/release
	git checkout-index --all --prefix=build/release/
	$(MAKE) -s pypi-readme > build/release/README.md
	$(BIN)/python -m build --outdir dist build/release
	$(BIN)/twine check --strict dist/*

pypi-readme: # the README for PyPI: what it links to and shows is that of the release on the forge
	@repository=$$(sed -n 's/^Repository = "\(.*\)"/\1/p' pyproject.toml); \
	version=v$$(sed -n 's/^__version__ = "\(.*\)"/\1/p' geoimp_drake/__init__.py); \
	sed -E -e "s|(!\[[^]]*\]\()([^:)]+\))|\1$$repository/raw/$$version/\2|g" \
		-e "s|(\]\()([^:)]+\))|\1$$repository/blob/$$version/\2|g" README.md

paper: # needs pandoc, and what makes PDF for it: xelatex, or weasyprint, which pip installs
	@command -v pandoc > /dev/null || { echo "pandoc is not installed: apt-get install pandoc"; exit 1; }
	mkdir -p build
	cd paper && pandoc paper.md --citeproc --pdf-engine=$(PDF_ENGINE) -o ../build/paper.pdf

browser: # the pages are tested in Chromium; where it cannot be installed, a test says what to do
	@for name in chromium chromium-browser google-chrome; do \
		if command -v $$name > /dev/null; then exit 0; fi; \
	done; \
	if [ "$$(id -u)" = 0 ]; then \
		apt-get update -qq && apt-get install -y -qq chromium; \
	fi || true

format: $(STAMP)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	@touch $@

clean:
	rm -rf $(VENV) $(OUT) build dist *.egg-info .coverage* .pytest_cache .mypy_cache .ruff_cache
