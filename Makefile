# Each target does its own set-up: a .venv with the build tools from wheels, then the package in it.
.PHONY: demo test bench lint install clean
.DEFAULT_GOAL := test

PYTHON ?= python3
BIN := .venv/bin

install: .venv/installed

.venv/ready: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip 'maturin>=1.9,<2'
	touch $@

SOURCES := .cargo/config.toml Cargo.toml Cargo.lock $(shell find src -name '*.rs') pyproject.toml
.venv/installed: .venv/ready $(SOURCES)
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	touch $@

demo: install
	$(BIN)/python -m plycloth.demo

test: lint
	cargo test --release --no-default-features --quiet
	$(BIN)/python -m pytest

bench: install
	$(BIN)/python -m benches

lint: install
	cargo fmt --check
	cargo clippy --release --all-targets --quiet -- --deny warnings
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

clean:
	rm -rf target .venv demo bench-results
