// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "system.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#if !defined(__wasi__)
#include <malloc.h>
#include <sys/resource.h>
#endif

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <limits>

namespace voxelize::os {
namespace {

file_facts facts_in(const struct stat& found) {
    file_facts facts{{static_cast<std::uint64_t>(found.st_dev), static_cast<std::uint64_t>(found.st_ino)}};
    if (S_ISREG(found.st_mode)) facts.kind = file_kind::regular;
    if (S_ISDIR(found.st_mode)) facts.kind = file_kind::folder;
    facts.is_only_name = found.st_nlink == 1 && found.st_uid == ::geteuid();
    return facts;
}

int flags_of(opening how) {
    switch (how) {
    case opening::read:
        return O_RDONLY;
    case opening::read_write:
        return O_RDWR | O_NOFOLLOW;
    case opening::create:
        return O_RDWR | O_CREAT | O_EXCL;
    case opening::share:
        return O_RDWR | O_CREAT;
    case opening::append_shared:
        break;
    }
    return O_RDWR | O_CREAT | O_APPEND;
}

} // namespace

void begin_program(int&, char**&) { std::signal(SIGXFSZ, SIG_IGN); }
void keep_running_without_reader() { std::signal(SIGPIPE, SIG_IGN); }
std::optional<std::string> worker_order() { return std::nullopt; }
bool is_terminal(int file) { return ::isatty(file) != 0; }
bool draws_over_lines(int file) { return is_terminal(file); }

std::tm utc(std::time_t seconds) {
    std::tm result{};
    gmtime_r(&seconds, &result);
    return result;
}

std::optional<file_facts> facts_of(const std::filesystem::path& path, links how) {
    struct stat found {};
    const int failed = how == links::follow ? ::stat(path.c_str(), &found) : ::lstat(path.c_str(), &found);
    if (failed != 0) return std::nullopt;
    return facts_in(found);
}

std::optional<file_facts> facts_of(int file) {
    struct stat found {};
    if (::fstat(file, &found) != 0) return std::nullopt;
    return facts_in(found);
}

std::string compared_name(const std::filesystem::path& name) { return name.string(); }

int open_file(const std::filesystem::path& path, opening how) {
    return ::open(path.c_str(), flags_of(how) | O_CLOEXEC, 0666);
}
void close_file(int file) { ::close(file); }
int open_again(int file) { return ::fcntl(file, F_DUPFD_CLOEXEC, 0); }

bool lock_file(int file, bool wait) {
    while (::flock(file, wait ? LOCK_EX : LOCK_EX | LOCK_NB) != 0)
        if (!wait || errno != EINTR) return false;
    return true;
}

bool empty_file(int file) { return ::ftruncate(file, 0) == 0; }

bool write_once(int file, std::string_view text) {
    return ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

std::optional<char> last_byte(int file) {
    char last = 0;
    const off_t size = ::lseek(file, 0, SEEK_END);
    if (size <= 0 || ::pread(file, &last, 1, size - 1) != 1) return std::nullopt;
    return last;
}

std::FILE* write_stream(int file) { return ::fdopen(file, "wb"); }
std::FILE* write_stream(const std::filesystem::path& path) { return std::fopen(path.c_str(), "wb"); }
int descriptor_of(std::FILE* stream) { return ::fileno(stream); }

bool seek_stream(std::FILE* stream, std::uint64_t offset) {
    if (offset > static_cast<std::uint64_t>(std::numeric_limits<long>::max())) {
        errno = EFBIG;
        return false;
    }
    return std::fseek(stream, static_cast<long>(offset), SEEK_SET) == 0;
}

bool make_folder(const std::filesystem::path& path) { return ::mkdir(path.c_str(), 0777) == 0; }
bool remove_empty_folder(const std::filesystem::path& path) { return ::rmdir(path.c_str()) == 0; }

const std::byte* map_file(const std::filesystem::path& path, std::size_t size) {
    const int file = open_file(path, opening::read);
    if (file < 0) return nullptr;
    void* const data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
    const int reason = errno;
    ::close(file); // the mapping stays
    errno = reason;
    return data == MAP_FAILED ? nullptr : static_cast<const std::byte*>(data);
}

void unmap_file(const std::byte* data, std::size_t size) { ::munmap(const_cast<std::byte*>(data), size); }

#if !defined(__wasi__) // whose memory memory.cpp knows
namespace {

// The number in FILE; the greatest number if FILE holds none ("max").
std::uint64_t number_in(const std::string& file) {
    std::ifstream stream(file);
    std::uint64_t number = 0;
    return stream >> number ? number : UINT64_MAX;
}

} // namespace

residence residence_now() noexcept {
    std::FILE* const file = std::fopen("/proc/self/statm", "r");
    if (file == nullptr) return {};
    unsigned long long all = 0, pages = 0, shared = 0;
    const bool read = std::fscanf(file, "%llu %llu %llu", &all, &pages, &shared) == 3;
    std::fclose(file);
    const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    return read ? residence{pages * page, shared * page} : residence{};
}

std::uint64_t most_resident() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmHWM:")) return std::stoull(line.substr(6)) * 1024;
    rusage usage{}; // which counts what the process was before it began this program, too
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::uint64_t heap_bytes() noexcept {
#if defined(__GLIBC__) && !__GLIBC_PREREQ(2, 33)
    return static_cast<unsigned>(mallinfo().arena); // of 32 bits: the heaps' bytes modulo 2^32
#else
    return mallinfo2().arena;
#endif
}

std::uint64_t allowed_memory() {
    std::uint64_t least =
        static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    // Control groups: version 2 by the path of this process and those above it, version 1 where containers see it.
    std::ifstream groups("/proc/self/cgroup");
    for (std::string line; std::getline(groups, line);) {
        if (!line.starts_with("0::")) continue;
        for (std::string path = line.substr(3);; path.erase(path.find_last_of('/'))) {
            if (path == "/") path.clear();
            least = std::min(least, number_in("/sys/fs/cgroup" + path + "/memory.max"));
            if (path.find('/') == std::string::npos) break;
        }
    }
    least = std::min(least, number_in("/sys/fs/cgroup/memory/memory.limit_in_bytes"));
    for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
        rlimit own{};
        if (getrlimit(resource, &own) == 0 && own.rlim_cur != RLIM_INFINITY)
            least = std::min(least, static_cast<std::uint64_t>(own.rlim_cur));
    }
    return least;
}
#endif

} // namespace voxelize::os
