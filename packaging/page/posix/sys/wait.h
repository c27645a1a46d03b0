// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The end of another process, which there never is.
#include <sys/types.h>

#define WNOHANG 1
#define WIFSIGNALED(status) (0)
#define WTERMSIG(status) (0)
#define WIFEXITED(status) (1)
#define WEXITSTATUS(status) (status)

#ifdef __cplusplus
extern "C" {
#endif
pid_t waitpid(pid_t process, int* status, int options);
#ifdef __cplusplus
}
#endif
