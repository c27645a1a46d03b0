# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
if(TARGET voxelpipe_read)
  voxelpipe_add_fuzz(fuzz_obj "${CMAKE_CURRENT_LIST_DIR}/fuzz_obj.cpp" LIBS voxelpipe_read)

  add_executable(replay_obj "${CMAKE_CURRENT_LIST_DIR}/fuzz_obj.cpp")
  target_link_libraries(replay_obj PRIVATE voxelpipe_read)
  target_compile_definitions(replay_obj PRIVATE VOXELPIPE_FUZZ_REPLAY)
  voxelpipe_own_target(replay_obj)
  add_test(NAME fuzz_obj.replay COMMAND replay_obj "${CMAKE_CURRENT_LIST_DIR}/corpus/fuzz_obj")
  set_tests_properties(fuzz_obj.replay PROPERTIES LABELS "fuzz" TIMEOUT 300)
endif()
