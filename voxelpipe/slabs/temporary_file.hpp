// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A temporary file as the operating system has it, for POSIX and for Windows.

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <system_error>

#if defined(_WIN32)
#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <mutex>
#else
#include <fcntl.h>
#include <unistd.h>
#endif

namespace voxelpipe::slabs {

// Throws std::system_error of an errno with what could not be done.
[[noreturn]] inline void fail_temporary_file(int error, const std::string& what) {
    throw std::system_error(error, std::generic_category(), "voxelpipe::slabs: " + what);
}

// A new, empty file in a folder that is there. It is gone when the object is, or the process. Any threads may call
// write_some and read_some. The constructor throws std::system_error.
class temporary_file {
public:
    temporary_file(const temporary_file&) = delete;
    temporary_file& operator=(const temporary_file&) = delete;

#if defined(_WIN32)
    // folder: where the file is made, as std::filesystem::path takes it.
    explicit temporary_file(const std::string& folder) {
        static std::atomic<unsigned> number{0};
        do {
            const std::string name =
                folder + "/voxelpipe-" + std::to_string(::_getpid()) + '-' + std::to_string(number.fetch_add(1));
            file_ =
                ::_wopen(std::filesystem::path(name).c_str(),
                         _O_CREAT | _O_EXCL | _O_RDWR | _O_BINARY | _O_TEMPORARY | _O_NOINHERIT, _S_IREAD | _S_IWRITE);
        } while (file_ < 0 && errno == EEXIST);
        if (file_ < 0) fail_temporary_file(errno, "cannot make a temporary file in " + folder);
    }
    ~temporary_file() { ::_close(file_); }

    // Writes some of the bytes at an offset; the number, or -1 with errno.
    [[nodiscard]] std::int64_t write_some(const void* bytes, std::size_t count, std::uint64_t offset) noexcept {
        const std::lock_guard lock(mutex_); // a file has one position
        if (::_lseeki64(file_, static_cast<std::int64_t>(offset), SEEK_SET) < 0) return -1;
        return ::_write(file_, bytes, static_cast<unsigned>(std::min<std::size_t>(count, most)));
    }
    // Reads some bytes from an offset on; the number, 0 at the end, or -1 with errno.
    [[nodiscard]] std::int64_t read_some(void* bytes, std::size_t count, std::uint64_t offset) const noexcept {
        const std::lock_guard lock(mutex_);
        if (::_lseeki64(file_, static_cast<std::int64_t>(offset), SEEK_SET) < 0) return -1;
        return ::_read(file_, bytes, static_cast<unsigned>(std::min<std::size_t>(count, most)));
    }

private:
    static constexpr std::size_t most = std::size_t{1} << 30; // bytes that one call takes
    mutable std::mutex mutex_;
#else
    // folder: where the file is made.
    explicit temporary_file(const std::string& folder) {
        std::string name = folder + "/voxelpipe-XXXXXX";
        file_ = ::mkstemp(name.data());
        if (file_ < 0) fail_temporary_file(errno, "cannot make a temporary file in " + folder);
        (void)::unlink(name.c_str());
    }
    ~temporary_file() { ::close(file_); }

    // Writes some of the bytes at an offset; the number, or -1 with errno.
    [[nodiscard]] std::int64_t write_some(const void* bytes, std::size_t count, std::uint64_t offset) noexcept {
        return ::pwrite(file_, bytes, count, static_cast<off_t>(offset));
    }
    // Reads some bytes from an offset on; the number, 0 at the end, or -1 with errno.
    [[nodiscard]] std::int64_t read_some(void* bytes, std::size_t count, std::uint64_t offset) const noexcept {
        return ::pread(file_, bytes, count, static_cast<off_t>(offset));
    }

private:
#endif
    int file_ = -1;
};

} // namespace voxelpipe::slabs
