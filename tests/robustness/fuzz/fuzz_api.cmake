# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
if(TARGET voxelpipe_oracle)
  voxelpipe_add_fuzz(fuzz_api "${CMAKE_CURRENT_LIST_DIR}/fuzz_api.cpp" LIBS voxelpipe_oracle)

  # The same code as a plain program for any compiler: runs the corpus and pseudo-random inputs, and repeats a finding.
  add_executable(replay_api "${CMAKE_CURRENT_LIST_DIR}/fuzz_api.cpp")
  target_link_libraries(replay_api PRIVATE voxelpipe::cpu_ref voxelpipe_oracle)
  target_compile_definitions(replay_api PRIVATE VOXELPIPE_FUZZ_REPLAY)
  voxelpipe_own_target(replay_api)
  voxelpipe_light_test(replay_api)
  add_test(NAME fuzz_api.replay COMMAND replay_api "${CMAKE_CURRENT_LIST_DIR}/corpus/fuzz_api")
  add_test(NAME fuzz_api.random COMMAND replay_api)
  # An empty corpus must fail.
  set(no_corpus "${CMAKE_CURRENT_BINARY_DIR}/no_corpus")
  file(MAKE_DIRECTORY "${no_corpus}")
  add_test(NAME fuzz_api.replay_of_nothing COMMAND replay_api "${no_corpus}")
  set_tests_properties(fuzz_api.replay_of_nothing PROPERTIES WILL_FAIL ON)
  set_tests_properties(fuzz_api.replay fuzz_api.random fuzz_api.replay_of_nothing PROPERTIES LABELS "fuzz" TIMEOUT 300)
endif()
