# `make` prints what there is to make. PYTHON names the interpreter that the environment is created with.
PYTHON ?= python3
# PyTorch's index of builds for the processor. The usual build brings CUDA, several GB and NVIDIA's licences.
TORCH_INDEX ?= https://download.pytorch.org/whl/cpu
BIN := .venv/bin
ARGS ?=

.DEFAULT_GOAL := help
.PHONY: docs help torch train test check audit show example benchmark clean

help: ## print these targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):[^#]*## /  make \1\t/' | expand -t 20
	@echo "  needs Python 3.11 to 3.13 with venv (Debian: python3-venv) and make; see docs/install.md"
	@echo "  ARGS=... adds words to the command, as in: make train ARGS='+experiment=table seed=1'"

# The environment, made again only when what it holds has changed.
.venv/installed: pyproject.toml requirements.txt
	@echo "installing into .venv: 0.8 GB to download, 3 GB on disk; a few minutes, the first time only"
	@test -x $(BIN)/pip || $(PYTHON) -m venv .venv
	@$(MAKE) --silent torch
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --constraint requirements.txt --editable '.[dev,ros,onnx,workbench]'
	@touch $@

# Without a GPU torch comes from TORCH_INDEX, if that answers within 5 s; else pip takes what its own index has.
torch:
	@nvidia-smi -L > /dev/null 2>&1 || { \
		$(BIN)/python -c "import signal, urllib.request as web; signal.alarm(5); web.urlopen('$(TORCH_INDEX)/torch/')" && \
		$(BIN)/python -m pip install -qq --disable-pip-version-check --timeout 10 --retries 1 --no-deps \
			--index-url $(TORCH_INDEX) "$$(grep ^torch== requirements.txt)"; \
	} 2> /dev/null || echo "no torch from $(TORCH_INDEX): taking that of pip's own index, maybe with CUDA (several GB)"

train: .venv/installed ## teach the hand, from nothing to a judged policy; after Ctrl-C the same command goes on from the last checkpoint
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
	$(BIN)/python -m benchmarks.speed $(ARGS)

docs: .venv/installed ## the documentation as a site in outputs/site
	$(BIN)/python -m pip install -qq --disable-pip-version-check --editable '.[docs]'
	$(BIN)/python docs/generate.py
	$(BIN)/python -m mkdocs build --quiet --strict

clean: ## remove the environment and the caches, keep outputs/
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache build src/*.egg-info
