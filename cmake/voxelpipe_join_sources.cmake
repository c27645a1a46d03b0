# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

# voxelpipe_join_sources(variable file source...): one source file, written to the build tree, that includes all of them,
# each in a namespace of its own, behind the headers that they include. Half of the time of a file goes into those headers
# and into the kernels that all files have. One that ends in .cpp includes .cpp of the same names in the place of .cu.
function(voxelpipe_join_sources variable name)
  set(includes "")
  set(text "")
  foreach(source IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${source}")
    file(STRINGS "${source}" lines REGEX "^#(include|define) ")
    list(APPEND includes ${lines})
    cmake_path(GET source STEM stem)
    cmake_path(GET source FILENAME file)
    if(name MATCHES "\\.cpp$")
      string(REGEX REPLACE "\\.cu$" ".cpp" file "${file}")
    endif()
    string(APPEND text "\nnamespace joined_${stem} {\n#include \"${file}\"\n}\n")
  endforeach()
  list(REMOVE_DUPLICATES includes)
  list(JOIN includes "\n" includes)
  set(joined "${CMAKE_CURRENT_BINARY_DIR}/${name}")
  file(CONFIGURE OUTPUT "${joined}" CONTENT "@includes@\n@text@" @ONLY)
  set(${variable} "${joined}" PARENT_SCOPE)
endfunction()
