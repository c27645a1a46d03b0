# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

# voxelpipe_own_target(target...): the warnings that our own code is held to. Never put on an INTERFACE target, so that
# no user inherits them.
# nvcc hands the host compiler C++ that it wrote itself, with parentheses of its own around declarators.
function(voxelpipe_own_target)
  foreach(target IN LISTS ARGN)
    target_compile_options(
      ${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-Wall;-Wextra;-Wpedantic;-Wconversion>
                        $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-Wall,-Wextra,-Wno-parentheses>
                        # GLM 0.9.9, of files that include it before the library, which knows how not to be warned
                        $<$<COMPILE_LANGUAGE:CUDA>:-diag-suppress=20012>
                        $<$<AND:$<COMPILE_LANGUAGE:CUDA>,$<STREQUAL:$<TARGET_PROPERTY:CUDA_ARCHITECTURES>,OFF>>:${VOXELPIPE_CUDA_CODE};${VOXELPIPE_CUDA_HOST_OPTIONS}>)
    if(VOXELPIPE_WERROR)
      target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-Werror>
                                               $<$<COMPILE_LANGUAGE:CUDA>:-Werror=all-warnings>)
    endif()
  endforeach()
endfunction()

# voxelpipe_hot_target(target...): code that is quick to compile and works long in tests: see VOXELPIPE_HOT_OPTIONS.
function(voxelpipe_hot_target)
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE ${VOXELPIPE_HOT_OPTIONS})
    if(VOXELPIPE_HOT_OPTIONS)
      set_target_properties(${target} PROPERTIES DISABLE_PRECOMPILE_HEADERS ON) # precompiled without these options
    endif()
  endforeach()
endfunction()

# voxelpipe_tool_library(target...): a library of the tool's. With VOXELPIPE_JOIN_FILES its files are compiled as one, but
# those with options of their own; VOXELPIPE_TOOL_OPTIONS is for builds whose models are small.
function(voxelpipe_tool_library)
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:${VOXELPIPE_TOOL_OPTIONS}>)
    if(VOXELPIPE_JOIN_FILES)
      set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)
      # g++ gives this warning for what is not the main file, where another might include it.
      target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)
    endif()
  endforeach()
endfunction()
