# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
if(TARGET voxelpipe_read)
  # One target for each format, so that none takes the time of another.
  foreach(format IN ITEMS ply stl off)
    voxelpipe_add_fuzz(fuzz_${format} "${CMAKE_CURRENT_LIST_DIR}/fuzz_meshes.cpp" LIBS voxelpipe_read)
    if(TARGET fuzz_${format})
      target_compile_definitions(fuzz_${format} PRIVATE VOXELPIPE_FUZZ_FORMAT="${format}")
    endif()

    add_executable(replay_${format} "${CMAKE_CURRENT_LIST_DIR}/fuzz_meshes.cpp")
    target_link_libraries(replay_${format} PRIVATE voxelpipe_read)
    target_compile_definitions(replay_${format} PRIVATE VOXELPIPE_FUZZ_FORMAT="${format}" VOXELPIPE_FUZZ_REPLAY)
    voxelpipe_own_target(replay_${format})
    add_test(NAME fuzz_${format}.replay COMMAND replay_${format} "${CMAKE_CURRENT_LIST_DIR}/corpus/fuzz_${format}")
    set_tests_properties(fuzz_${format}.replay PROPERTIES LABELS "fuzz" TIMEOUT 300)
  endforeach()
endif()
