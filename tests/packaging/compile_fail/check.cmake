# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake -DMODE=fails -DCASE=name -DCOMPILER=... -DINCLUDES=a|b -DPRELUDE=file.hpp -DSOURCE=cases.cpp -P check.cmake
# cmake -DMODE=control ... compiles all cases corrected. cmake -DMODE=prelude ... precompiles PRELUDE, with which the
# others then start.
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
  execute_process(COMMAND "${COMPILER}" -std=c++20 -fsyntax-only ${includes} -DALL=1 -include "${PRELUDE}" "${SOURCE}"
                  RESULT_VARIABLE result ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "the corrected programs have to compile, but:\n${output}")
  endif()
  return()
endif()

# The case's lines: its message behind the #if, then comments.
file(READ "${SOURCE}" text)
if(NOT text MATCHES "\n#if CASE_${CASE} [^\n]*// ([^\n]+)\n((// (max-errors|flags): [^\n]*\n)*)")
  message(FATAL_ERROR "${SOURCE} has no line `#if CASE_${CASE} || ALL // REGEX`")
endif()
set(expected "${CMAKE_MATCH_1}")
set(comments "${CMAKE_MATCH_2}")
set(max_errors 1)
if(comments MATCHES "// max-errors: ([0-9]+)")
  set(max_errors ${CMAKE_MATCH_1})
endif()
set(flags "")
if(comments MATCHES "// flags: ([^\n]+)")
  separate_arguments(flags UNIX_COMMAND "${CMAKE_MATCH_1}")
endif()

set(command "${COMPILER}" -std=c++20 -fsyntax-only -fno-diagnostics-color ${includes} ${flags} -DCASE_${CASE}=1)
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
