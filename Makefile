# Two commands are all a newcomer needs: `make demo` and `make test`.
# Both make .venv when it is missing, and install again only when pyproject.toml has changed since.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# errors only: pip warns about every index of its configuration that lacks a package
PIP_FLAGS := -qq --disable-pip-version-check --no-input
EVERYTHING := .[test,cloud]
BENCH_OUT := build/bench
# Debian packages that tests ask for: a command, or a file where a package brings none, and the package
PACKAGES := chromium gcc g++ make \
	arm-none-eabi-gcc:gcc-arm-none-eabi /usr/lib/arm-none-eabi/include/stdio.h:libnewlib-arm-none-eabi qemu-system-arm \
	avr-gcc:gcc-avr /usr/lib/avr/include/avr/io.h:avr-libc simavr /usr/include/simavr/sim_avr.h:libsimavr-dev \
	/usr/include/libelf.h:libelf-dev /usr/share/arduino/hardware/arduino/avr/cores/arduino/Arduino.h:arduino-core-avr \
	cppcheck clang /usr/lib/llvm-*/lib/clang/*/include/fuzzer:libclang-rt-dev
# what looks at images
VISION_TESTS := tests/vision3d tests/test_image_conventions.py \
	$(patsubst %,tests/factorlab/%,camera cam_imu l19/follower marker_map markers live match stereo) tests/factorlab/cli/test_sheet.py \
	$(patsubst %,tests/factorlab/cli/test_%_command.py,camera line live marker_map objects sfm undistort)
# Two workers on two cores: linear algebra libraries must not start threads of their own.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

# pip inside the environment, or, where the environment could not be given one, the pip that PYTHON has.
pip_install = if [ -x $(BIN)/pip ]; then $(BIN)/python -m pip install $(PIP_FLAGS) $(1); \
	else $(PYTHON) -m pip --python $(BIN)/python install $(PIP_FLAGS) $(1); fi

.DEFAULT_GOAL := help
.PHONY: help demo test test-opencv4 packages check docs site bench warm clean

help:
	@echo "make demo    install, then compare filters and smoothers on a real drive; ends with the report's path"
	@echo "make test    install everything, then run the whole suite"
	@echo "make test-opencv4  tests of images and cameras once more, on OpenCV 4"
	@echo "make check   lint, format, types and import contracts"
	@echo "make docs    pictures, results of the course and pages, which open from build/site/index.html"
	@echo "make site    the pages alone"
	@echo "make bench   every benchmark, and the slow tests with all their seeds"
	@echo "make clean   remove .venv, builds and caches"

# only what the demo runs on is compiled for it
demo: $(VENV)/installed
	@$(BIN)/python -m sequential.warm_up extended unscented iterated smoothing looking walking inertial position
	@$(BIN)/factorlab demo

test: packages $(VENV)/installed-test warm
	@$(ONE_THREAD) $(BIN)/python -m pytest -n 2 $(PYTEST_ARGS)

# OpenCV 4 lies beside the environment's OpenCV 5: what touches images runs on both
test-opencv4: $(VENV)/installed-test warm
	@[ -d $(VENV)/opencv4/cv2 ] || { $(call pip_install,--no-deps --target $(VENV)/opencv4 'opencv-python-headless==4.14.*'); }
	@PYTHONPATH=$(CURDIR)/$(VENV)/opencv4 $(ONE_THREAD) $(BIN)/python -m pytest -n 2 $(VISION_TESTS)

packages:
	@.ci/debian-packages $(PACKAGES)

check: $(VENV)/installed-test
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

# Pictures and the course's results are made from real recordings: without them they stay as they are.
docs: $(VENV)/installed-test warm
	@if [ -n "$$FACTORLAB_DATA" ]; then \
		for script in docs/_make/*.py; do $(ONE_THREAD) $(BIN)/python $$script || exit 1; done; \
		$(ONE_THREAD) $(BIN)/factorlab l19 rapport -o RESULTATS.md --images docs/resultats \
			--readme examples/l19/README.md --force; \
	else echo "FACTORLAB_DATA is not set: pictures and RESULTATS.md stay as they are"; fi
	@$(MAKE) --no-print-directory site

site: $(VENV)/installed-test
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "open $(CURDIR)/build/site/index.html"

# Each script saves its JSON document and, when it misses a "must", exits 3: all run, then the whole fails.
bench: $(VENV)/installed-test warm
	@$(call pip_install,-e '.[bench]'); mkdir -p $(BENCH_OUT); missed=; \
	for script in tests/benchmarks/*.py; do \
		[ -e "$$script" ] || continue; \
		name=$$(basename "$$script" .py); echo "== $$name"; \
		$(ONE_THREAD) $(BIN)/python "$$script" --json > $(BENCH_OUT)/$$name.json || missed="$$missed $$name"; \
		cat $(BENCH_OUT)/$$name.json; \
	done; \
	$(ONE_THREAD) $(BIN)/python -m pytest -n 2 -m slow --full || missed="$$missed slow-tests"; \
	if [ -n "$$missed" ]; then echo "missed:$$missed"; exit 3; fi

# Every kernel is compiled once per machine; doing it here keeps the wait out of the first real run.
warm: | $(VENV)/installed
	@$(BIN)/python -m sequential.warm_up
	@$(BIN)/python -m vision3d.warm_up

$(VENV)/bin/python:
	@echo "creating $(VENV)"
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 || $(PYTHON) -m venv --clear --without-pip $(VENV)

$(VENV)/installed: pyproject.toml | $(VENV)/bin/python
	@echo "installing factorlab (about 1 GB the first time, a few minutes)"
	@$(call pip_install,-e .)
	@touch $@

$(VENV)/installed-test: pyproject.toml | $(VENV)/installed
	@echo "installing what the tests need (about 1 GB more the first time)"
	@$(call pip_install,-e '$(EVERYTHING)')
	@touch $@

clean:
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
