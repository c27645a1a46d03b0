# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Builds and runs consumer/ in one WAY:
#   find_package   cmake --install into a prefix of its own, find_package(voxelpipe) from there
#   no_nvcc        the same, with no CUDA compiler to be found, and a configure of the project itself without one
#   bare_compiler  the same prefix, one compiler call and no CMake
#   fetch_content  FetchContent of the source tree as a subproject
#   amalgamated    ../amalgamated/program.cpp with one header that scripts/amalgamate.py writes, and with the library: the same output
# find_package builds with optimisation; the others, where finding, compiling and linking is all there is to see, without.
cmake_minimum_required(VERSION 3.24)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " line)
    message(FATAL_ERROR "failed (${result}): ${line}\n${output}")
  endif()
  set(run_output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
file(MAKE_DIRECTORY "${WORK_DIR}")
set(prefix "${WORK_DIR}/prefix")
set(build "${WORK_DIR}/build")
set(consumer "${CMAKE_CURRENT_LIST_DIR}/consumer")

if(WAY STREQUAL "amalgamated")
  string(REPLACE "|" ";" includes "${INCLUDES}")
  list(TRANSFORM includes PREPEND "-I")
  separate_arguments(flags UNIX_COMMAND "${CXX_FLAGS}")
  set(compile "${CXX_COMPILER}" -std=c++20 ${flags} -Wall -Wextra -Werror)
  run("${SOURCE_DIR}/scripts/amalgamate.py" --out "${WORK_DIR}/voxelpipe_cpu.hpp")
  # Alone, and beside another unit of the same program.
  file(WRITE "${WORK_DIR}/alone.cpp" "#include \"voxelpipe_cpu.hpp\"\n#include \"voxelpipe_cpu.hpp\"\n")
  set(program "${CMAKE_CURRENT_LIST_DIR}/../amalgamated/program.cpp")
  run(${compile} ${includes} "-I${WORK_DIR}" "-DVOXELPIPE_HEADER=<voxelpipe_cpu.hpp>" "${program}" "${WORK_DIR}/alone.cpp" -pthread -o
      "${WORK_DIR}/amalgamated")
  run(${compile} ${includes} "-I${SOURCE_DIR}" "-DVOXELPIPE_HEADER=<cpu_ref/backend.hpp>" "${program}" -pthread -o "${WORK_DIR}/library")
  run("${WORK_DIR}/amalgamated")
  set(amalgamated "${run_output}")
  run("${WORK_DIR}/library")
  if(NOT run_output STREQUAL amalgamated OR NOT run_output MATCHES "solid: ok")
    message(FATAL_ERROR "the amalgamated header gives\n${amalgamated}and the library\n${run_output}")
  endif()
  message(STATUS "both give\n${run_output}")
  return()
endif()

if(NOT WAY STREQUAL "fetch_content")
  run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${prefix}" --component voxelpipe)
  file(GLOB installed RELATIVE "${prefix}/include" "${prefix}/include/*")
  if(NOT installed STREQUAL "voxelpipe")
    message(FATAL_ERROR "only voxelpipe belongs in include/, not: ${installed}")
  endif()
endif()

if(WAY STREQUAL "bare_compiler")
  string(REPLACE "|" ";" includes "${INCLUDES}")
  list(TRANSFORM includes PREPEND "-I")
  separate_arguments(flags UNIX_COMMAND "${CXX_FLAGS}")
  run("${CXX_COMPILER}" -std=c++20 ${flags} "-I${prefix}/include/voxelpipe" ${includes} "${consumer}/main.cpp"
      "${consumer}/second_unit.cpp" -pthread -o "${WORK_DIR}/consumer")
  run("${WORK_DIR}/consumer")
  return()
endif()

# Not exported to the consumer: what the parent's environment sets for CUDA.
set(environment "${CMAKE_COMMAND}" -E env)
if(WAY STREQUAL "no_nvcc")
  list(APPEND environment --unset=CUDACXX --unset=CUDA_PATH --unset=CUDA_HOME PATH=/usr/bin:/bin)
endif()
set(build_type Debug)
if(WAY STREQUAL "find_package")
  set(build_type Release)
endif()
set(configure ${environment} "${CMAKE_COMMAND}" -G "${GENERATOR}" "-DCMAKE_CXX_COMPILER=${CXX_COMPILER}"
              "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}" "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}" -DCMAKE_BUILD_TYPE=${build_type}
              "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG") # forced inlining needs no more

if(WAY STREQUAL "fetch_content")
  run(${configure} -S "${consumer}" -B "${build}" -DCONSUMER_USES=FetchContent
      "-DFETCHCONTENT_SOURCE_DIR_VOXELPIPE=${SOURCE_DIR}" "-DCMAKE_PREFIX_PATH=${PREFIX_PATH}")
  # A subproject brings its library alone: no tests, no tool, no install rules.
  file(STRINGS "${build}/CMakeCache.txt" built REGEX "^VOXELPIPE_(BUILD_TESTS|BUILD_SAMPLES|BUILD_BENCH|BUILD_CUDA_KERNELS|INSTALL):.*=ON$")
  if(built)
    message(FATAL_ERROR "a subproject must not build: ${built}")
  endif()
else()
  run(${configure} -S "${consumer}" -B "${build}" -DCONSUMER_USES=find_package
      "-DCMAKE_PREFIX_PATH=${prefix};${PREFIX_PATH}")
endif()
if(WAY STREQUAL "no_nvcc")
  # AUTO in a place where nvcc cannot be found.
  run(${configure} -S "${SOURCE_DIR}" -B "${WORK_DIR}/project" -DVOXELPIPE_ENABLE_CUDA=AUTO
      "-DCMAKE_PREFIX_PATH=${PREFIX_PATH}")
  if(NOT run_output MATCHES "CUDA OFF")
    message(FATAL_ERROR "CUDA should be off where there is no nvcc:\n${run_output}")
  endif()
  # Nobody asked for more than what is installed.
  file(STRINGS "${WORK_DIR}/project/CMakeCache.txt" built REGEX "^VOXELPIPE_BUILD_(TESTS|SAMPLES|BENCH|FUZZ):.*=ON$")
  if(built)
    message(FATAL_ERROR "a plain configuration must not build: ${built}")
  endif()
endif()
if(WAY STREQUAL "find_package" AND EXISTS "${BUILD_DIR}/tool/voxelize")
  run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${prefix}" --component tool)
  run("${prefix}/bin/voxelize" --version)
endif()
run(${environment} "${CMAKE_COMMAND}" --build "${build}")
run("${build}/consumer")
message(STATUS "${run_output}")
run("${build}/consumer_io" "${WORK_DIR}/mask.nvdb")
if(WAY STREQUAL "find_package")
  # A component that nobody knows ends the configuration, and its name is said.
  execute_process(
    COMMAND ${configure} -S "${consumer}" -B "${build}" -DCONSUMER_USES=find_package -DCONSUMER_ASKS=teapot
            "-DCMAKE_PREFIX_PATH=${prefix};${PREFIX_PATH}"
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(result EQUAL 0 OR NOT output MATCHES "teapot")
    message(FATAL_ERROR "a component that does not exist was found:\n${output}")
  endif()
endif()
