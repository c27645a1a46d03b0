# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# Windows on x86-64 by MinGW-w64 (Debian: g++-mingw-w64-x86-64-posix, whose std::thread works). Programs are static: one file
# without a library beside it, which wine64 runs. Packages of this machine are not looked at: scripts/windows.sh gives headers and
# libraries.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR AMD64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
# A stack as on Linux, and the same file of the same objects.
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static -Wl,--stack,8388608 -Wl,--no-insert-timestamp")
set(CMAKE_CXX_FLAGS_INIT -Wa,-mbig-obj) # objects of many templates
find_program(voxelpipe_wine NAMES wine64 wine)
if(voxelpipe_wine)
  set(CMAKE_CROSSCOMPILING_EMULATOR "${voxelpipe_wine}")
endif()
set(CMAKE_FIND_ROOT_PATH "${CMAKE_CURRENT_LIST_DIR}/../../build/windows_libraries/prefix")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
