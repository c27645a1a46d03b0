# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Two commands for a person, two for the maintainers. The scripts do the work and say what they do.
#
#   make demo [MODEL=file.glb] [RESOLUTION=256]   a glTF model becomes voxels, files and a picture in demo/
#   make test                                     builds everything and runs all tests
#   make bench                                    the CPU table
#   make clean                                    removes build/ and demo/

MODEL ?=
RESOLUTION ?= 256

.PHONY: demo test bench clean
.DEFAULT_GOAL := demo

demo:
	@scripts/demo.sh "$(RESOLUTION)" "$(MODEL)"

test:
	@scripts/test.sh

bench:
	@scripts/bench.sh

clean:
	rm -rf build demo
