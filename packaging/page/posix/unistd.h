// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// wasi-libc's <unistd.h>, with what POSIX has and WASI has not. There is one process: a second one is refused with
// ENOSYS, and a lock of a file is always free. posix.cpp has the definitions.
#include_next <unistd.h>

#ifdef __cplusplus
extern "C" {
#endif
pid_t fork(void);
pid_t getppid(void);
int pipe2(int ends[2], int flags);
int dup2(int from, int to);
uid_t geteuid(void);
int mkstemp(char* name);
#ifdef __cplusplus
}
#endif
