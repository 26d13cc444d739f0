PYTHON ?= python3
BIN := .venv/bin
# Every installation here takes the versions of constraints.txt, the build tool's too: what passed today passes in a year.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
INSTALL := $(PIP) --no-build-isolation --editable

# The tests start a hundred processes; where Python may keep no compiled files, each of them compiles every file anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo install test checks compiled lowest lowest-compiled lowest-drivers platforms upgrade bench slower paper faults powercuts kills fuzz soak damage memory elsewhere proofs mutants stops machines plant rejudge trends laws audit surfaces rivals reference uncertainty supply-chain docs bundle page-tools screenshots
demo: .venv/installed
	$(BIN)/cmmlink demo --out demo-result

install: .venv/all-installed

# A file stays with one process, which so prepares its nominals and its browser once; tests/conftest.py has the order.
# Three on two cores: tests often wait for a device, a page or a process of their own; threads of linear algebra would only wait for
# one another.
PYTEST := OPENBLAS_NUM_THREADS=1 $(BIN)/pytest
AT_ONCE := -n 3 --dist loadfile --no-loadscope-reorder

test: checks compiled page-tools
	$(PYTEST) $(AT_ONCE) $(PYTEST_OPTIONS)
	@tests/page/check $(PAGE_OPTIONS)

checks: .venv/test-installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The tests in a browser have axe-core look at every view.
page-tools:
	@tests/page/check --install

# Every view of the page in every language and theme, on four sizes of screen: 80 pictures to be looked at one by one.
PICTURES_IN ?= build/screenshots
screenshots: .venv/test-installed
	$(BIN)/python -m tests.cmmlink.console.screenshots $(PICTURES_IN)

# Tests have a time limit each, and the first one would have to compile the inspection; `make -j 2` does it beside the checks.
compiled: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.warm_up

# The lowest versions that pyproject.toml allows, on Python 3.11 and without the extras, must pass the fast tests: the first case of
# every test of the three packages, and of what uses a library in the application: plans, nominal files, exports, reports, record, a command,
# the server.
# Left out is what says nothing of a version: what evaluates characteristics, which uses no library itself; and scans judged by the
# hundred, by the same functions as the tests beside them. Drivers need nothing compiled, so they are tested while the inspection is.
LOWEST_PYTHON ?= python3.11
OF_LIBRARIES := plan nominal_files exports report record/test_recorder.py commands/test_inspect.py console/test_server.py
BY_THE_HUNDRED := conclusion long_scans prefix pose_track profile_uncertainty setup_check lifted_assumptions
lowest: .venv/lowest/installed
	@$(MAKE) --no-print-directory -j 2 lowest-compiled lowest-drivers
	.venv/lowest/bin/python -m pytest $(AT_ONCE) --first-case tests/inspection $(OF_LIBRARIES:%=tests/cmmlink/%) \
		--ignore=tests/inspection/kernels/test_compiling.py --ignore=tests/inspection/evaluation \
		$(BY_THE_HUNDRED:%=--ignore=tests/inspection/test_%.py)

lowest-compiled: .venv/lowest/installed
	.venv/lowest/bin/python -m tests.benchmarks.warm_up

lowest-drivers: .venv/lowest/installed
	.venv/lowest/bin/python -m pytest --first-case tests/drivers tests/simulators

# For every system of the README the versions of constraints.txt must exist as wheels.
platforms: .venv/test-installed
	.ci/platforms $(BIN)/uv

# Resolve every version anew and run everything with it; constraints.txt and .ci/lowest.txt stay as they were where that fails.
upgrade: .venv/test-installed
	.ci/upgrade $(BIN)/uv

# Every place at which a command calls the operating system fails once, before and after its work, or is where the run is killed;
# `EVERY=--every` strikes each call of each place.
faults: .venv/test-installed
	$(BIN)/python -m tests.integration.fail_once $(EVERY)
	$(BIN)/python -m tests.integration.fail_once --after $(EVERY)
	$(BIN)/python -m tests.integration.fail_once --kill $(EVERY)

# Power cuts at random moments of what SQLite writes, with unsynchronised sectors lost or swapped.
CUTS ?= 2000
powercuts: .venv/test-installed
	$(BIN)/python -m tests.integration.power_cuts $(CUTS)

# Mutated inputs for every reader, codec, plan, map, record and message; what goes wrong is kept in tests/fuzz/corpus.
MINUTES ?= 10
fuzz: .venv/test-installed
	$(BIN)/python -m tests.fuzz.grow $(MINUTES) $(TARGETS)

# A station for an hour: a scanner at 10,000 points/s, the console, its record and a page; memory, losses and latency are printed.
SECONDS ?= 3600
soak: .venv/test-installed
	$(BIN)/python -m tests.integration.soak $(SECONDS)

# A hundred recording processes killed at random moments; every acknowledged point must be there.
kills: .venv/test-installed
	$(BIN)/python -m tests.integration.killed soak 100

# The API reference for a browser, from the docstrings of the front doors, after the pages that come from the models.
DOCS_IN ?= build/docs
docs: .venv/docs-installed
	$(BIN)/python docs/generate.py
	PYTHONPATH=. $(BIN)/python docs/api.py $(DOCS_IN)
	@echo "$(DOCS_IN)/index.html"

# A folder that installs cmmlink without a network, with a menu entry for the console: `make bundle SYSTEM=windows`.
# SYSTEM: linux, linux-arm, windows, macos, macos-intel. EXTRAS: plain, or all. BUNDLE_PYTHON: the version that is installed there.
SYSTEM ?= linux
EXTRAS ?= plain
BUNDLE_PYTHON ?= 3.12
bundle: .venv/bundle-installed
	.ci/bundle/make $(BIN) $(SYSTEM) $(BUNDLE_PYTHON) $(EXTRAS) build/cmmlink-$(SYSTEM)

# Licences of all that is installed, and known vulnerabilities of what is pinned, as far as the package index can be asked.
supply-chain: .venv/test-installed
	.ci/supply-chain $(BIN)

# The file of records damaged in thousands of ways: every command answers in words, and verify calls none of them sound.
damage: .venv/test-installed
	$(BIN)/pytest -n 2 --timeout 7200 --damages 100000 tests/cmmlink/record/test_damage.py

# Bytes of memory a point of long scans: run, page, export and replay of 1, 4, 16 and 36 million points; takes an hour and 12 GB of disk.
POINTS := 1e6 4e6 1.6e7 3.6e7
memory: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.memory_per_point $(POINTS)

# Runs of every kind, exported and replayed as on other processors, with other languages, time zones and numbers of threads; takes minutes.
# With PYTHONS=.venv/lowest/bin/python also with another Python and its libraries.
elsewhere: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.elsewhere --python $(PYTHONS)

# The proof in mid-scan over 1,200 simulated scans of six kinds, 200 each: no part that passes may be proven out.
proofs: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.live_proof 200

# A million points with faults by I++ DME and by text lines of a machine tool: no wrong one, and what is missing is told.
machines: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.machine_faults 1e6

# Copies of the program with one line changed qualify themselves: each mistake must be found, and named by its kind.
mutants: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.qualified_mutants

# An archive judged again by one process, two, and a Dask cluster of eight on this computer; 2,000 runs of 50,000 points need 10 GB of disk.
# ARCHIVE_IN=FOLDER keeps them and what was measured, and goes on from there; WAYS chooses among "here 1 2 killed dask".
ARCHIVE ?= 2000
rejudge: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.rejudge_benchmark $(ARCHIVE) $(if $(ARCHIVE_IN),--folder $(ARCHIVE_IN)) $(if $(WAYS),--ways $(WAYS))

# How long the view of trends waits for a PostgreSQL server with 100,000 runs of ten characteristics, which takes a minute to be filled.
trends: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.trends_benchmark

# How soon a measuring machine is told to stop, and how much of the scans of 100 bad parts stop_when_failed saves.
stops: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.machine_stops 100

# A PostgreSQL server killed twenty times while 200 runs are pushed, and what is asked of 100,000 runs; takes some minutes.
plant: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.plant_results 200 100000

# The two laws over every source, format and surface, with thirty times as many random cases as `make test` tries; every rotation, too.
laws: .venv/test-installed
	$(BIN)/pytest --hypothesis-profile=laws --timeout 7200 tests/integration/test_laws.py tests/integration/test_laws_of_files.py \
		tests/inspection/test_coarse.py tests/inspection/surface/test_surface_laws.py

# Two hundred sound runs of every kind, exported and checked by docs/verify/verify.py, which may call nothing untrue; then some are altered.
RUNS ?= 200
verifier: .venv/test-installed
	$(BIN)/python -m tests.docs.sound_runs $(RUNS)

# A folder of airfoils, from the file to the minimum zone, held against the verifier's algorithms: `make airfoils FOLDER=...`.
FOLDER ?= tests/data/airfoils
airfoils: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.airfoil_folder $(FOLDER)

# The audit of verdicts: live scans, minimum zones, partial scans and mirrored parts whose truth is known.
audit: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.verdict_audit

# Whole surfaces: poses found without a start, of whole scans and of parts, how many points the stated error of clouds covers, and a
# small defect among a million points.
surfaces: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.surface_poses
	$(BIN)/python -m tests.benchmarks.surface_verdicts

# The closest point of a surface beside what Open CASCADE, Open3D, libigl, FCPW, engeom and trimesh take for it, and whose signs are wrong;
# takes a quarter of an hour.
rivals: .venv/bench-installed
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.benchmarks.surface_benchmark --million

# Every point of every case of the reference set, and every number that is stated of it, found anew by mpmath; takes some minutes.
reference: .venv/test-installed
	$(BIN)/python -m tests.cmmlink.reference.every_point

# The audit of U: ten numbers of four sections, measured anew with drawn errors; less may not be stated than they scatter by.
uncertainty: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.uncertainty_audit 200

# All that a user waits for, and the projection against the rivals of the package index; takes half an hour and wants a quiet machine.
# A line is added to docs/performance-history.jsonl, docs/performance.md is written, and what got slower is named.
bench: .venv/bench-installed
	$(BIN)/python -m tests.benchmarks.bench --long
	$(BIN)/python -m tests.benchmarks.projection_benchmark --rivals --millions

# What got slower in the last run of the benchmark than in the one before on this processor, by more than its scatter.
slower: .venv/test-installed
	$(BIN)/python -m tests.benchmarks.bench --slower

# The published paper's tables and the registration's figures; MH42=FILE gives the coordinates that may not be shipped.
paper: .venv/bench-installed
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.benchmarks.paper_tables $(if $(MH42),--mh42 $(MH42))
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.benchmarks.registration_benchmark $(if $(MH42),--mh42 $(MH42))

# One clear line for the two things newcomers meet: an old Python, and Debian's Python without its venv package.
.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "cmmlink needs Python 3.11 or newer; this is $$($(PYTHON) -V). Try: make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || { echo "This Python cannot make virtual environments. On Debian or Ubuntu: apt install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml constraints.txt | .venv/bin/python
	$(PIP) hatchling editables
	$(INSTALL) .
	touch $@

.venv/all-installed: .venv/installed
	@$(INSTALL) '.[all]' || echo "Not every extra has wheels for this system; cmmlink works without them, see README.md." >&2
	@$(BIN)/python -m cmmlink.commands.open3d_doctor
	touch $@

.venv/test-installed: .venv/all-installed
	$(INSTALL) '.[test]'
	touch $@

.venv/bundle-installed: .venv/installed
	$(PIP) uv hatchling
	touch $@

.venv/docs-installed: .venv/all-installed
	$(PIP) pdoc
	touch $@

.venv/bench-installed: .venv/test-installed
	$(INSTALL) '.[bench]'
	touch $@

.venv/lowest/installed: .ci/lowest.txt .venv/test-installed
	$(BIN)/uv venv --quiet --clear --no-python-downloads --python $(LOWEST_PYTHON) .venv/lowest
	$(BIN)/uv pip install --quiet --python .venv/lowest --only-binary :all: --requirements .ci/lowest.txt
	$(BIN)/uv pip install --quiet --python .venv/lowest --no-deps --no-build-isolation --editable .
	touch $@
