# Every target sets up what it needs: on a bare Debian 12 with root (or sudo) `make demo` is enough.
# Times: two cores, packages from a near mirror.

.DEFAULT_GOAL := help
.PHONY: help setup setup-mpi demo validate paper claims reproduce verify bench rivals stability test lint types unit engine docs format lock clean

BIN := .venv/bin
STAMP := $(shell date +%Y%m%d-%H%M%S)
# A test is one thread: threads that find no free core spin, and bits depend on their number.
# One process more than cores, since some tests wait (Slurm, browsers); a file of tests in one of them, those that run YADE first: they take longest.
PYTEST := OMP_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses $(shell expr $$(nproc) + 1) --dist loadfile --no-loadscope-reorder --durations 25

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: ## install everything into the system and .venv (first time on a bare system: 5 min; then at once)
	@setup/install.sh

setup-mpi: setup ## install LAMMPS and Open MPI besides, for engine: lammps (a minute)
	@setup/install.sh --mpi

demo: setup ## one pile, three procedures: a picture, and a figure among published numbers (1 min)
	$(BIN)/smarticles sweep studies/demo/sweep.yaml --out out/demo-$(STAMP) --submit local
	$(BIN)/python -m studies.demo out/demo-$(STAMP)

validate: setup ## the whole comparison with Gravish et al. 2012 (hours)
	$(BIN)/smarticles study gravish --out out/validate-$(STAMP)

PAPER := gravish procedures procedures-code procedures-code-yade factors melting melting-code casting casting-code fracture fracture-code strength strength-code collapse chain chain-bodies friction contacts compaction landscape finite-size

paper: setup ## the paper's studies by its text and by its code, and what they say of its claims (47 hours of one core; goes on where it was stopped)
	for study in $(PAPER); do $(BIN)/smarticles study $$study --out out/paper/$$study || exit 1; done
	$(BIN)/python -m studies.claims out/paper
	$(BIN)/python -m studies.hours out/paper $(PAPER)

claims: setup ## from the tables in results/: CLAIMS.md, claims.yaml, SHA256SUMS and ro-crate-metadata.json (seconds)
	$(BIN)/python -m studies.claims results
	$(BIN)/python -m studies.package

reproduce: setup ## one cell of each table in results/ computed anew and compared with the table (5 min)
	$(BIN)/python -m studies.reproduce --out out/reproduce-$(STAMP)

verify: setup ## known answers against theory, and orders of convergence, on both engines (3 min)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -p no:xdist -q validation/known --results out/verify-$(STAMP)

bench: setup ## measure speed, what each effect costs, and rivals that are installed (hours)
	OMP_NUM_THREADS=1 $(BIN)/python -m benchmarks.engines
	$(BIN)/python -m benchmarks.scaling
	OMP_NUM_THREADS=1 $(BIN)/python -m benchmarks.effects
	OMP_NUM_THREADS=1 $(BIN)/python -m benchmarks.rivals

rivals: setup ## install the engines that make bench compares with, into .venv (a minute); nothing else needs them
	$(BIN)/python -m pip -qq --disable-pip-version-check install -r requirements.txt -r requirements-bench.txt
	@command -v lmp >/dev/null || echo "LAMMPS is a package of Debian: apt-get install lammps"

stability: setup ## hard cases in full size, and where the stable time step ends (an hour; goes on where it was stopped)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -p no:xdist -q -m long validation/hard --results out/stability

test: lint types ## all checks and tests, as continuous integration runs them (minutes)
	$(PYTEST) tests validation -m "not validation and not long"

lint: setup ## style: ruff (seconds)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup ## types: mypy, strict (a minute the first time)
	$(BIN)/mypy
	$(BIN)/mypy tests/double.py

unit: setup ## tests that need no YADE (minutes)
	$(PYTEST) tests/unit

engine: setup ## tests that run YADE (minutes)
	$(PYTEST) tests/engine -m "not validation"

docs: setup ## the documentation as pages, out/docs/index.html; warnings are errors (seconds)
	$(BIN)/python -m sphinx -E -W --keep-going -q -b html docs out/docs
	@echo "out/docs/index.html"

format: setup ## rewrite the sources in the project's style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

lock: ## pin requirements*.txt anew from pyproject.toml (minutes)
	setup/lock.sh

clean: ## remove .venv and caches; results in out/ stay
	rm -rf .venv build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -not -path './out/*' -prune -exec rm -rf {} +
