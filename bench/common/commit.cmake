# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake -DSOURCE=... -DOUTPUT=... -P commit.cmake: writes the commit of SOURCE as a header, where it changed. Run by every
# build, so that a program that is carried to another machine still knows what it was built from.
cmake_minimum_required(VERSION 3.24)
set(commit unknown)
find_package(Git QUIET)
if(GIT_FOUND)
  execute_process(
    COMMAND "${GIT_EXECUTABLE}" -C "${SOURCE}" describe --always --abbrev=12 --dirty --exclude=*
    OUTPUT_VARIABLE found
    RESULT_VARIABLE result
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(result EQUAL 0)
    set(commit "${found}")
  endif()
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT "#define VOXELPIPE_BENCH_COMMIT \"${commit}\"\n" @ONLY)
