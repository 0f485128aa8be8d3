# `make demo` renders the shading balls, `make test` passes the tests; both make what they need in .venv first.
PYTHON ?= python3
BIN := .venv/bin
# the suite starts hundreds of processes, each of which would compile every module again
unexport PYTHONDONTWRITEBYTECODE

# `tests` is also a folder
.PHONY: demo check test tests test-all test-gpu fuzz lint bench install clean docs book browser wheel audit packages

install: .venv/installed

.venv/installed: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit("Gonio needs Python 3.11 or newer, this is " + sys.version.split()[0]) if sys.version_info < (3, 11) else 0'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --no-compile --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@

# a checkout that is only looked at needs no test tools; modules are compiled when they are imported
.venv/rendering: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit("Gonio needs Python 3.11 or newer, this is " + sys.version.split()[0]) if sys.version_info < (3, 11) else 0'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --no-compile --quiet --disable-pip-version-check --editable .
	touch $@

# where the denoiser has no wheel (Linux on ARM), the demo shows its noise
DENOISE = $(shell $(BIN)/python -c 'import pyoidn' 2>/dev/null && echo --denoise)

demo: .venv/rendering
	@mkdir -p out
	$(BIN)/gonio bake ggx --lut E,Eavg,dfg -o out/tables
	$(BIN)/gonio render examples/shading-balls/print.json --spp 32 --size 1024x424 $(DENOISE) -o out/shading-balls.png
	$(BIN)/gonio render examples/white-furnace --spp 128 --exposure 0.9 $(DENOISE) -o out/white-furnace.png
	$(BIN)/gonio view --export out/shading-balls.html
	@printf '%s\n' '' 'The pictures and the page are in out. Next, in this shell:' '    . .venv/bin/activate' '    gonio view'

# the files of a reader who tries README here are the reader's own
OURS := benchmarks docs examples src tests tools
lint: .venv/installed
	$(BIN)/ruff check $(OURS)
	$(BIN)/ruff format --check $(OURS)
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python tools/words.py

# Shaders and the page are tested in a real browser: the one that is here, else Debian's, else Playwright's.
browser: .venv/installed
	@command -v chromium || command -v chromium-browser || command -v google-chrome \
	|| { test "$$(id -u)" = 0 && command -v apt-get >/dev/null \
	     && { apt-get install -y -qq chromium || { apt-get update -qq && apt-get install -y -qq chromium; }; }; } \
	|| $(BIN)/playwright install chromium \
	|| echo "NO BROWSER could be found or installed: tests in WebGL and WebGPU will be skipped, nothing is tried there" >&2

# three processes on two cores, each with files of its own: a browser, a server or a child is often waited for
PARALLEL := -n 3 --dist loadfile --no-loadscope-reorder --max-worker-restart 2

# formulas, tables, shader text, files and scenes, one case of each test, no long one: what one runs while editing
UNIT := tests/bridge tests/catalog tests/energy tests/materials tests/measure tests/ops tests/optics tests/shaders \
	tests/render/test_scene_build.py tests/render/test_scene_read.py tests/test_errors.py tests/test_imports.py
check: .venv/installed
	$(BIN)/python -m pytest $(PARALLEL) -m 'not slow and not browser and not long' --cases 1 $(UNIT)

# lint and types run beside the tests
test: .venv/installed browser
	@$(MAKE) --no-print-directory --keep-going --jobs 2 lint tests

tests: .venv/installed
	$(BIN)/python -m pytest $(PARALLEL) -m 'not slow'

test-all: .venv/installed browser lint
	$(BIN)/python -m pytest $(PARALLEL) -o faulthandler_timeout=1800

# The core of the suite on the CUDA variant. Where there is no GPU nothing is tried, which is said loudly, and fails.
GPU_TESTS := tests/render/test_integrators.py tests/render/test_adapter.py tests/render/test_run.py \
	tests/render/test_checkpoints.py tests/render/test_lights.py
test-gpu: .venv/installed
	@$(BIN)/python -c 'import sys; from gonio.bridge import engine; sys.exit(not engine.cuda_available())' \
	|| { echo "NO GPU: no NVIDIA driver with a device answers, so NOTHING WAS TESTED on CUDA" >&2; exit 1; }
	GONIO_TEST_DEVICE=cuda $(BIN)/python -m pytest -m 'not slow' $(GPU_TESTS)

# spoilt inputs for every reader; make fuzz COUNT=100000 TARGETS='exr ply'
COUNT ?= 2000
fuzz: .venv/installed
	$(BIN)/python tests/fuzz/run.py --count $(COUNT) $(TARGETS)

bench: .venv/installed
	$(BIN)/python benchmarks/startup.py
	$(BIN)/python benchmarks/bsdf.py
	$(BIN)/python benchmarks/render.py
	$(BIN)/python benchmarks/view.py

docs: .venv/installed
	$(BIN)/python docs/make_pages.py
	$(BIN)/python docs/make_options.py
	$(BIN)/python docs/make_scenes.py

# The book, in out/book/index.html, which opens from disk. Only pages whose sources changed are built again.
.venv/book: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit("Gonio needs Python 3.11 or newer, this is " + sys.version.split()[0]) if sys.version_info < (3, 11) else 0'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --no-compile --quiet --disable-pip-version-check --editable '.[book]'
	touch $@

book: .venv/book
	$(BIN)/python -m sphinx -q -b html -W --keep-going -d out/book-parts docs out/book
	@echo 'out/book/index.html'

# a wheel and a source archive, tried in empty environments outside the repository, and a bill of materials
wheel:
	$(PYTHON) tools/wheel.py

# the packages for npm, out/gonio-three-VERSION.tgz and out/gonio-wgpu-VERSION.tgz
packages:
	@command -v npm >/dev/null || { echo "NO npm: the packages in web/packages were NOT PACKED" >&2; exit 1; }
	@mkdir -p out
	cd web/packages/three && npm pack --pack-destination ../../../out
	cd web/packages/wgpu && npm pack --pack-destination ../../../out

# Known vulnerabilities of the installed packages. Needs the registry's own service, which a mirror may lack: a package
# that could not be looked up fails it, too.
audit: .venv/installed
	@mkdir -p out
	test -x out/audit/bin/pip-audit || { $(PYTHON) -m venv out/audit && out/audit/bin/python -m pip install --quiet pip-audit; }
	$(BIN)/python -m pip freeze --exclude-editable > out/requirements.txt
	out/audit/bin/pip-audit --strict --no-deps --disable-pip -r out/requirements.txt

clean:
	rm -rf .venv out build dist docs/reference docs/gallery docs/project
