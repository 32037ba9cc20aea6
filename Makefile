# All targets share one virtual environment, made on first use.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
CORE := $(VENV)/.core

.DEFAULT_GOAL := help
.PHONY: help setup lock outdated locked demo test ci check checks lint types imports docs core typescript player player-build player-tests conformance mutants clean

help: ## Print this list.
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-12s %s\n", $$1, $$2}'

setup: $(READY) $(CORE) ## Install everything into .venv; with cargo also the fast engine.

# Exact versions and hashes for every platform, resolved from the ranges in pyproject.toml.
# torch and its dependencies are separate: see requirements/README.md.
LOCKS := requirements/main.txt requirements/torch.txt
RESOLVE := $(BIN)/uv pip compile --quiet --upgrade --universal --fork-strategy fewest --python-version 3.11 \
  --generate-hashes --no-header --no-annotate pyproject.toml
define resolve
$(RESOLVE) --extra media --extra export --extra bench --extra tensorboard --extra dev -o $(1)/main.txt
$(RESOLVE) --extra train --constraints $(1)/main.txt -o $(1)/torch.txt
endef
# The tools that build docs/ have a separate virtual environment, and their lock in docs/.
resolve_docs = $(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes \
  --no-header --no-annotate docs/requirements.in -o docs/requirements.txt

lock: $(READY) ## Update requirements/ to the newest versions that pyproject.toml allows.
	$(call resolve,requirements)
	$(resolve_docs)

NEWER := $(VENV)/newer
outdated: $(READY) ## Show what `make lock` would change; run this weekly.
	@mkdir -p $(NEWER)
	$(call resolve,$(NEWER))
	@$(BIN)/python requirements/compare.py requirements $(NEWER) || true

locked: $(READY) ## Compare the installed versions with requirements/.
	$(BIN)/python requirements/compare.py requirements
	$(BIN)/python -m pip check --disable-pip-version-check

demo: $(READY) $(CORE) ## Trace a scene, encode, play (demo/demo.html) and measure it (demo/report/index.html).
	$(BIN)/quarc-ref demo -o demo --force

# Files in the order of their folders, except three (tests/conftest.py): by default, xdist starts the
# files with the fewest tests last, and these are among the slowest.
test: $(READY) $(CORE) ## Run the tests, except those marked thorough.
	$(BIN)/python -m pytest -q --numprocesses auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder $(TEST_OPTIONS)

ci: ## Run what CI runs: all checks, and the tests except those marked thorough.
	$(MAKE) --jobs=2 checks
	$(MAKE) test
	$(MAKE) player-tests

check: ## Run what CI runs, with the thorough tests, which take ten more minutes.
	$(MAKE) ci TEST_OPTIONS=--thorough

# What measures no time, two at once: core/ needs no Python, so it is tested while packages are
# installed. The tests of Python and of the player follow one after the other, because some of them
# have time limits.
checks: core $(READY) player-build typescript locked lint types imports docs $(CORE)

lint: $(READY) ## Style and spelling.
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell

types: $(READY) ## Type checks.
	$(BIN)/mypy

imports: $(READY) ## Import rules.
	$(BIN)/lint-imports

DOCS := $(VENV)/docs
docs: $(DOCS)/.ready ## Build the documentation and check its links: build/site/index.html.
	@rm -rf docs/api # left behind if a build is interrupted
	$(DOCS)/bin/sphinx-build -q -W --keep-going -c docs . build/site

$(DOCS)/.ready: docs/requirements.txt
	$(PYTHON) -m venv $(DOCS)
	$(DOCS)/bin/python -m pip install -q --disable-pip-version-check --no-deps --require-hashes -r docs/requirements.txt
	@touch $@

core: ## Check format and lints of core/, and run its tests.
	@if ! command -v cargo >/dev/null; then echo "cargo is not installed: core/ is not tested"; \
	elif ! cargo fetch --quiet --locked --manifest-path core/Cargo.toml; then \
	  echo "the dependencies of core/ cannot be fetched: it is not tested"; \
	else cd core && unset MAKEFLAGS MFLAGS && \
	  cargo fmt --check && cargo clippy --quiet --all-targets -- -D warnings && cargo test --quiet --workspace; fi

TYPESCRIPT := decoders/typescript
typescript: ## Build the decoder in TypeScript, and run its tests.
	@if ! command -v npm >/dev/null; then echo "npm is not installed: $(TYPESCRIPT) is skipped"; \
	else cd $(TYPESCRIPT) && { [ -d node_modules ] || npm ci --silent; } && npm test --silent; fi

player: ## Build player/, test it (in Chromium, if installed), and store it in the package.
	$(MAKE) player-build
	$(MAKE) player-tests

WASM := core/wasm/quarc-player.wasm
player-build: # the WebAssembly module, and the packages that the player needs
	@rm -f $(WASM); if ! command -v npm >/dev/null; then echo "npm is not installed: player/ is skipped"; \
	elif ! (unset MAKEFLAGS MFLAGS && core/wasm/build.sh --player); then \
	  echo "the WebAssembly module cannot be built: player/ is skipped"; \
	else cd player && { [ -d node_modules ] || npm ci --silent; }; fi

player-tests: $(READY)
	@if [ -f $(WASM) ]; then cd player && \
	  QUARC_PYTHON=$(abspath $(BIN))/python npm test --silent && QUARC_WASM=../$(WASM) node keep.mjs; fi

REFERENCE := env QUARC_REF_ENGINE=reference $(BIN)/python -m quarc_ref.conformance

conformance: $(READY) $(CORE) typescript ## Run the conformance suite with all decoders and the encoder; test core/wasm/.
	$(BIN)/python conformance/run.py --decoder "$(REFERENCE)"
	$(BIN)/python conformance/run.py --decoder "$(REFERENCE) --coder python"
	@if command -v cargo >/dev/null; then \
	  $(BIN)/python conformance/run.py --decoder "env QUARC_REF_ENGINE=fast $(BIN)/python -m quarc_ref.conformance" && \
	  cargo build --quiet --release --manifest-path core/Cargo.toml --package quarc-cli && \
	  $(BIN)/python conformance/run.py --decoder "core/target/release/quarc conformance"; \
	else echo "cargo is not installed: core/ is skipped"; fi
	$(BIN)/python conformance/run.py --decoder "$(REFERENCE)" --timeout 300 --memory 2048 \
	  --encoder "$(BIN)/python conformance/encoder/encode_scene.py"
	@if command -v node >/dev/null && core/wasm/build.sh && core/wasm/build.sh --conformance; then \
	  $(BIN)/python conformance/run.py --decoder "node core/wasm/conformance.mjs" && \
	  node --test core/wasm/quarc.test.mjs; \
	else echo "Node is not installed, or the WebAssembly module cannot be built: core/wasm is skipped"; fi
	@if command -v npm >/dev/null; then \
	  $(BIN)/python conformance/run.py --decoder "node $(TYPESCRIPT)/dist/src/main.js"; fi

mutants: $(READY) ## Plant errors in the reference decoder, which the vectors must detect.
	$(BIN)/python conformance/selftest/run_mutants.py

clean: ## Remove everything that make generates, and all caches.
	rm -rf $(VENV) build demo .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache *.egg-info
	rm -rf core/target core/wasm/*.wasm $(TYPESCRIPT)/dist $(TYPESCRIPT)/node_modules
	cd player && rm -rf build dist node_modules .reference
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# uv downloads several packages at once, which halves the time of a setup. It does not read pip's
# configuration, so a mirror that is set there is passed on. The locks are complete, hence --no-deps.
# Without compiled bytecode, every process would take seconds more to import torch where
# PYTHONDONTWRITEBYTECODE is set, as in many containers. TORCH_INDEX is another index for torch than
# PyPI.
TORCH := $(shell sed -n 's/^\(torch==[^ ;]*\).*/\1/p' requirements/torch.txt)
PIP_INSTALL := $(BIN)/python -m pip install -q --disable-pip-version-check --no-compile
MIRROR = $(shell $(PYTHON) -m pip config get global.index-url 2>/dev/null)
UV_INSTALL = $(if $(MIRROR),UV_DEFAULT_INDEX=$(MIRROR)) UV_HTTP_TIMEOUT=300 $(BIN)/uv pip install -q --compile-bytecode --python $(BIN)/python

$(READY): pyproject.toml $(LOCKS)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "quarc-ref needs Python 3.11 or later: make PYTHON=python3.11 ...")'
	$(PYTHON) -m venv $(VENV)
	@sed -n '/^uv==/,/[^\\]$$/p' requirements/main.txt > $(VENV)/uv.txt
	$(PIP_INSTALL) --require-hashes -r $(VENV)/uv.txt
	$(UV_INSTALL) --no-deps --require-hashes -r requirements/main.txt
	$(UV_INSTALL) $(if $(TORCH_INDEX),--index-url $(TORCH_INDEX) $(TORCH),--no-deps --require-hashes -r requirements/torch.txt)
	$(PIP_INSTALL) --no-deps --no-build-isolation -e .
	@touch $(READY)

# The extension is built for this machine: AVX2 saves a tenth of the time per frame.
VECTORS := $(shell /lib64/ld-linux-x86-64.so.2 --help 2>/dev/null | grep -q 'x86-64-v3 .supported' && echo -Ctarget-cpu=x86-64-v3)

$(CORE): $(READY) $(shell find core -not -path '*/target/*' \( -name '*.rs' -o -name 'Cargo.*' -o -name pyproject.toml \))
	@if command -v cargo >/dev/null; then \
	  RUSTFLAGS="$$RUSTFLAGS $(VECTORS)" $(PIP_INSTALL) ./core || echo "quarc_core could not be built: the reference engine decodes"; \
	else echo "cargo is not installed: without quarc_core, large scenes decode many times slower (core/README.md)"; fi
	@touch $(CORE)
