# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
if(TARGET voxelize_gltf)
  voxelpipe_add_fuzz(fuzz_gltf "${CMAKE_CURRENT_LIST_DIR}/fuzz_gltf.cpp" LIBS voxelize_gltf)

  # The same code as a plain program for any compiler: runs every file of the corpus once, and repeats a finding.
  add_executable(replay_gltf "${CMAKE_CURRENT_LIST_DIR}/fuzz_gltf.cpp")
  target_link_libraries(replay_gltf PRIVATE voxelize_gltf)
  target_compile_definitions(replay_gltf PRIVATE VOXELPIPE_FUZZ_REPLAY)
  voxelpipe_own_target(replay_gltf)
  set(replayed "${CMAKE_CURRENT_LIST_DIR}/corpus/fuzz_gltf")
  if(VOXELPIPE_GLTF_DIR)
    list(APPEND replayed "${VOXELPIPE_GLTF_DIR}")
  endif()
  add_test(NAME fuzz_gltf.replay COMMAND replay_gltf ${replayed})
  set_tests_properties(fuzz_gltf.replay PROPERTIES LABELS "fuzz" TIMEOUT 300)
endif()
