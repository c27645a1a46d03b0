# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# voxelpipe_dependency(NAME...): makes a third-party library available, installed packages first, otherwise fetched at a
# pinned version. Names and the targets that they give:
#   glm        glm::glm                      with threads the only one that users of the library need
#   threads    Threads::Threads
#   tinygltf   voxelpipe_deps::tinygltf      headers (tiny_gltf.h, nlohmann/json.hpp, stb_image.h); define
#                                            TINYGLTF_IMPLEMENTATION in one source file
#   json       nlohmann_json::nlohmann_json
#   stb        voxelpipe_deps::stb           headers (stb_image.h, stb_image_write.h)
#   cli11      CLI11::CLI11
#   gtest      GTest::gtest GTest::gtest_main
#   benchmark  benchmark::benchmark
include_guard(GLOBAL)
include(FetchContent)

FetchContent_Declare(
  glm
  GIT_REPOSITORY https://github.com/g-truc/glm.git
  GIT_TAG 1.0.1
  GIT_SHALLOW ON
  SYSTEM
  FIND_PACKAGE_ARGS)
FetchContent_Declare(
  tinygltf
  GIT_REPOSITORY https://github.com/syoyo/tinygltf.git
  GIT_TAG v2.8.21
  GIT_SHALLOW ON)
FetchContent_Declare(
  nlohmann_json
  GIT_REPOSITORY https://github.com/nlohmann/json.git
  GIT_TAG v3.11.3
  GIT_SHALLOW ON
  SYSTEM
  FIND_PACKAGE_ARGS)
FetchContent_Declare(
  stb
  GIT_REPOSITORY https://github.com/nothings/stb.git
  GIT_TAG 5736b15f7ea0ffb08dd38af21067c314d6a3aae9)
FetchContent_Declare(
  CLI11
  GIT_REPOSITORY https://github.com/CLIUtils/CLI11.git
  GIT_TAG v2.4.2
  GIT_SHALLOW ON
  SYSTEM
  FIND_PACKAGE_ARGS)
FetchContent_Declare(
  googletest
  GIT_REPOSITORY https://github.com/google/googletest.git
  GIT_TAG v1.14.0
  GIT_SHALLOW ON
  SYSTEM
  FIND_PACKAGE_ARGS NAMES GTest)
FetchContent_Declare(
  benchmark
  GIT_REPOSITORY https://github.com/google/benchmark.git
  GIT_TAG v1.8.3
  GIT_SHALLOW ON
  SYSTEM
  FIND_PACKAGE_ARGS)

# A library of plain headers without a config file: look for `header`, fetch the declared content where it is missing.
function(voxelpipe_header_dependency target content header)
  if(TARGET ${target})
    return()
  endif()
  find_path(VOXELPIPE_${content}_INCLUDE_DIR ${header} PATH_SUFFIXES ${ARGN})
  mark_as_advanced(VOXELPIPE_${content}_INCLUDE_DIR)
  set(folder "${VOXELPIPE_${content}_INCLUDE_DIR}")
  if(NOT folder)
    FetchContent_GetProperties(${content})
    if(NOT ${content}_POPULATED)
      # Only the headers are wanted, not the content's own CMakeLists.txt.
      FetchContent_Populate(${content})
    endif()
    set(folder "${${content}_SOURCE_DIR}")
  endif()
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  set_property(TARGET ${target} PROPERTY INTERFACE_INCLUDE_DIRECTORIES "${folder}")
endfunction()

# An installed GLM, else that of a source archive (scripts/dist.sh), else a fetched one.
macro(voxelpipe_glm_dependency)
  if(NOT TARGET glm::glm)
    find_package(glm QUIET)
    if(glm_FOUND)
      include(voxelpipe_glm)
    elseif(EXISTS "${PROJECT_SOURCE_DIR}/third_party/glm/glm/glm.hpp")
      add_library(glm::glm INTERFACE IMPORTED GLOBAL)
      set_target_properties(glm::glm PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${PROJECT_SOURCE_DIR}/third_party/glm")
    else()
      message(STATUS "GLM is not installed (Debian and Ubuntu: libglm-dev), so it is fetched, which needs git and a network")
      FetchContent_MakeAvailable(glm)
      include(voxelpipe_glm)
    endif()
  endif()
endmacro()

macro(voxelpipe_dependency)
  foreach(voxelpipe_name IN ITEMS ${ARGN})
    # Imported targets are seen everywhere: by sibling folders, and by a parent project that links ours.
    set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)
    if(voxelpipe_name STREQUAL "glm")
      voxelpipe_glm_dependency()
    elseif(voxelpipe_name STREQUAL "threads")
      set(THREADS_PREFER_PTHREAD_FLAG ON)
      find_package(Threads REQUIRED)
    elseif(voxelpipe_name STREQUAL "json")
      if(NOT TARGET nlohmann_json::nlohmann_json)
        FetchContent_MakeAvailable(nlohmann_json)
      endif()
    elseif(voxelpipe_name STREQUAL "stb")
      voxelpipe_header_dependency(voxelpipe_deps::stb stb stb_image.h stb)
    elseif(voxelpipe_name STREQUAL "tinygltf")
      voxelpipe_dependency(json stb)
      voxelpipe_header_dependency(voxelpipe_deps::tinygltf tinygltf tiny_gltf.h)
      set_property(TARGET voxelpipe_deps::tinygltf PROPERTY INTERFACE_LINK_LIBRARIES nlohmann_json::nlohmann_json
                                                            voxelpipe_deps::stb)
    elseif(voxelpipe_name STREQUAL "cli11")
      if(NOT TARGET CLI11::CLI11)
        FetchContent_MakeAvailable(CLI11)
      endif()
    elseif(voxelpipe_name STREQUAL "gtest")
      if(NOT TARGET GTest::gtest_main)
        set(INSTALL_GTEST OFF)
        FetchContent_MakeAvailable(googletest)
      endif()
    elseif(voxelpipe_name STREQUAL "benchmark")
      if(NOT TARGET benchmark::benchmark)
        set(BENCHMARK_ENABLE_TESTING OFF)
        set(BENCHMARK_ENABLE_INSTALL OFF)
        FetchContent_MakeAvailable(benchmark)
      endif()
    else()
      message(FATAL_ERROR "voxelpipe_dependency: unknown name ${voxelpipe_name}")
    endif()
  endforeach()
  unset(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL)
endmacro()
