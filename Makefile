# Developer and user commands; `make help` lists them. Needs GNU make and Python >= 3.11.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
USER_STAMP := $(VENV)/.installed
DEV_STAMP := $(VENV)/.installed-dev
ONLY_PYTHON := import sys; sys.exit(0 if sys.version_info >= (3, 11) else 1)
PIP_INSTALL := $(BIN)/python -m pip install --disable-pip-version-check
PACKAGES := planner sumo_nets experiments
# Of pip's lines only one for each large download, and the last stage. Errors go to stderr,
# which is left alone.
# The official checker pins protobuf 3.20 and works with commonroad-io up to 2024.3.
# `triangle`, which it needs for the road's edge, may be used freely but not sold.
CHECKER_VENV := .venv-commonroad
CHECKER_STAMP := $(CHECKER_VENV)/.installed
CHECKER := commonroad-drivability-checker==2025.4.0 commonroad-io==2024.3 \
	commonroad-clcs==2025.2.0 commonroad-vehicle-models==3.0.2 triangle==20250106
SHORTLY := grep --line-buffered -o -E '[^ /]+ \([0-9.]+ MB\)|^Installing collected packages'

# Images of containers often forbid bytecode: then each of the many processes that tests
# and sweeps start compiles all of its source anew, for a third of a second.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help install install-dev experiment need-net figure report sweep need-sweep thesis thesis-docs results results-docs robustness-docs penetration-docs r157 r157-docs commonroad-checker commonroad-docs test test-slow cov docs lint fmt type contracts imports bench bench-docs bench-peers peers-docs comfort-docs families-docs nets schema ci clean

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))

install: $(USER_STAMP) ## Make .venv with what running needs (once; other commands do it too)

install-dev: $(DEV_STAMP) ## The same, and what tests, checks and documentation need

experiment: need-net $(USER_STAMP) ## Run one episode: NET=straight|curved|intersection|u_shaped|lane_change|dense… PLANNER= SEED= GUI=1 ARGS=
	@$(BIN)/rearview run "$(NET)" $(if $(PLANNER),--planner "$(PLANNER)") $(if $(SEED),--seed "$(SEED)") $(if $(GUI),--gui) $(ARGS)

need-net:
	@test -n "$(NET)" || { echo "make experiment needs NET: straight, curved, intersection, u_shaped, lane_change, dense, another name of rearview list, or a scenario file, for example: make experiment NET=intersection" >&2; exit 2; }

figure: $(USER_STAMP) ## Draw a run: RUN=folder (without it the newest one) ARGS="-o picture.pdf"
	@$(BIN)/rearview figure $(if $(RUN),"$(RUN)") $(ARGS)

report: $(USER_STAMP) ## Write the page of a run or sweep: RUN=folder (without it the newest run)
	@$(BIN)/rearview report $(if $(RUN),"$(RUN)") $(ARGS)

sweep: need-sweep $(USER_STAMP) ## Run a parameter study, or go on with it: SWEEP=name or file ARGS="--dry-run"
	@$(BIN)/rearview sweep "$(SWEEP)" $(ARGS)

need-sweep:
	@test -n "$(SWEEP)" || { echo "make sweep needs SWEEP: a name that rearview list shows, or a sweep file, for example: make sweep SWEEP=smoke" >&2; exit 2; }

thesis: $(DEV_STAMP) ## Recompute the thesis into runs/thesis, or go on with it: ARGS="dense --quick"
	@$(BIN)/rearview thesis $(ARGS)

thesis-docs: thesis ## The same, and put numbers and document into docs
	@cp runs/thesis/thesis.json runs/thesis/thesis.md docs/

results: $(DEV_STAMP) ## Run the published sweeps into runs/results, or go on, for hours: ARGS="--seeds 20"
	@$(BIN)/rearview evidence $(ARGS)

results-docs: results ## The same, put numbers and document into docs and their summary into README.md
	@cp runs/results/results.json runs/results/results.md docs/
	@$(BIN)/python -m experiments.evidence.quote README.md docs/results.json

r157: $(DEV_STAMP) ## Draw the picture of UN Regulation 157 into runs/r157, or go on: ARGS="--kind all --full"
	@$(BIN)/rearview r157 $(ARGS)

IMPERFECT := imperfect_cruise imperfect_lane_change imperfect_route imperfect_dense perception perception_lane_change

robustness-docs: $(DEV_STAMP) ## Drive the sweeps of imperfect vehicles and eyes, or go on, and put tables and curves into docs: ARGS="--limit 500"
	@for sweep in $(IMPERFECT); do $(BIN)/rearview sweep $$sweep --yes $(ARGS) || exit $$?; done
	@$(BIN)/rearview robustness $(addprefix sweeps/,$(IMPERFECT)) -o docs/robustness.md --figure docs/pictures/degradation.png

PENETRATION := penetration_ring penetration_platoon penetration_bottleneck penetration_merge

penetration-docs: $(DEV_STAMP) ## Drive the sweeps of many egos, or go on, and put their tables into docs: ARGS="--limit 18"
	@for sweep in $(PENETRATION); do $(BIN)/rearview sweep $$sweep --yes $(ARGS) || exit $$?; done
	@$(BIN)/python -m experiments.evidence.penetration $(addprefix sweeps/,$(PENETRATION)) -o docs/penetration.md

peers-docs: $(DEV_STAMP) ## Drive the sweep peers, or go on, and put its table into docs: ARGS="--limit 500"
	@$(BIN)/rearview sweep peers --yes $(ARGS)
	@$(BIN)/python -m experiments.evidence.peers sweeps/peers -o docs/peers.md

comfort-docs: $(DEV_STAMP) ## Drive the sweeps of comfort, or go on, and put their table into docs: ARGS="--limit 100"
	@$(BIN)/rearview sweep comfort_cruise $(ARGS)
	@$(BIN)/rearview sweep comfort_dense $(ARGS)
	@$(BIN)/python -m experiments.evidence.comfort sweeps/comfort_cruise sweeps/comfort_dense -o docs/comfort.md

rules-docs: $(DEV_STAMP) ## Drive the sweep rules, or go on, and put its table into docs: ARGS="--limit 100"
	@$(BIN)/rearview sweep rules --yes $(ARGS)
	@$(BIN)/python -m experiments.evidence.rules sweeps/rules -o docs/rules.md

FAMILIES := families_cruise families_dense families_lane_change

families-docs: $(DEV_STAMP) ## Drive one driver beside the three families, or go on, and put the table into docs: ARGS="--limit 100"
	@for sweep in $(FAMILIES); do $(BIN)/rearview sweep $$sweep --yes $(ARGS) || exit $$?; done
	@$(BIN)/python -m experiments.evidence.families $(addprefix sweeps/,$(FAMILIES)) -o docs/families.md

GENERATED := runs/generated_networks

networks-docs: $(DEV_STAMP) ## Make networks, drive them, or go on, and put the table into docs: ARGS="--limit 100"
	@for source in netgenerate street_maps; do \
	  $(BIN)/python -m experiments.evidence.generated_networks.prepare $(GENERATED)/$$source --source $$source && \
	  $(BIN)/rearview sweep $(GENERATED)/$$source/sweep.yaml --out $(GENERATED)/$$source/sweep --yes $(ARGS) || exit; \
	done
	@$(BIN)/python -m experiments.evidence.generated_networks.page $(GENERATED)/netgenerate/sweep $(GENERATED)/street_maps/sweep -o docs/generated_networks.md

r157-docs: r157 ## The same, also with a follower and with a dynamic plant, and put documents and pictures into docs
	@$(BIN)/rearview r157 --follower --planner cruise --out runs/r157_follower
	@$(BIN)/rearview r157 --plant dynamic --planner cruise --planner lane_change --planner careful_human --out runs/r157_dynamic
	@cp runs/r157/r157.md docs/
	@cp runs/r157_follower/r157.md docs/r157_follower.md
	@cp runs/r157_dynamic/r157.md docs/r157_dynamic.md
	@cp runs/r157/r157_*.png runs/r157_follower/r157_*.png runs/r157_dynamic/r157_*.png docs/pictures/

commonroad-docs: $(CHECKER_STAMP) $(DEV_STAMP) ## Drive CommonRoad scenarios, check them officially, and put the table into docs
	@$(BIN)/python -m experiments.evidence.commonroad_study -o docs/commonroad.md

commonroad-checker: $(CHECKER_STAMP) ## Make .venv-commonroad with the official checker of CommonRoad solutions

TESTS := not slow and not bench

test: $(DEV_STAMP) ## Run the tests on all cores, without the slow ones: TESTS="not bench" runs both
	@$(BIN)/python -m pytest -n auto --dist worksteal -m "$(TESTS)" $(ARGS)

test-slow: $(DEV_STAMP) ## Run only the slow tests: many episodes in SUMO
	@$(BIN)/python -m pytest -n auto --dist worksteal -m "slow and not bench" $(ARGS)

cov: $(DEV_STAMP) ## Measure which lines and branches the tests reach, slow ones aside: ARGS=tests/sumo_nets
	@$(BIN)/python -m pytest -n auto --dist worksteal --cov --cov-report=term --cov-report=html $(ARGS)
	@echo "what only slow tests reach counts as missed, and compiled functions do not count; with slow tests: make cov ARGS='-m \"not bench\"'"

docs: $(DEV_STAMP) ## Build the documentation into site/index.html; any warning is an error
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "documentation: site/index.html"

lint: $(DEV_STAMP) ## Check style and format
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .

fmt: $(DEV_STAMP) ## Format and mend what can be mended
	@$(BIN)/ruff check --fix-only --quiet .
	@$(BIN)/ruff format .

type: $(DEV_STAMP) ## Check types
	@$(BIN)/mypy

contracts: $(DEV_STAMP)
	@$(BIN)/lint-imports

imports: contracts ## Check which package may import which, sizes of functions, names of classes
	@$(BIN)/python -m pytest -q -s -n0 tests/test_structure.py

bench: $(DEV_STAMP) ## Measure speed; prints a table and saves JSON under .benchmarks
	@$(BIN)/python -m pytest tests/bench -m bench --benchmark-autosave $(ARGS)

bench-docs: $(DEV_STAMP) ## Measure speed and write the figures into docs/performance.md; on an idle machine
	@mkdir -p .benchmarks
	@$(BIN)/python -m pytest tests/bench -m bench --benchmark-json=.benchmarks/docs.json $(ARGS)
	@$(BIN)/python -m tests.bench.performance_page .benchmarks/docs.json
	@$(BIN)/python -m tests.bench.limits

bench-peers: $(DEV_STAMP) $(CHECKER_STAMP) ## Measure our planners and projection beside those of others, into docs
	@$(BIN)/python -m tests.bench.peers -o docs/planners/peers.md

nets: $(DEV_STAMP) ## Rebuild the road networks from their sources
	@$(BIN)/python -m sumo_nets.build $(ARGS)

schema: $(DEV_STAMP) ## Write the JSON Schemas of scenario, sweep and search files
	@$(BIN)/rearview schema > experiments/scenarios/.schema.tmp
	@mv experiments/scenarios/.schema.tmp experiments/scenarios/scenario.schema.json
	@$(BIN)/rearview schema --sweep > experiments/sweeps/.schema.tmp
	@mv experiments/sweeps/.schema.tmp experiments/sweeps/sweep.schema.json
	@$(BIN)/rearview schema --search > experiments/searches/.schema.tmp
	@mv experiments/searches/.schema.tmp experiments/searches/search.schema.json

# the tests build the documentation strictly, and look at the shape of the code
ci: ## Everything that a change must pass
	@$(MAKE) --no-print-directory -j2 --output-sync=target lint type contracts
	@$(MAKE) --no-print-directory test TESTS="not bench" # in one session, the slow ones first

clean: ## Remove .venv, caches and all results in runs and sweeps; compiled loops stay in ~/.cache/rearview
	rm -rf $(VENV) $(CHECKER_VENV) runs sweeps build site .coverage .coverage.* htmlcov *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks .import_linter_cache
	rm -rf planner/_kernels
	find $(PACKAGES) tests -name __pycache__ -type d -prune -exec rm -rf {} +

$(USER_STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c '$(ONLY_PYTHON)' 2>/dev/null || { echo "rearview needs Python >= 3.11; PYTHON=$(PYTHON) is $$($(PYTHON) --version 2>&1 || true). Try: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 2; }
	@echo "Installing rearview, SUMO and the numerical packages into $(VENV) (once, takes a few minutes) ..."
	@$(PYTHON) -m venv $(VENV) || { echo "$(PYTHON) cannot make a virtual environment; on Debian and Ubuntu: apt-get install python3-venv" >&2; exit 2; }
	@{ $(PIP_INSTALL) -e ".[figures]" -c constraints.txt && touch $@.packages; } | $(SHORTLY) || true
	@test -e $@.packages && rm $@.packages
	@$(BIN)/python -m experiments.cosim.sumo.system_libraries
	@touch $@

$(CHECKER_STAMP): Makefile
	@echo "Installing the official checker of CommonRoad into $(CHECKER_VENV) (once) ..."
	@$(PYTHON) -m venv $(CHECKER_VENV)
	@$(CHECKER_VENV)/bin/python -m pip install --disable-pip-version-check --quiet $(CHECKER)
	@$(CHECKER_VENV)/bin/python -c "import commonroad_dc.feasibility.solution_checker, triangle"
	@touch $@

$(DEV_STAMP): $(USER_STAMP)
	@echo "Installing what tests, checks and documentation need into $(VENV) (once) ..."
	@{ $(PIP_INSTALL) -e ".[dev]" -c constraints.txt && touch $@.packages; } | $(SHORTLY) || true
	@test -e $@.packages && rm $@.packages
	@touch $@
