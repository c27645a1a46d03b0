# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
#
# WebAssembly by the compiler that scripts/page.sh puts into VOXELPIPE_PAGE_TOOLS: WASI's system calls, exceptions, one thread.
# std::thread is there and starts none, so loops run where they are called.
set(CMAKE_SYSTEM_NAME WASI)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
list(APPEND CMAKE_MODULE_PATH "${CMAKE_CURRENT_LIST_DIR}")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES VOXELPIPE_PAGE_TOOLS)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_COMPILER "${VOXELPIPE_PAGE_TOOLS}/bin/clang")
set(CMAKE_CXX_COMPILER "${VOXELPIPE_PAGE_TOOLS}/bin/clang++")
set(CMAKE_ASM_COMPILER "${VOXELPIPE_PAGE_TOOLS}/bin/clang")
set(CMAKE_AR "${VOXELPIPE_PAGE_TOOLS}/bin/ar" CACHE FILEPATH "")
set(CMAKE_RANLIB "${VOXELPIPE_PAGE_TOOLS}/bin/ranlib" CACHE FILEPATH "")
set(CMAKE_FIND_ROOT_PATH "${VOXELPIPE_PAGE_TOOLS}/prefix")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(page_libc "${VOXELPIPE_PAGE_TOOLS}/libc")
set(CMAKE_EXE_LINKER_FLAGS_INIT
    "--no-wasm-opt -nostdlib ${page_libc}/crt1-command.o -Wl,--stack-first -Wl,-z,stack-size=8388608 -Wl,--max-memory=4294967296 -Wl,--gc-sections -Wl,--strip-all")
set(CMAKE_CXX_STANDARD_LIBRARIES
    "${VOXELPIPE_PAGE_TOOLS}/runtime/libpage_runtime.a ${page_libc}/libc.a ${page_libc}/libzigc.a ${page_libc}/libcompiler_rt.a")
# -pthread would ask for memory that threads share.
set(CMAKE_HAVE_LIBC_PTHREAD ON CACHE INTERNAL "")
set(THREADS_HAVE_PTHREAD_ARG OFF CACHE INTERNAL "")
