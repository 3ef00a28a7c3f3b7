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

.PHONY: study report paper test test-browser test-engines test-faults test-fuzz test-versions test-reruns release-check slow lint licences docs site pictures lock test-slurm test-archive test-storage scale test-container million mutants catalogue clean

study: $(VENV)/.run
	springtune run "$$STUDY"

# One file with the study's results, captions and run times, to be opened without a network.
report: study
	name=$${STUDY##*/} && snakemake --configfile="$$STUDY" --report "results/$${name%.*}/report.zip"

paper: $(VENV)/.run
	snakemake paper

# Files in this order, those that take longest first: at the end no core waits for the other. The inputs of tests/fuzz are
# others each day: the line that is printed has their seed, by which `make test FUZZ_SEED=...` makes them again.
# A process that crashes ends the run: pytest-xdist 3.8 hangs if it starts another one.
FUZZ_SEED := $(shell date -u +%Y%m%d)
test: $(VENV)/.test
	FUZZ_SEED=$(FUZZ_SEED) pytest -n 2 --max-worker-restart 0 --dist loadfile --no-loadscope-reorder -m "not slow" tests/workflow tests/fuzz tests/reruns tests/faults tests/physics tests/unit src
	SPRINGTUNE_SOLVER=superlu pytest -q -n 2 -m "not slow" tests/physics/test_statics.py tests/physics/test_path.py tests/physics/test_continuation.py

# The page to browse, in a headless Chromium: apt-get install chromium chromium-driver.
test-browser: $(VENV)/.test
	pytest -m "not slow" tests/browser

# Springs in the programs of the extra `engines`, and the study of them, which takes minutes; ENGINES_STUDY= leaves it out.
# Newton compiles its kernels at the first time, in half a minute. What this machine cannot install is named, and skipped.
ENGINES := build/engines
ENGINES_STUDY ?= config/engines.yaml
WITH_ENGINES = PYTHONPATH="$(CURDIR)/src:$(CURDIR)/$(ENGINES)"
# Those of Newton first, since it compiles: at the end no core waits for the other.
ENGINE_TESTS = $(wildcard tests/engines/test_newton*.py) $(filter-out tests/engines/test_newton%,$(wildcard tests/engines/test_*.py))
test-engines: $(VENV)/.test $(ENGINES)/.done
	$(WITH_ENGINES) pytest -n 2 --max-worker-restart 0 --dist loadfile --no-loadscope-reorder -rs -m "not slow" $(ENGINE_TESTS)
	$(if $(ENGINES_STUDY),$(WITH_ENGINES) springtune run $(ENGINES_STUDY))

$(ENGINES)/.done: requirements/engines.txt | $(VENV)/.test
	sh tools/engines.sh $(ENGINES)
	touch $@

# Every write, rename and opening of a file of a small study failed once, by an error, by a full disk and by a kill.
test-faults: $(VENV)/.test
	pytest -n 2 tests/faults

# Spoiled studies, mesh files and datasets by the thousand; INPUTS and SEED choose others. Some minutes.
INPUTS ?= 20000
SEED ?= 1
test-fuzz: $(VENV)/.test
	OPENBLAS_NUM_THREADS=1 python tests/fuzz $(INPUTS) $(SEED)

# The same numbers by SuperLU and by CHOLMOD, with the oldest packages that pyproject.toml allows, and with the newest by
# each Python (python3.11 ...) on PATH; physics holds with them. They are installed, and what is not there is named.
# The quick study, the paper's and physics by the kernels of other processors; what this one cannot run is named, too.
test-versions: $(VENV)/.test
	pytest -rs tests/versions

# A table of changes: which jobs run then, what they compute, and that the dataset is that of a fresh run.
test-reruns: $(VENV)/.test
	pytest -n 2 tests/reruns

# The container image, built and used as its page says; BASE=debootstrap where no registry can be reached.
test-container:
	sh tests/container/run.sh

# A release without releasing: built, checked, installed where nothing else is. What it needs is installed apart.
release-check: $(VENV)/.test
	pytest -rs tests/release

# Studies on a Slurm of two nodes on this machine, as root: the same bytes as without, whatever becomes of jobs and nodes.
test-slurm: $(VENV)/.test build/slurm/.done
	pytest tests/slurm

# The plugin costs every start of Snakemake half a second, so it has an environment of its own.
build/slurm/.done: requirements/run.txt requirements/slurm.txt requirements/cholesky.txt | $(VENV)/.test
	uv venv --quiet --clear --python $(VENV)/bin/python build/slurm
	uv pip install --quiet --compile-bytecode --python build/slurm --require-hashes -r requirements/run.txt -r requirements/slurm.txt
	-uv pip install --quiet --python build/slurm --only-binary :all: --require-hashes -r requirements/cholesky.txt
	touch $@

# Archives of studies: valid to a validator of others, which is installed, and reproduced in a new environment.
test-archive: $(VENV)/.test
	pytest -rs tests/archive

# Results on object storage: Snakemake's plugin and a server of S3 on this machine, installed apart.
test-storage: $(VENV)/.test
	pytest -rs tests/storage

# Small errors put into the physics one at a time, and whether a test fails for each: hours; SHARE tries a part of them.
SHARE ?= 1
MUTANTS := build/mutants/packages
mutants: $(VENV)/.test $(MUTANTS)
	PYTHONPATH="$$PWD/src:$(MUTANTS)" python tools/mutants.py --share $(SHARE)

$(MUTANTS): requirements/mutants.txt
	python -m uv pip install --quiet --require-hashes --no-deps --target $@ --requirement $<
	touch $@

slow: $(VENV)/.test $(ENGINES)/.done
	pytest -n 2 -m slow tests/workflow tests/fuzz tests/browser tests/physics tests/unit src
	HYPOTHESIS_PROFILE=anew pytest -n 2 -m "not slow" tests/unit tests/physics
	$(WITH_ENGINES) pytest -n 2 --max-worker-restart 0 --dist loadfile -rs -m slow tests/engines

# Format, lint, types and spelling, as before each commit: .pre-commit-config.yaml. What can be mended is.
lint: $(VENV)/.test
	sh tools/lint.sh

# The licences of all packages of the lock files, in docs/licences.md.
licences: $(VENV)/.test
	python tools/licences.py

# The configuration's schema and manual, from the models that validate it.
docs: $(VENV)/.run
	SPRINGTUNE_PLUGINS=none python tools/manual.py

# The pages, the names' docstrings and the examples as a site: build/site/index.html. An example reads the quick study.
site: $(VENV)/.test results/quick/dataset.nc
	python -m sphinx -q -W --keep-going -j auto -c docs -d build/doctrees . build/site

results/quick/dataset.nc: | $(VENV)/.run
	snakemake --configfile config/quick.yaml

# The pictures and tables of the pages, from their studies; the benchmark among them takes minutes.
pictures: $(VENV)/.run $(ENGINES)/.done
	$(WITH_ENGINES) python tools/pictures.py
	python tools/pages.py

# Sources, moduli, errors and costs of all definitions, in docs/catalogue.md; half a minute.
catalogue: $(VENV)/.run
	SPRINGTUNE_PLUGINS=none OPENBLAS_NUM_THREADS=1 python tools/catalogue.py

# The tables of a million particles in docs/speed.md, measured on this machine; some minutes and 3 GB.
million: $(VENV)/.run
	OPENBLAS_NUM_THREADS=1 python tools/million.py --write

# What studies of a thousand to a hundred thousand scenes take, into docs/scale.md; some minutes.
scale: $(VENV)/.run
	python tools/scale.py --write

# Stamps: nothing is installed again until a requirement changes.
$(VENV)/.run: requirements/installer.txt requirements/run.txt requirements/cholesky.txt pyproject.toml tools/setup.sh
	sh tools/setup.sh run

$(VENV)/.test: requirements/test.txt $(VENV)/.run
	sh tools/setup.sh test

LOCK = uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate --no-header
lock: $(VENV)/.run
	$(LOCK) requirements/installer.in --output-file requirements/installer.txt
	$(LOCK) pyproject.toml requirements/build.in --extra archive --extra paper --output-file requirements/run.txt
	$(LOCK) pyproject.toml requirements/build.in --extra test --constraints requirements/run.txt --output-file requirements/test.txt
	$(LOCK) requirements/release.in --output-file requirements/release.txt
	$(LOCK) requirements/slurm.in --constraints requirements/run.txt --output-file requirements/slurm.txt
	$(LOCK) pyproject.toml requirements/build.in requirements/storage.in --extra s3 --output-file requirements/storage.txt
	$(LOCK) requirements/engines.in --constraints requirements/test.txt --output-file requirements/engines.txt
	$(LOCK) requirements/mutants.in --constraints requirements/test.txt --output-file requirements/mutants.txt
	$(LOCK) requirements/cholesky.in --constraints requirements/test.txt --output-file requirements/cholesky.txt
	$(LOCK) requirements/validator.in --output-file requirements/validator.txt

# Everything that was computed, of all studies; `springtune clean` removes only what no study asks for any more.
clean:
	@if [ -e results ] && [ "$(YES)" != 1 ]; then \
	    printf 'Remove all results (%s) and .snakemake? What was solved is solved again. [y/N] ' "$$(du -sh results/ | cut -f1)"; \
	    read -r answer || answer=; \
	    case "$$answer" in y|Y|yes) ;; *) echo 'Nothing is removed; without the question: make clean YES=1'; exit 1 ;; esac; \
	fi
	rm -rf build results .snakemake
