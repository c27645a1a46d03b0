# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs the component `c` into a prefix of its own and builds capi_test.c with it as users do: in a CMake project in C, which finds
# voxelpipe::c without GLM, and by the C compiler with what pkg-config says.
cmake_minimum_required(VERSION 3.24)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " line)
    message(FATAL_ERROR "failed (${result}): ${line}\n${output}")
  endif()
  string(STRIP "${output}" output)
  set(run_output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
set(prefix "${WORK_DIR}/prefix")
foreach(component IN ITEMS voxelpipe c)
  run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${prefix}" --component ${component})
endforeach()

file(WRITE "${WORK_DIR}/project/CMakeLists.txt" "
cmake_minimum_required(VERSION 3.24)
project(consumer LANGUAGES C)
find_package(voxelpipe 0.1 REQUIRED COMPONENTS c)
if(TARGET voxelpipe::voxelpipe)
  message(FATAL_ERROR \"more was found than was asked for\")
endif()
add_executable(consumer \"${CMAKE_CURRENT_LIST_DIR}/capi_test.c\")
target_link_libraries(consumer PRIVATE voxelpipe::c m)
")
run("${CMAKE_COMMAND}" -G "${GENERATOR}" -S "${WORK_DIR}/project" -B "${WORK_DIR}/build" "-DCMAKE_C_COMPILER=${C_COMPILER}"
    "-DCMAKE_PREFIX_PATH=${prefix}" -DCMAKE_DISABLE_FIND_PACKAGE_glm=ON)
run("${CMAKE_COMMAND}" --build "${WORK_DIR}/build")
run("${WORK_DIR}/build/consumer")
message(STATUS "find_package: ${run_output}")

find_program(pkg_config NAMES pkg-config pkgconf)
file(GLOB_RECURSE pc "${prefix}/voxelpipe.pc")
if(NOT pc)
  message(FATAL_ERROR "no voxelpipe.pc was installed")
endif()
if(NOT pkg_config)
  message(STATUS "not run: pkg-config (there is none)")
  return()
endif()
cmake_path(GET pc PARENT_PATH folder)
set(ENV{PKG_CONFIG_PATH} "${folder}")
run("${pkg_config}" --cflags --libs voxelpipe)
separate_arguments(flags UNIX_COMMAND "${run_output}")
run("${C_COMPILER}" -std=c99 "${CMAKE_CURRENT_LIST_DIR}/capi_test.c" ${flags} -lm -o "${WORK_DIR}/by_pkg_config")
run("${pkg_config}" --variable=libdir voxelpipe)
set(ENV{LD_LIBRARY_PATH} "${run_output}")
run("${WORK_DIR}/by_pkg_config")
message(STATUS "pkg-config: ${run_output}")
