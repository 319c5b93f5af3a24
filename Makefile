# `make figures` and `make test` do the whole set-up themselves on a machine that has Python, make and git.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
SITE_READY := $(VENV)/.ready-site
# a worker a core, up to four, each on one thread; a file or a notebook stays with one worker
TEST := OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --maxprocesses 4 --dist loadfile
BENCH ?= bench.json
OLD ?= tests/benchmarks/reference.json
NEW ?= $(BENCH)

.DEFAULT_GOAL := help
.PHONY: help setup figures gallery site test lint format lab bench bench-compare lock clean

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(READY) ## system libraries, virtual environment, packages

$(READY): requirements.lock pyproject.toml tools/system_libraries.py
	@$(PYTHON) -c 'import sys; v = sys.version_info[:2]; sys.exit(0 if (3, 10) <= v <= (3, 13) else "Python 3.10 to 3.13 is needed, this is %d.%d; run: make PYTHON=python3.11 ..." % v)'
	@$(PYTHON) tools/system_libraries.py
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --editable .
	@touch $@

figures: $(READY) ## run the figure notebooks into out/ and compare their facts (SCALE=quick or paper, NAMES="...": those)
	$(BIN)/rasp figures $(NAMES) --scale $(or $(SCALE),quick)

gallery: $(READY) ## write paper_figures/README.md, out/gallery.html with scenes to turn, and the numbers in prose, from claims and facts
	$(BIN)/python -c "from rasp_core.reproduce import gallery as g; g.write('paper_figures'); g.write_html('paper_figures', 'out/gallery.html')"
	$(BIN)/python -c "from rasp_core.reproduce.quoted_numbers import pages, refresh; [refresh(page) for page in pages('.')]"

site: $(SITE_READY) ## write notebooks, gallery, exercises and API reference as pages into out/site; they need no kernel and no network
	$(BIN)/python tools/build_site.py out/site

$(SITE_READY): $(READY) docs/requirements.txt
	@$(BIN)/python -c 'import sys; v = sys.version_info[:2]; sys.exit(0 if v >= (3, 11) else "The site needs Python 3.11, .venv has %d.%d; run: make clean, then make PYTHON=python3.11 site" % v)'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r docs/requirements.txt
	@touch $@

test: lint ## ruff, unit tests, notebooks
	$(TEST)
	$(TEST) --nbval-lax notebooks

lint: $(READY) ## ruff check and format check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: $(READY) ## let ruff rewrite the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

lab: $(READY) ## JupyterLab on localhost
	JUPYTER_CONFIG_PATH=$(CURDIR)/tools/jupyter $(BIN)/jupyter lab --ip=localhost notebooks

bench: $(READY) ## time iterations, their parts and whole runs; table, and JSON in BENCH (bench.json)
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only \
		--benchmark-columns=median,iqr,rounds --benchmark-json=$(BENCH)
	$(BIN)/python tests/benchmarks/report.py $(BENCH)

bench-compare: $(READY) ## compare two such files, OLD and NEW
	$(BIN)/pytest-benchmark compare $(OLD) $(NEW) --columns=median --group-by=fullname

lock: ## solve pyproject.toml into requirements.lock and docs/requirements.txt (needs uv); torch brings its own CUDA wheels
	uv pip compile --quiet --universal --python-version 3.10 --extra dev --no-header --no-annotate pyproject.toml \
		| grep -vE '^(nvidia-|cuda-|triton)' > requirements.lock
	uv pip compile --quiet --universal --python-version 3.11 --group site --constraints requirements.lock --no-header --no-annotate \
		> docs/requirements.txt

clean: ## remove what make and the tests made
	rm -rf $(VENV) build *.egg-info .pytest_cache .ruff_cache .benchmarks .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
