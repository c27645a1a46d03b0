// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Functions of POSIX that the tool calls and wasi-libc lacks.
#include "sys/prctl.h"
#include "sys/wait.h"
#include "unistd.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>

namespace {

int refuse() {
    errno = ENOSYS;
    return -1;
}

} // namespace

extern "C" {

pid_t fork() { return refuse(); }
pid_t getppid() { return 0; }
pid_t waitpid(pid_t, int*, int) { return refuse(); }
int pipe2(int*, int) { return refuse(); }
int dup2(int, int) { return refuse(); }
int prctl(int, ...) { return refuse(); }
int flock(int, int) { return 0; }
uid_t geteuid() { return 0; }

int mkstemp(char* name) {
    const std::size_t length = std::strlen(name);
    if (length < 6 || std::strcmp(name + length - 6, "XXXXXX") != 0) {
        errno = EINVAL;
        return -1;
    }
    for (unsigned n = 0; n < 1000000; ++n) {
        unsigned rest = n;
        for (std::size_t digit = length; digit > length - 6; --digit, rest /= 10)
            name[digit - 1] = static_cast<char>('0' + rest % 10);
        const int file = open(name, O_CREAT | O_EXCL | O_RDWR, 0600);
        if (file >= 0 || errno != EEXIST) return file;
    }
    return -1;
}

} // extern "C"
