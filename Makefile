# `make` prints what there is to make. PYTHON names the interpreter that the environment is created with.
PYTHON ?= python3
BIN := .venv/bin
ARGS ?=

.DEFAULT_GOAL := help
.PHONY: docs help train test check audit show example benchmark clean

help: ## print these targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):[^#]*## /  make \1\t/' | expand -t 20
	@echo "  ARGS=... adds words to the command, as in: make train ARGS='+experiment=table seed=1'"

# The environment, made again only when what it holds has changed.
.venv/installed: pyproject.toml requirements.txt
	@echo "installing into .venv (a few minutes the first time)"
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --constraint requirements.txt --editable '.[dev,ros,onnx]'
	@touch $@

train: .venv/installed ## teach the hand; Ctrl-C saves, the same command goes on
	$(BIN)/python -m tactile_cube.train $(ARGS)

test: .venv/installed ## run the tests
	$(BIN)/python -m pytest $(ARGS)

check: .venv/installed ## lint, format, types, tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest $(ARGS)

# The tools stand in an environment of their own, so that they audit none of themselves. torchrl's metadata state no
# licence; its LICENSE file is MIT.
LICENCES := MIT;BSD;Apache;MPL;Mozilla Public License;PSF-2.0;Python Software Foundation;zlib
AUDIT := .venv/audit/bin

$(AUDIT)/pip-audit:
	@$(PYTHON) -m venv .venv/audit
	@$(AUDIT)/python -m pip install -qq --disable-pip-version-check pip-audit==2.10.1 pip-licenses==5.5.5

audit: .venv/installed $(AUDIT)/pip-audit ## licences of everything installed, then known vulnerabilities (asks the registry's database)
	$(AUDIT)/pip-licenses --python $(BIN)/python --order=license --ignore-packages torchrl --partial-match --allow-only='$(LICENCES)'
	$(AUDIT)/pip-audit --strict --disable-pip --no-deps --requirement requirements.txt

show: .venv/installed ## watch the shipped policy turn the cube
	$(BIN)/python -m tactile_cube.evaluate $(ARGS)

example: .venv/installed ## find a hidden effect in a hand and win the lost success back
	$(BIN)/python examples/circle.py $(ARGS)

benchmark: .venv/installed ## measure the speed of everything on this machine
	$(BIN)/python -m tactile_cube.benchmark $(ARGS)

docs: .venv/installed ## the documentation as a site in outputs/site
	$(BIN)/python -m pip install -qq --disable-pip-version-check --editable '.[docs]'
	$(BIN)/python docs/generate.py
	$(BIN)/python -m mkdocs build --quiet

clean: ## remove the environment and the caches, keep outputs/
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache build src/*.egg-info
