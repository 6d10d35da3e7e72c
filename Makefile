# The front door. `make run` and `make test` are enough; both install what is missing (Debian, Ubuntu; as root or with sudo).

PRESET ?= release
JOBS ?= $(shell nproc)
BUILD := build/$(PRESET)
VENV := build/venv
# What tools/install_dependencies put into build/venv comes first.
export PATH := $(CURDIR)/$(VENV)/bin:$(PATH)

.DEFAULT_GOAL := help
.PHONY: help run test test-extremes test-hosts build tools gallery site benchmark accuracy lint format install wheel test-wheel sdist clean distclean configure fpm-build fpm-run fpm-test

help: ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 16

run: ## Solve the rubber disk and draw its pictures (examples/rubber_disk)
	@tools/install_dependencies build run
	@$(MAKE) --no-print-directory configure compile
	FINSHELL_BIN=$(CURDIR)/build/bin/finshell $(VENV)/bin/python examples/rubber_disk/run.py

test: ## Build and run all tests
	@tools/install_dependencies build test
	@$(MAKE) --no-print-directory configure compile
	ctest --preset $(PRESET) -j $(JOBS)

test-extremes: ## All extremes: 100 000 random elements in quadruple precision, structures, damaged inputs; writes doc/extremes.md (ten minutes)
	@tools/install_dependencies build test
	@$(MAKE) --no-print-directory configure compile
	FINSHELL_PRECISION_BLOCKS=$${FINSHELL_PRECISION_BLOCKS:-400} FINSHELL_FUZZ=$${FINSHELL_FUZZ:-5000} ctest --preset $(PRESET) -R '^(precision|fuzz)\.|capi_fuzz' -V --timeout 3600
	FINSHELL_BIN=$(CURDIR)/build/bin/finshell FINSHELL_BINARY_DIR=$(CURDIR)/$(BUILD) FINSHELL_SOURCE_DIR=$(CURDIR) \
	  $(VENV)/bin/python test/extremes/test_extremes.py --all --page doc/extremes.md

# What is missing is an error here, while `make test` leaves it out. FINSHELL_DOLFINX_PYTHON: a Python that has dolfinx.
test-hosts: ## Solve the hemisphere and the rubber disk in DOLFINx and NGSolve, and install these (api/hosts, doc/hosts.md)
	@tools/install_dependencies build hosts
	@$(MAKE) --no-print-directory configure
	cmake --build --preset $(PRESET) -j $(JOBS) --target finshell_program finshell -- --quiet
	FINSHELL_HOSTS=required ctest --preset $(PRESET) -R '^hosts[.]test_mesh_hosts$$' --no-tests=error -V

build: ## Build everything: build/bin, build/lib
	@tools/install_dependencies build
	@$(MAKE) --no-print-directory configure compile

tools: ## Install finshell-plot, finshell-fit, finshell-mesh and Gmsh into build/venv
	@tools/install_dependencies tools
	@$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable api/python

gallery: build tools ## Run chosen examples and draw them by finshell-plot (build/site/gallery; two minutes)
	FINSHELL_BIN=$(CURDIR)/build/bin/finshell $(VENV)/bin/python doc/site/gallery.py build/site/gallery

site: ## The documentation site, build/site/html, with the pictures of `make gallery` where they are
	@tools/install_dependencies site
	$(VENV)/bin/python doc/site/assemble.py build/site/source build/site/gallery
	$(VENV)/bin/python -m sphinx --fail-on-warning --keep-going --quiet -b html -c doc/site build/site/source build/site/html
	@echo "build/site/html/index.html"

# ctest of a preset that was configured before needs nothing from here; PRESET=debug, quad, native select another one.
.PHONY: compile
configure:
	@cmake --preset $(PRESET) $(if $(wildcard $(VENV)/bin/python),-DFINSHELL_PYTHON=$(CURDIR)/$(VENV)/bin/python) --log-level=WARNING >/dev/null
compile:
	@[ -t 1 ] || quiet='-- --quiet'; cmake --build --preset $(PRESET) -j $(JOBS) $$quiet

benchmark: build ## Compare examples/ with their references (doc/benchmarks.md); run the programs of bench/
	FINSHELL_BIN=$(CURDIR)/build/bin/finshell python3 bench/benchmark.py
	@for program in build/bin/bench_kernel build/bin/bench_capi; do [ ! -x $$program ] || { echo "== $$program"; $$program || exit 1; }; done
	@[ ! -x build/bin/bench_explicit ] || { echo "== bench/explicit.py"; python3 bench/explicit.py --sample; }

accuracy: ## Error against CPU time: our presets on ladders of meshes, run anew, beside stored figures of other programs; writes doc/accuracy.md (ten minutes)
	@tools/install_dependencies build accuracy
	@$(MAKE) --no-print-directory configure compile
	FINSHELL_BIN=$(CURDIR)/build/bin/finshell $(VENV)/bin/python bench/accuracy.py

lint: ## Check style (fortitude) and indentation (findent)
	@tools/install_dependencies test
	@tools/lint

format: ## Indent all Fortran sources
	@tools/install_dependencies test
	@tools/indent --write

install: build ## Install under PREFIX (default /usr/local)
	cmake --install $(BUILD) --prefix $(or $(PREFIX),/usr/local)

wheel: ## dist/finshell-*.whl: library, program, Python package and all they need, nothing under the GPL; SUITESPARSE=1: the other one
	@tools/install_dependencies build
	@tools/build_wheel $(if $(SUITESPARSE),--suitesparse)

test-wheel: ## Install the newest wheel of dist/ in a bare environment and use it
	@tools/test_wheel

sdist: ## dist/finshell-*.tar.gz, for `pip install` where compilers and libraries are
	@tools/build_wheel --sdist

# fpm: plain `fpm build`, `fpm run`, `fpm test` work too; these add the machine's optimisation flags (tools/fpm).
fpm-build: ## Build with fpm
	@tools/install_dependencies build test
	tools/fpm build

fpm-run: ## Run the driver with fpm; ARGS="run input.nml"
	@tools/install_dependencies build test
	tools/fpm run -- $(ARGS)

fpm-test: ## Run the .pf tests with fpm
	@tools/install_dependencies build test
	tools/fpm test

clean: ## Remove what was built (keeps build/venv)
	rm -rf build/release build/library build/native build/debug build/quad build/bin build/lib build/fpm-tests build/gfortran_* build/cache.toml

distclean: ## Remove the whole build folder
	rm -rf build
