# make study                             the paper's study: results/paper
# make study STUDY=config/quick.yaml     another one
# make report                            the same, and its report: results/paper/report.zip
# make paper                             the paper: results/paper/paper.pdf, and the studies that it reads
# make test                              the tests; `make slow` runs the slow ones, and draws
#                                        new examples for the others
# make clean                             removes all results, when you say yes; YES=1 does
STUDY ?= config/paper.yaml
# Recipes read it from the environment: no character of a path is the shell's then.
export STUDY
VENV := .venv
# Rules call `python`: it is to be the one that has springtune.
export PATH := $(CURDIR)/$(VENV)/bin:$(PATH)
# Jobs and tests are many processes: Python is to keep what it compiles.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: million study report paper test slow lint docs site pictures lock test-browser test-engines test-slurm mutants clean

study: $(VENV)/.run
	springtune run "$$STUDY"

# One file with the study's results, captions and run times, to be opened without a network.
report: study
	name=$${STUDY##*/} && snakemake --configfile="$$STUDY" --report "results/$${name%.*}/report.zip"

paper: $(VENV)/.run
	snakemake paper

# The rooms of src/springtune, and the pages.
TESTS := $(addprefix tests/,mechanics reference scene springs engines prediction handover studies cli mesh linalg problem safe_io docs) \
    $(wildcard tests/test_*.py)

# Files in this order, those that take longest first: at the end no core waits for the other.
# A process that crashes ends the run: pytest-xdist 3.8 hangs if it starts another one.
test: $(VENV)/.test
	pytest -n 2 --max-worker-restart 0 --dist loadfile --no-loadscope-reorder -m "not slow" tests/workflow tests/fuzz tests/reruns $(TESTS) src
	SPRINGTUNE_SOLVER=superlu pytest -q -n 2 -m "not slow" tests/mechanics/test_statics.py tests/mechanics/test_series.py tests/mechanics/test_continuation.py

# The page to browse, in a headless Chromium: apt-get install chromium chromium-driver.
test-browser: $(VENV)/.test
	pytest -m "not slow" tests/browser

# Springs in the programs of the extra `engines`, and the study of them, which takes minutes; ENGINES_STUDY= leaves it out.
# Newton compiles its kernels at the first time, in half a minute. What this machine cannot install is named, and skipped.
ENGINES := build/engines
ENGINES_STUDY ?= config/engines.yaml
WITH_ENGINES = PYTHONPATH="$(CURDIR)/src:$(CURDIR)/$(ENGINES)"
# Those of Newton first, since it compiles: at the end no core waits for the other.
ENGINE_TESTS = $(wildcard tests/programs/test_newton*.py) $(filter-out tests/programs/test_newton%,$(wildcard tests/programs/test_*.py))
test-engines: $(VENV)/.test $(ENGINES)/.done
	$(WITH_ENGINES) pytest -n 2 --max-worker-restart 0 --dist loadfile --no-loadscope-reorder -rs -m "not slow" $(ENGINE_TESTS)
	$(if $(ENGINES_STUDY),$(WITH_ENGINES) springtune run $(ENGINES_STUDY))

$(ENGINES)/.done: requirements/engines.txt | $(VENV)/.test
	sh tools/engines.sh $(ENGINES)
	touch $@

# Studies on a Slurm of two nodes on this machine, as root: the same bytes as without, whatever becomes of jobs and nodes.
test-slurm: $(VENV)/.test build/slurm/.done
	pytest tests/slurm

# The plugin costs every start of Snakemake half a second, so it has an environment of its own.
build/slurm/.done: requirements/run.txt requirements/slurm.txt | $(VENV)/.test
	uv venv --quiet --clear --python $(VENV)/bin/python build/slurm
	uv pip install --quiet --compile-bytecode --python build/slurm --require-hashes -r requirements/run.txt -r requirements/slurm.txt
	-uv pip install --quiet --python build/slurm --only-binary :all: --require-hashes -r $(VENV)/cholesky.txt
	touch $@

# Small errors put into the physics one at a time, and whether a test fails for each: hours; SHARE tries a part of them.
SHARE ?= 1
MUTANTS := build/mutants/packages
mutants: $(VENV)/.test $(MUTANTS)
	PYTHONPATH="$$PWD/src:$(MUTANTS)" python tools/mutants.py --share $(SHARE)

$(MUTANTS): | $(VENV)/.test
	python -m uv pip install --quiet --constraint requirements/test.txt --target $@ 'cosmic-ray>=8.4' 'coverage>=7.6'

# What takes minutes: slow tests, new random examples, each file operation of a small study failed once, 20,000 spoiled
# inputs (INPUTS and SEED choose others), other versions, solvers and processors, and a release without releasing.
# What this machine lacks is named, and skipped.
INPUTS ?= 20000
SEED ?= 1
slow: $(VENV)/.test $(ENGINES)/.done
	pytest -n 2 -m slow tests/workflow tests/fuzz $(TESTS) src
	HYPOTHESIS_PROFILE=anew pytest -n 2 -m "not slow" $(TESTS)
	$(WITH_ENGINES) pytest -n 2 --max-worker-restart 0 --dist loadfile -rs -m slow tests/programs
	pytest -n 2 tests/reruns
	OPENBLAS_NUM_THREADS=1 python tests/fuzz/fuzz.py $(INPUTS) $(SEED)
	pytest -rs tests/versions tests/release

# Format, lint, types and spelling, as before each commit: .pre-commit-config.yaml. What can be mended is.
lint: $(VENV)/.test
	sh tools/lint.sh

# What is written from the code: schema and manual of studies, and the catalogue of definitions; a minute.
docs: $(VENV)/.run
	SPRINGTUNE_PLUGINS=none python tools/manual.py
	SPRINGTUNE_PLUGINS=none OPENBLAS_NUM_THREADS=1 python tools/catalogue.py

# The pages, the names' docstrings and the examples as a site: build/site/index.html. An example reads the quick study.
site: $(VENV)/.test results/quick/dataset.nc
	python -m sphinx -q -W --keep-going -j auto -c docs -d build/doctrees . build/site

results/quick/dataset.nc: | $(VENV)/.run
	snakemake --configfile config/quick.yaml

# The pictures and tables of the pages, from their studies, and what is measured on this machine: docs/scale.md and a
# million particles in docs/speed.md. Half an hour and 2 GB. `make million JUDGE=/other/.venv/bin/python` compares solves.
pictures: $(VENV)/.run $(ENGINES)/.done
	$(WITH_ENGINES) python tools/pictures.py
	python tools/pages.py
	OPENBLAS_NUM_THREADS=1 python tools/million.py --write
	python tools/scale.py --write

million: $(VENV)/.run
	OPENBLAS_NUM_THREADS=1 python tools/million.py $(if $(JUDGE),--judge $(JUDGE))

# Stamps: nothing is installed again until a requirement changes.
$(VENV)/.run: requirements/installer.txt requirements/run.txt requirements/test.txt pyproject.toml tools/setup.sh
	sh tools/setup.sh run

$(VENV)/.test: requirements/test.txt $(VENV)/.run
	sh tools/setup.sh test

# Versions and hashes of all packages, and their licences in docs/licences.csv. uv does not read pip's configuration, so the
# indexes, where pip has some of its own, are handed on, and are equal, as to pip.
LOCK = uv pip compile --quiet --index-strategy unsafe-best-match --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header
# Extras that the tests need, besides the group `test`.
TESTED = --extra archive --extra cholesky --extra export --extra mujoco --extra paper
lock: export UV_DEFAULT_INDEX ?= $(shell pip config get global.index-url 2>/dev/null)
lock: export UV_INDEX ?= $(shell pip config get global.extra-index-url 2>/dev/null)
lock: $(VENV)/.test
	$(LOCK) requirements/installer.in --output-file requirements/installer.txt
	$(LOCK) pyproject.toml requirements/build.in --extra archive --extra paper --output-file requirements/run.txt
	$(LOCK) pyproject.toml requirements/build.in $(TESTED) --group pyproject.toml:test --constraints requirements/run.txt --output-file requirements/test.txt
	$(LOCK) requirements/slurm.in --constraints requirements/run.txt --output-file requirements/slurm.txt
	$(LOCK) requirements/engines.in --constraints requirements/test.txt --output-file requirements/engines.txt
	python tools/licences.py

# Everything that was computed, of all studies.
clean:
	@if [ -e results ] && [ "$(YES)" != 1 ]; then \
	    printf 'Remove all results (%s) and .snakemake? What was solved is solved again. [y/N] ' "$$(du -sh results/ | cut -f1)"; \
	    read -r answer || answer=; \
	    case "$$answer" in y|Y|yes) ;; *) echo 'Nothing is removed; without the question: make clean YES=1'; exit 1 ;; esac; \
	fi
	rm -rf build results .snakemake
