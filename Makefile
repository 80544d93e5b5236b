# One command per habit; `make help` prints them.
.DEFAULT_GOAL := help
SHELL := /bin/bash
export PATH := $(HOME)/.local/bin:$(HOME)/.cargo/bin:$(PATH)
export UV_COMPILE_BYTECODE := 1
CARGO := cargo --config 'term.quiet=true'
KERNEL := runtime/kernel
RUN := uv run --no-sync
FUZZ_SECONDS ?= 3600

.PHONY: help
help:  ## Show this help
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: uv
uv:
	@command -v uv >/dev/null || python3 -m pip install --quiet --user uv

.PHONY: install
install: uv  ## Set up .venv with everything, the kernel built
	@uv sync --quiet --locked

.PHONY: demo
demo:  ## Set everything up and render the igloo
	@start=$$SECONDS; $(MAKE) --no-print-directory install && mkdir -p out \
	  && $(RUN) ovolo render examples/igloo.ovo --output out/igloo.png \
	  && echo "the igloo is in out/igloo.png; wall time $$((SECONDS - start)) s"

.PHONY: check
check: install  ## Formats, lints, types, and the native stub
	@$(RUN) ruff format --check .
	@$(RUN) ruff check .
	@$(RUN) mypy
	@$(RUN) python -m mypy.stubtest runtime._kernel --concise
	@cd $(KERNEL) && $(CARGO) fmt --check
	@cd $(KERNEL) && $(CARGO) clippy --all-targets -- -D warnings
	@cd $(KERNEL) && $(CARGO) clippy --features python --lib -- -D warnings

.PHONY: format
format: install  ## Put Python and Rust into canonical form
	@$(RUN) ruff format .
	@$(RUN) ruff check --fix-only --quiet .
	@cd $(KERNEL) && $(CARGO) fmt

.PHONY: test
test:  ## Set everything up and pass the tests
	@start=$$SECONDS; $(MAKE) --no-print-directory install \
	  && (cd $(KERNEL) && cargo test --release --quiet) \
	  && $(RUN) pytest -n auto --quiet \
	  && echo "tests passed; wall time $$((SECONDS - start)) s"

.PHONY: fuzz
fuzz: install  ## Random input against every reader for an hour; FUZZ_SECONDS=60 for less
	@$(RUN) python -m benchmarks.fuzz --seconds $(FUZZ_SECONDS) --seed $$RANDOM

.PHONY: memcheck
memcheck:  ## The kernel's unsafe parts under valgrind
	@cd $(KERNEL) && RUST_MIN_STACK=16777216 $(CARGO) --config "target.'cfg(all())'.runner=['valgrind','-q','--error-exitcode=9']" \
	  test --lib -- trace:: lanes:: --test-threads=1

.PHONY: neon
neon: export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER := aarch64-linux-gnu-gcc
neon: export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER := qemu-aarch64 -L /usr/aarch64-linux-gnu
neon:  ## The kernel's tests on an emulated ARM; Debian: qemu-user, gcc-aarch64-linux-gnu
	@rustup target add aarch64-unknown-linux-gnu
	@cd $(KERNEL) && $(CARGO) test --release --quiet --lib --target aarch64-unknown-linux-gnu

.PHONY: bench
bench: install  ## Measure speed beside the peers; records go to benchmarks/records
	@$(RUN) python -m benchmarks --record
