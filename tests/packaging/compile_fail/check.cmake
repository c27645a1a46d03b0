# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake -DMODE=fails|control -DCOMPILER=... -DINCLUDES=a|b -DPRELUDE=file.hpp -DSOURCE=file.cpp -P check.cmake
# cmake -DMODE=prelude ... precompiles PRELUDE, with which the others then start.
cmake_minimum_required(VERSION 3.24)

string(REPLACE "|" ";" includes "${INCLUDES}")
list(REMOVE_DUPLICATES includes)
list(TRANSFORM includes PREPEND "-I")
# Localised compilers translate `error:`.
set(ENV{LC_ALL} C)

if(MODE STREQUAL "prelude")
  execute_process(COMMAND "${COMPILER}" -std=c++20 ${includes} -x c++-header "${PRELUDE}" -o "${PRELUDE}.gch"
                  RESULT_VARIABLE result ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "the library's headers have to compile, but:\n${output}")
  endif()
  return()
endif()

if(MODE STREQUAL "control")
  execute_process(COMMAND "${COMPILER}" -std=c++20 -fsyntax-only ${includes} -DVOXELPIPE_CONTROL -include "${PRELUDE}" "${SOURCE}"
                  RESULT_VARIABLE result ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "the corrected programs have to compile, but:\n${output}")
  endif()
  return()
endif()

file(STRINGS "${SOURCE}" header LIMIT_COUNT 12)
set(expected "")
set(max_errors 1)
set(flags "")
foreach(line IN LISTS header)
  if(line MATCHES "^// expect: (.+)$")
    set(expected "${CMAKE_MATCH_1}")
  elseif(line MATCHES "^// max-errors: ([0-9]+)")
    set(max_errors ${CMAKE_MATCH_1})
  elseif(line MATCHES "^// flags: (.+)$")
    separate_arguments(flags UNIX_COMMAND "${CMAKE_MATCH_1}")
  endif()
endforeach()
if(expected STREQUAL "")
  message(FATAL_ERROR "${SOURCE} has no line `// expect: REGEX`")
endif()

set(command "${COMPILER}" -std=c++20 -fsyntax-only -fno-diagnostics-color ${includes} ${flags})
# Other flags make a precompiled header useless, and clang refuse it.
if(flags STREQUAL "")
  list(APPEND command -include "${PRELUDE}")
endif()
execute_process(COMMAND ${command} "${SOURCE}" RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)

if(result EQUAL 0)
  message(FATAL_ERROR "the program must not compile, but it does")
endif()

# One list element a line: brackets and semicolons in the compiler's text would join or split elements.
string(REGEX REPLACE "[][;]" "," lines "${output}")
string(REPLACE "\n" ";" lines "${lines}")
list(FILTER lines INCLUDE REGEX "error:")
list(LENGTH lines num_errors)
if(num_errors EQUAL 0)
  message(FATAL_ERROR "the compiler failed without an error line:\n${output}")
endif()
list(GET lines 0 first)
if(NOT first MATCHES "${expected}")
  message(FATAL_ERROR "the first error does not match `${expected}`:\n${first}\n\nall output:\n${output}")
endif()
if(num_errors GREATER max_errors)
  list(JOIN lines "\n" lines)
  message(FATAL_ERROR "${num_errors} errors for one mistake (at most ${max_errors} allowed):\n${lines}")
endif()
message(STATUS "${first}")
