# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
if(TARGET voxelize_deps_assimp)
  voxelpipe_add_fuzz(fuzz_assimp "${CMAKE_CURRENT_LIST_DIR}/fuzz_assimp.cpp" LIBS voxelize_assimp)

  add_executable(replay_assimp "${CMAKE_CURRENT_LIST_DIR}/fuzz_assimp.cpp")
  target_link_libraries(replay_assimp PRIVATE voxelize_assimp)
  target_compile_definitions(replay_assimp PRIVATE VOXELPIPE_FUZZ_REPLAY)
  voxelpipe_own_target(replay_assimp)
  add_test(NAME fuzz_assimp.replay COMMAND replay_assimp "${CMAKE_CURRENT_LIST_DIR}/corpus/fuzz_assimp")
  set_tests_properties(fuzz_assimp.replay PROPERTIES LABELS "fuzz" TIMEOUT 300)
endif()
