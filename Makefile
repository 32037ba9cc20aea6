# All targets share one virtual environment, made on first use.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.DEFAULT_GOAL := help
.PHONY: help setup demo test check lint types imports conformance mutants clean

help: ## Print this list.
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-12s %s\n", $$1, $$2}'

setup: $(READY) ## Install everything into .venv.

demo: $(READY) ## Trace a scene, encode it, decode it, measure it: demo/report/index.html.
	$(BIN)/quarc-ref demo -o demo --force

test: $(READY) ## Run all tests.
	$(BIN)/python -m pytest -q --numprocesses auto --maxprocesses 4 --dist loadfile

check: lint types imports test ## Everything that CI runs: lint, types, import rules, tests.

lint: $(READY) ## Style and spelling.
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell

types: $(READY) ## Types, strictly.
	$(BIN)/mypy

imports: $(READY) ## Who may import whom.
	$(BIN)/lint-imports

REFERENCE := $(BIN)/python -m quarc_ref.decoder
TYPESCRIPT := decoders/typescript

conformance: $(READY) ## Test vectors: reference decoder and encoder, and decoders/.
	$(BIN)/python conformance/run.py --decoder "$(REFERENCE)"
	$(BIN)/python conformance/run.py --decoder "$(REFERENCE) --coder python"
	$(BIN)/python conformance/run.py --decoder "env QUARC_REF_KERNELS=compiled $(REFERENCE)" \
	  --timeout 300 --memory 1024
	$(BIN)/python conformance/run.py --decoder "$(REFERENCE)" --timeout 300 --memory 2048 \
	  --encoder "$(BIN)/python conformance/encoder/encode_scene.py"
	@if command -v npm >/dev/null; then \
	  cd $(TYPESCRIPT) && { [ -d node_modules ] || npm ci --silent; } && npm run --silent build && cd - >/dev/null && \
	  $(BIN)/python conformance/run.py --decoder "node $(TYPESCRIPT)/dist/src/main.js"; \
	else echo "no Node here: $(TYPESCRIPT) is left out"; fi

mutants: $(READY) ## Break the reference decoder in one place after the other: the vectors must see it.
	$(BIN)/python conformance/selftest/run_mutants.py

clean: ## Remove what was made.
	rm -rf $(VENV) demo .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "quarc-ref needs Python 3.11 or later: make PYTHON=python3.11 ...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --disable-pip-version-check -e '.[encode,view,dev]'
	@touch $(READY)
