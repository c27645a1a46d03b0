# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# 64-bit ARM under Linux by Debian's cross compiler (g++-aarch64-linux-gnu). Programs are static, so that qemu-aarch64-static
# runs them without the libraries of that machine. Packages of this machine are not looked at: scripts/stage_deps.sh gives the
# headers.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
find_program(voxelpipe_qemu NAMES qemu-aarch64-static qemu-aarch64)
if(voxelpipe_qemu)
  set(CMAKE_CROSSCOMPILING_EMULATOR "${voxelpipe_qemu}")
endif()
set(CMAKE_FIND_ROOT_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.deps")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
