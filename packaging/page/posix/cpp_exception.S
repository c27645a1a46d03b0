# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
# The tag by which WebAssembly knows C++ exceptions: it carries the address of the object that was thrown.
    .tagtype __cpp_exception i32
    .globl __cpp_exception
__cpp_exception:
