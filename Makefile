# Every target creates and uses .venv/ here; nothing else on the machine changes but the Debian
# packages that .ci/debian-packages names and installs.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/pip install --quiet --disable-pip-version-check --constraint .constraints.txt
NATIVE := firmware/build/turnlight-native
GLTF_VALIDATOR := 2.0.0-dev.3.10
AXE_CORE := 4.14.1
BPY := 5.0.1

.PHONY: help setup demo test lint firmware bench clean

help:
	@echo "make demo      capture a simulated sample, maps after every shot -> demo/"
	@echo "make test      every check and test"
	@echo "make bench     timings"
	@echo "make firmware  build the firmware: for this computer, for both boards, and simulated boards"

setup: .venv/.product

demo: .venv/.product firmware
	@echo "== Capturing ten shots of a simulated sample into demo/"
	@rm -rf demo
	$(BIN)/turnlight capture --sample demo --shots 10 --out demo
	@echo "== Look at demo/contact_sheet.png; the maps are in demo/maps/"

test: lint firmware
	@echo "== Firmware tests"
	@$(MAKE) --no-print-directory -C firmware test
	@echo "== Python tests"
	@$(BIN)/python -m pytest -m "not bench"

lint: .venv/.development
	@echo "== Style, types and import directions"
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

firmware: .venv/.debian
	@echo "== Building the firmware"
	@$(MAKE) --no-print-directory -C firmware native avr simavr

bench: .venv/.blender firmware
	@$(BIN)/python -m pytest -m bench -s -q

clean:
	rm -rf .venv demo firmware/build

.venv/.debian: .ci/debian-packages
	@echo "== Debian packages (.ci/debian-packages)"
	@sh .ci/debian-packages
	@test -d .venv || $(PYTHON) -m venv .venv
	@touch $@

.venv/.product: pyproject.toml .constraints.txt .venv/.debian
	@echo "== Python packages of the product, into .venv/ (pinned in .constraints.txt)"
	@$(PIP) --editable .
	@touch $@

.venv/.development: .venv/.product
	@echo "== Python packages for training and tests (torch is large)"
	@$(PIP) torch==2.13.0
	@$(PIP) --editable ".[train,dev]"
	@echo "== The glTF validator and axe-core, from npm, for tests"
	@npm install --silent --no-audit --no-fund --no-save --global --prefix .venv gltf-validator@$(GLTF_VALIDATOR) axe-core@$(AXE_CORE)
	@touch $@

.venv/.blender: .venv/.development
	@echo "== Blender as a Python module, into .venv/blender (large), to render exports with"
	@$(PYTHON) -m venv .venv/blender
	@.venv/blender/bin/pip install --quiet --disable-pip-version-check bpy==$(BPY) || echo "   none for this Python: that bench is skipped"
	@touch $@
