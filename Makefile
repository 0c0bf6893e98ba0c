# make help lists the targets.
PYTHON ?= python3
BIN := .venv/bin
export PIP_CONSTRAINT := $(CURDIR)/constraints.txt
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# What pip installs of the optional parts; the shaders are run where `shader` is.
EXTRAS ?= figures,test
SUDO := $(shell [ "$$(id -u)" = 0 ] || command -v sudo)

.PHONY: help test test-slow lint format fits shaders shader-deps figures clean

help:
	@echo "make test | test-slow | lint | format | fits | figures | clean"
	@echo "make shaders | shader-deps"

.venv/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -q -e '.[$(EXTRAS)]'
	touch $@

test: .venv/installed
	$(BIN)/pytest -n 2

test-slow: .venv/installed
	$(BIN)/pytest -n 2 --dist loadgroup -m slow

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright

format: .venv/installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Two at a time, the longest first; what is measured and emitted follows from them.
TIERS := fine medium light
MEASURED := fits/quality.py fits/shaders.py
LONG := fits/karis.py fits/tail.py
SHORT := $(filter-out fits/tiers.py $(LONG) $(MEASURED),$(sort $(wildcard fits/*.py)))
fits: .venv/installed
	@{ printf 'fits/tiers.py --tiers %s\n' $(TIERS); printf '%s\n' $(LONG) $(SHORT); } \
	  | xargs -L 1 -P 2 $(BIN)/python
	@for script in $(MEASURED); do $(BIN)/python $$script || exit 1; done

shaders: .venv/installed
	$(BIN)/python fits/shaders.py

# Tests compile and run the shaders where these are.
DEPS := mesa-vulkan-drivers glslang-tools spirv-tools
shader-deps:
	@if command -v apt-get > /dev/null; then \
	  $(SUDO) apt-get -qq update && $(SUDO) env DEBIAN_FRONTEND=noninteractive \
	    apt-get -qq -y --no-install-recommends install $(DEPS); \
	else \
	  echo "no apt-get: install Mesa's Vulkan drivers, glslang and SPIRV-Tools"; \
	fi

figures: .venv/installed
	@for script in figures/[a-z]*.py; do $(BIN)/python $$script || exit 1; done

clean:
	rm -rf .venv .pytest_cache .ruff_cache
