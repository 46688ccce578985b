# The commands of this project. `make` alone lists them. Everything is built by CMake and Ninja in build/<preset>.
PRESET ?= release
EXPERIMENT ?= experiments/meet_for_dinner.yaml
JOBS ?= $(shell nproc)
SETUP ?= yes
FUZZ_SECONDS ?= 300
PREFIX ?= /usr/local
BUILD = build/$(PRESET)
SOURCES = git ls-files '*.cpp' '*.hpp'
FILES ?=

.DEFAULT_GOAL := help
.PHONY: help setup setup-tests setup-package configure configure-tests build run test experiments test-hosts \
  test-package install uninstall package soak bench fuzz docs tables format format-check tidy cppcheck lint hooks clean

help:
	@echo 'make run      set up, build, and run $(EXPERIMENT) with real processes (EXPERIMENT=FILE for another)'
	@echo 'make test     set up, build, and run every test'
	@echo 'make test-hosts  the tests of runs over several hosts: as root, in network namespaces with a real sshd in each'
	@echo 'make test-package  makes the Debian packages and tries them in a fresh Debian: as root'
	@echo 'make install  programs, manual pages, headers and the rest to PREFIX ($(PREFIX)); make uninstall removes them again'
	@echo 'make package  set up and build Debian packages, in build/release/packages'
	@echo 'make experiments  set up, build, and run every shipped experiment in full, in both modes; a table of criteria and times'
	@echo 'make soak     random experiments with real processes until one fails or you stop it (SEED=N begins there)'
	@echo 'make bench    set up, build, measure; table on the terminal, figures in build/bench.json'
	@echo 'make fuzz     set up clang, build the fuzzers, run each for FUZZ_SECONDS ($(FUZZ_SECONDS)); what they find is in build/fuzz'
	@echo 'make docs     set up mkdocs, make the site of README, guide and docs in build/site'
	@echo 'make tables   set up, build, renew what guide and schema say of protocols, plants and metrics'
	@echo 'make build    set up and build the three programs only'
	@echo 'make format   format the sources in place'
	@echo 'make lint     check formatting, clang-tidy, cppcheck'
	@echo 'make hooks    from now on git commits only what is formatted and passes clang-tidy'
	@echo 'make clean    remove build/ (results/ stays)'
	@echo 'Variables: PRESET=release|debug|asan|tsan  JOBS=N  SETUP=no (install no packages)'

setup:
ifneq ($(SETUP),no)
	@deploy/setup.sh
ifneq ($(filter asan tsan,$(PRESET)),)
	@deploy/setup.sh --list deploy/packages-clang.txt
endif
endif

setup-tests: setup
ifneq ($(SETUP),no)
	@deploy/setup.sh --list deploy/packages-tests.txt
endif

configure: $(BUILD)/build.ninja

# Without tests, until somebody asks for them. Ninja itself configures again when a CMake file has changed.
$(BUILD)/build.ninja: | setup
	@cmake --preset $(PRESET) -DCONSORT_TESTS=OFF

configure-tests: setup-tests
	@grep -qs '^build core_tests: phony' $(BUILD)/build.ninja || cmake --preset $(PRESET) -DCONSORT_TESTS=ON

build: setup configure
	@cmake --build --preset $(PRESET) --parallel $(JOBS) --target consort consort-agent consort-plant

run: build
	@$(BUILD)/bin/consort run $(EXPERIMENT)

test: configure-tests
	@cmake --build --preset $(PRESET) --parallel $(JOBS)
	@ctest --preset $(PRESET) --parallel $(JOBS)

# Where root, namespaces or a program is missing, the tests say so and fail.
test-hosts: configure-tests
ifneq ($(SETUP),no)
	@deploy/setup.sh --list deploy/packages-hosts.txt
endif
	@cmake --build --preset $(PRESET) --parallel $(JOBS) --target hosts_tests
	@$(BUILD)/bin/hosts_tests --gtest_brief=1

# Where root, mmdebstrap or a network is missing, the tests say so and fail.
test-package: configure-tests setup-package
	@cmake --build --preset $(PRESET) --parallel $(JOBS) --target package_tests
	@$(BUILD)/bin/package_tests --gtest_brief=1

setup-package: setup
ifneq ($(SETUP),no)
	@deploy/setup.sh --list deploy/packages-package.txt
endif

install: build
	@cmake --install $(BUILD) --prefix '$(abspath $(PREFIX))' >$(BUILD)/install.log
	@echo 'installed in $(abspath $(PREFIX))'

uninstall:
	@cmake -P $(BUILD)/uninstall.cmake

package: build setup-package
	@cpack --config $(BUILD)/CPackConfig.cmake -B $(BUILD)/packages >$(BUILD)/package.log || { cat $(BUILD)/package.log; exit 1; }
	@rm -rf $(BUILD)/packages/_CPack_Packages
	@ls $(BUILD)/packages/*.deb

experiments: setup configure
	@cmake --build --preset $(PRESET) --parallel $(JOBS) --target experiments

# Random experiments, one seed after the other, until one fails or you have seen enough.
soak: configure-tests
	@cmake --build --preset $(PRESET) --parallel $(JOBS) --target swarm_tests
	@seed=$(or $(SEED),1001); while CONSORT_SWARM_SEED=$$seed $(BUILD)/bin/swarm_tests --gtest_brief=1; do \
	  echo "seed $$seed held"; seed=$$((seed + 1)); done; echo "seed $$seed failed"; exit 1

bench: configure-tests
	@cmake --build --preset $(PRESET) --parallel $(JOBS) --target bench

# Each fuzzer begins with the corpus in tests/fuzz and with valid inputs, and keeps what is new in build/fuzz. A failure ends it and names a
# file; that file belongs into the corpus, where the ordinary tests read it from then on.
fuzz: setup-tests
ifneq ($(SETUP),no)
	@deploy/setup.sh --list deploy/packages-clang.txt
endif
	@cmake --preset fuzz
	@cmake --build --preset fuzz --parallel $(JOBS)
	@build/fuzz/bin/fuzz_seeds build/fuzz/seeds
	@mkdir -p build/fuzz/wire build/fuzz/script build/fuzz/criterion build/fuzz/graph
	@cd build/fuzz && bin/fuzz_wire -max_total_time=$(FUZZ_SECONDS) -max_len=4096 wire seeds ../../tests/fuzz/corpus/wire
	@cd build/fuzz && bin/fuzz_script -max_total_time=$(FUZZ_SECONDS) -max_len=3000 -timeout=20 script ../../experiments ../../tests/fuzz/corpus/script
	@cd build/fuzz && bin/fuzz_criterion -max_total_time=$(FUZZ_SECONDS) -max_len=500 criterion ../../tests/fuzz/corpus/criterion
	@cd build/fuzz && bin/fuzz_graph -max_total_time=$(FUZZ_SECONDS) -max_len=3000 graph ../../tests/fuzz/corpus/graph

# The pages in the folders they lie in, with an index of the decisions; a link that leads nowhere fails.
docs:
ifneq ($(SETUP),no)
	@deploy/setup.sh --list deploy/packages-docs.txt
endif
	@rm -rf build/docs && mkdir -p build/docs
	@git ls-files --cached --others --exclude-standard '*.md' ':!.github' CITATION.cff docs experiments | xargs cp --parents -t build/docs
	@cd build/docs/docs/decisions && awk 'BEGIN {print "# Decisions\n"} FNR == 1 {sub(/^# [0-9]+\. /, ""); print "1. [" $$0 "](" FILENAME ")"}' \
	  0*.md >index.md
	@mkdocs build --quiet
	@echo 'build/site/index.html'

# What the tables of protocols, plants and metrics say, into the guide's pages and the schema.
tables: setup configure
	@cmake --build --preset $(PRESET) --parallel $(JOBS) --target consort
	@docs/renew-tables.sh $(BUILD)/bin/consort

format: setup-tests
	@$(SOURCES) | xargs clang-format -i

format-check: setup-tests
	@$(SOURCES) | xargs -n 16 -P $(JOBS) clang-format --dry-run --Werror

# clang-tidy looks through the product in batches, folder by folder, because most of what it reads are the headers that a folder's files have
# in common; the compile commands are those without GCC's precompiled headers. FILES='core/network/graph.cpp …' looks through these only.
LINT = build/lint
tidy: setup-tests
	@cmake --preset $(PRESET) -B $(LINT) -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DCMAKE_UNITY_BUILD=$(if $(FILES),OFF,ON) \
	  -DCONSORT_BATCHES=$(if $(FILES),OFF,ON) -DCONSORT_TESTS=OFF >/dev/null
	@cmake --build $(LINT) --parallel $(JOBS) --target consort_idl_generate
	@{ $(if $(FILES),echo $(FILES),find $(LINT)/CMakeFiles -name 'unity_*.cxx' | xargs grep -L '/$(LINT)/'; echo idl/card.cpp); } | \
	  xargs -n 1 -P $(JOBS) clang-tidy --quiet --warnings-as-errors='*' -p $(LINT) 2>/dev/null

cppcheck: setup-tests
	@cppcheck --quiet --error-exitcode=1 --std=c++20 --language=c++ -j $(JOBS) --enable=warning,performance,portability \
	  --inline-suppr --suppressions-list=deploy/cppcheck.txt -I . -I dds/include $$(git ls-files '*.cpp' ':!tests')

lint: format-check tidy cppcheck

hooks:
	@git config core.hooksPath deploy/hooks

clean:
	@rm -rf build
