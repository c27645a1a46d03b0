# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

# voxelpipe_join_sources(variable file source...): one source file, written to the build tree, that includes all of them,
# each in a namespace of its own, behind the headers that they include. Half of the time of a file goes into those headers
# and into the kernels that all files have. One that ends in .cpp includes .cpp of the same names in the place of .cu.
# A source may add to a named namespace of those headers, and include some under a condition.
function(voxelpipe_join_sources variable name)
  set(includes "")
  set(conditional "")
  set(text "")
  foreach(source IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${source}")
    file(STRINGS "${source}" lines REGEX "^#(include|define|if|ifdef|ifndef|elif|else|endif)")
    if(lines MATCHES "#if")
      list(JOIN lines "\n" lines)
      string(APPEND conditional "${lines}\n")
    else()
      list(APPEND includes ${lines})
    endif()
    cmake_path(GET source STEM stem)
    cmake_path(GET source FILENAME file)
    if(name MATCHES "\\.cpp$")
      string(REGEX REPLACE "\\.cu$" ".cpp" file "${file}")
    endif()
    set(body "#include \"${file}\"\n")
    file(STRINGS "${source}" namespaces REGEX "^namespace [a-z_:]+ {$")
    list(REMOVE_DUPLICATES namespaces)
    foreach(line IN LISTS namespaces)
      string(REGEX REPLACE "^namespace (.*) {$" "\\1" namespace "${line}")
      string(PREPEND body "${line} using namespace ::${namespace}; }\n")
      string(APPEND text "\n${line}}\n") # where no header has it
    endforeach()
    string(APPEND text "\nnamespace joined_${stem} {\n${body}}\n")
  endforeach()
  list(REMOVE_DUPLICATES includes)
  list(JOIN includes "\n" includes)
  set(joined "${CMAKE_CURRENT_BINARY_DIR}/${name}")
  file(CONFIGURE OUTPUT "${joined}" CONTENT "@includes@\n@conditional@@text@" @ONLY)
  set(${variable} "${joined}" PARENT_SCOPE)
endfunction()
