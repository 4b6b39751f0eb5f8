# isovary: `make demo` on a fresh machine ends with a picture; `make` lists the rest.
#
# The environment lives in .venv and is set up once, behind stamp files: it is
# renewed when pyproject.toml or constraints.txt change. uv is used when it is
# there and reaches the packages, pip otherwise. GNU make 3.81 or newer.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.stamp
PEERS := .venv-peers

# $(call install,[extra]): this package, editable, with its pinned dependencies
install = $(call install_into,$(BIN),$(1))
install_into = { command -v uv >/dev/null 2>&1 \
	  && uv pip install --quiet --python $(1)/python -c constraints.txt -e '.$(2)'; } \
	|| $(1)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.$(2)'

# $(call make_venv,folder)
make_venv = { command -v uv >/dev/null 2>&1 \
	  && uv venv --quiet --seed --allow-existing --python "$$(command -v $(PYTHON))" $(1); } \
	|| $(PYTHON) -m venv $(1)

.PHONY: help demo view test test-page bench-page check teeth docs bench bench-operators bench-meshers bench-noise bench-carrying bench-grouping bench-eigensolve thesis clean distclean

help:
	@echo 'make demo       compare the two electron densities that ship with isovary; see isovary-demo/'
	@echo 'make view       the page in the browser, with the demo in it'
	@echo 'make test       run the tests and the examples in the docstrings'
	@echo 'make test-page  of these only the page in a real browser (Chromium), three minutes'
	@echo 'make bench-page how fast the page is, alone and for twenty at once'
	@echo 'make check      ruff (lint and format) and mypy --strict'
	@echo 'make teeth      plant faults in a copy of the package, and see its tests find them'
	@echo 'make docs       build the documentation into docs/_build'
	@echo 'make thesis     every experiment of the thesis into docs/thesis, with its verdicts'
	@echo 'make bench      run the benchmarks'
	@echo 'make bench-operators    every operator against exact answers'
	@echo 'make bench-meshers      every mesher and sizing function, and the signature on its meshes'
	@echo 'make bench-noise        how often the noise floor holds the error; ARGS=folder with more fields'
	@echo 'make bench-carrying     null tests, isometries, known maps; ARGS=folder with more fields'
	@echo 'make bench-grouping     which method finds the changed region, and how fast'
	@echo 'make bench-eigensolve   the eigensolve beside other packages, which go into $(PEERS)'
	@echo 'make clean      remove what was built; make distclean removes $(VENV) and $(PEERS) too'
	@echo
	@echo 'PYTHON=python3.12 chooses the interpreter (3.11 to 3.14); ARGS="-k house" goes to pytest.'

demo: $(STAMP)
	$(BIN)/isovary demo -o isovary-demo

view: $(STAMP)-app
	[ -d isovary-demo ] || $(BIN)/isovary demo -o isovary-demo
	$(BIN)/isovary view isovary-demo $(ARGS)

test: $(STAMP)-test
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n logical --maxprocesses 4 --dist loadscope $(ARGS)

test-page: $(STAMP)-test
	$(BIN)/python -m pytest tests/app/test_page_explore.py tests/app/test_page_compare.py \
	  tests/app/test_page_dimple.py $(ARGS)

bench-page: $(STAMP)-test
	$(BIN)/python benchmarks/page.py $(ARGS)

check: $(STAMP)-check
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

teeth: $(STAMP)-test
	$(BIN)/python tools/planted_faults.py $(ARGS)

docs: $(STAMP)-docs
	$(BIN)/sphinx-build -W --keep-going -q docs docs/_build
	@echo 'open docs/_build/index.html'

thesis: $(STAMP)
	OMP_NUM_THREADS=1 $(BIN)/isovary thesis all -o docs/thesis

bench: $(STAMP)
	$(BIN)/python benchmarks/run.py

bench-operators: $(STAMP)
	$(BIN)/python benchmarks/operators.py

bench-meshers: $(STAMP)
	$(BIN)/python benchmarks/meshers.py

bench-noise: $(STAMP)
	$(BIN)/python benchmarks/noise_floor.py $(ARGS)

bench-grouping: $(STAMP)
	$(BIN)/python benchmarks/grouping.py

bench-carrying: $(STAMP)
	$(BIN)/python benchmarks/carrying.py $(ARGS)

bench-eigensolve: $(PEERS)/.stamp
	$(PEERS)/bin/python benchmarks/eigensolvers.py $(ARGS)
	$(PEERS)/bin/python benchmarks/completeness.py
	$(PEERS)/bin/python benchmarks/answer.py

$(STAMP): pyproject.toml constraints.txt
	@command -v $(PYTHON) >/dev/null 2>&1 || { \
	  echo 'isovary needs Python 3.11 to 3.14, but there is no $(PYTHON). Install one, or name it: make PYTHON=python3.12 ...' >&2; \
	  exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' || { \
	  echo "isovary needs Python 3.11 to 3.14, but $(PYTHON) is $$($(PYTHON) --version 2>&1). Name another: make PYTHON=python3.12 ..." >&2; \
	  exit 1; }
	@echo 'Setting up $(VENV); this takes a minute or two, once.'
	@rm -f $(STAMP)*
	@$(call make_venv,$(VENV)) || { \
	  echo 'The environment could not be made. On Debian or Ubuntu: apt-get install python3-venv' >&2; exit 1; }
	@$(call install)
	@touch $@

$(STAMP)-%: $(STAMP)
	@$(call install,[$*])
	@touch $@

$(PEERS)/.stamp: pyproject.toml constraints.txt
	@echo 'Setting up $(PEERS); this takes a minute or two, once.'
	@rm -f $@
	@$(call make_venv,$(PEERS))
	@$(call install_into,$(PEERS)/bin,[peers])
	@touch $@

clean:
	rm -rf build dist isovary-demo docs/_build .pytest_cache .mypy_cache .ruff_cache
	find src tests benchmarks docs -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV) $(PEERS)
