# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Two commands for a person, two for the maintainers. The scripts do the work and say what they do.
#
#   make demo [MODEL=file.glb] [RESOLUTION=256]   a model (glTF, OBJ, STL, PLY, ...) becomes voxels, files and a picture in demo/
#   make test                                     builds everything and runs the tests
#   make docs                                     the site, in build/docs/html
#   make dist                                     the source archive, in build/dist
#   make wheels                                   wheels of the Python package that need no compiler, in build/wheels/dist
#   make windows                                  the tool and the C API for Windows: build/windows/tool/voxelize.exe, capi/voxelpipe.dll
#   make page                                     a page that converts models in the browser, build/page/voxelize.html
#   make blender                                  the Blender add-on with those wheels, in build/blender
#   make release                                  all that a release holds, in build/release
#   make bench                                    the CPU table
#   make bench-gpu                                the GPU table (needs nvcc and a GPU); make bench-scaling: its curves
#   make clean                                    removes build/ and demo/

MODEL ?=
RESOLUTION ?= 256

.PHONY: demo test docs dist wheels windows page blender release bench bench-gpu bench-scaling bench-tune clean
.DEFAULT_GOAL := demo

demo:
	@scripts/demo.sh "$(RESOLUTION)" "$(MODEL)"

test:
	@scripts/test.sh

docs:
	@scripts/docs.sh

dist:
	@scripts/dist.sh

wheels:
	@scripts/wheels.sh

windows:
	@scripts/windows.sh

page:
	@scripts/page.sh

blender:
	@scripts/blender.sh

release:
	@scripts/release.sh

bench:
	@scripts/bench.sh

bench-gpu:
	@scripts/bench.sh --gpu

bench-scaling:
	@scripts/bench.sh --scaling

bench-tune:
	@scripts/bench.sh --tune

clean:
	rm -rf build demo
