# make run | test | report | reference | lint, each with all its set-up. SCALE=smoke|laptop|paper, RUN=<name>.

SCALE ?= laptop
RUN ?= $(SCALE)
PROFILE ?= default
PYTHON ?= python3

VENV := .venv
READY := $(VENV)/.ready
export PATH := $(CURDIR)/$(VENV)/bin:$(PATH)

# Tells what is finished and how much is left; `snakemake -n` tells the reasons.
quiet := --quiet rules host reason
settings = scale=$(1) run=$(2)
snakemake = snakemake --workflow-profile profiles/$(PROFILE) $(3) --config $(call settings,$(1),$(2))
check = python -m anthro.config --check $(call settings,$(1),$(2))
launch = python -m anthro.launch --run $(2) -- --workflow-profile profiles/$(PROFILE) $(quiet) --config $(call settings,$(1),$(2))

.PHONY: run test report reference lint setup

run: setup
	@$(call check,$(SCALE),$(RUN))
	@$(call launch,$(SCALE),$(RUN))

report: run
	@$(call snakemake,$(SCALE),$(RUN),--report results/$(RUN)/report.zip)

reference: run
	@python -m anthro.reference --run results/$(RUN)

lint: setup
	ruff check .
	snakefmt --check Snakefile workflow
	snakemake --lint

test: lint
	pytest
	$(call snakemake,paper,paper,--dry-run $(quiet))
	$(MAKE) run SCALE=smoke RUN=smoke
	@echo "The same again: nothing may be left to do."
	$(call launch,smoke,smoke) 2>&1 | tee results/smoke/again.log
	grep -q "Nothing to be done" results/smoke/again.log
	$(MAKE) report SCALE=smoke RUN=smoke
	@test -s results/smoke/report.zip && echo "All is well."

setup: $(READY)

# A folder without the stamp is half-built, or of another lock file: it is made anew.
$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or later is needed"; exit 2; }
	rm -rf $(VENV)
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python -m pip install --requirement requirements.lock
	$(VENV)/bin/python -m pip install --no-deps --no-build-isolation --editable .
	@touch $(READY)
