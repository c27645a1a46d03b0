// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "isolated.hpp"

#include "read/gltf/text.hpp"

#include <new>
#include <span>

#if defined(__wasi__) || defined(_WIN32)

namespace voxelize {

// WASI has one process, and Windows cannot double one. What would end another process ends this one, which is the
// boundary there: the time and the memory of the work have no limit of their own. The page starts a process for each
// model. The tool for Windows is built without the libraries that need the boundary.
std::vector<std::byte> run_isolated(const std::function<std::vector<std::byte>()>& work, const isolation_limits& limits,
                                    const std::string& who) {
    std::vector<std::byte> bytes;
    try {
        bytes = work();
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        const std::string text = gltf::printable(error.what(), 200);
        throw model_error(who + ": " + (text.empty() ? "the file cannot be read" : text));
    }
    if (bytes.size() > limits.result)
        throw model_error(who + ": the model takes more than the " + std::to_string(limits.result >> 20) +
                          " MiB that a file of this size gets");
    return bytes;
}

} // namespace voxelize

#else

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VOXELIZE_IS_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define VOXELIZE_IS_SANITIZED
#endif
#endif
#ifdef VOXELIZE_IS_SANITIZED
#include <sanitizer/common_interface_defs.h>
#endif

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace voxelize {

namespace {

#ifdef VOXELIZE_IS_SANITIZED
constexpr bool bounds_memory = false;
#else
constexpr bool bounds_memory = true;
#endif

// Ends messages of a breakdown, for which nothing in the file can be named.
constexpr const char* what_to_do = ": convert it to another format, such as .glb or .obj, with a program that opens it";

// The first byte that comes back.
enum class outcome : unsigned char { done = 'd', failed = 'f', no_memory = 'm' };

std::uint64_t address_space_in_use() {
    std::uint64_t pages = 0;
    if (std::FILE* const file = std::fopen("/proc/self/statm", "r")) {
        unsigned long long number = 0;
        if (std::fscanf(file, "%llu", &number) == 1) pages = number;
        std::fclose(file);
    }
    return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

// Never above what holds already.
void limit(int resource, std::uint64_t soft, std::uint64_t hard) {
    rlimit now{};
    if (getrlimit(resource, &now) != 0) return;
    const rlimit value{std::min(now.rlim_cur, static_cast<rlim_t>(soft)),
                       std::min(now.rlim_max, static_cast<rlim_t>(hard))};
    (void)setrlimit(resource, &value);
}

bool write_all(int file, std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = write(file, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return true;
}

[[noreturn]] void run_child(const std::function<std::vector<std::byte>()>& work, const isolation_limits& limits,
                            int out) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
#ifdef VOXELIZE_IS_SANITIZED
    __sanitizer_set_death_callback(nullptr); // a fuzzer's, which would keep the input as a finding of its own
#endif
    for (const int signal : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGXCPU}) std::signal(signal, SIG_DFL);
    // Libraries print what they find; nobody asked for it.
    if (const int nowhere = open("/dev/null", O_RDWR); nowhere >= 0)
        for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, stream);
    limit(RLIMIT_CORE, 0, 0);
    limit(RLIMIT_CPU, limits.seconds, limits.seconds + 1);
    if (bounds_memory) {
        const std::uint64_t most = address_space_in_use() + limits.memory;
        limit(RLIMIT_AS, most, most);
    }
    const auto reply = [out](outcome how, std::span<const std::byte> bytes) {
        const auto first = static_cast<std::byte>(how);
        _exit(write_all(out, {&first, 1}) && write_all(out, bytes) ? 0 : 1);
    };
    try {
        reply(outcome::done, work());
    } catch (const std::bad_alloc&) {
        reply(outcome::no_memory, {});
    } catch (const std::exception& error) {
        reply(outcome::failed, std::as_bytes(std::span(error.what(), std::strlen(error.what()))));
    } catch (...) {
        reply(outcome::failed, {});
    }
    _exit(1);
}

// Everything that comes through FILE until its end; nothing more once LIMITS.result bytes have come.
bool read_all(int file, std::vector<std::byte>& bytes, std::uint64_t most) {
    std::size_t used = 0;
    while (true) {
        if (bytes.size() - used < 65536) bytes.resize(std::max<std::size_t>(2 * bytes.size(), 65536));
        const ssize_t got = read(file, bytes.data() + used, bytes.size() - used);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        used += static_cast<std::size_t>(got);
        if (used > most) return false;
    }
    bytes.resize(used);
    return true;
}

std::string mebibytes(std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

} // namespace

std::vector<std::byte> run_isolated(const std::function<std::vector<std::byte>()>& work, const isolation_limits& limits,
                                    const std::string& who) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw model_error(who + " cannot be run: " + std::strerror(errno));
    const pid_t child = fork();
    if (child < 0) {
        const int error = errno;
        close(ends[0]);
        close(ends[1]);
        throw model_error(who + " cannot be run: " + std::strerror(error));
    }
    if (child == 0) {
        close(ends[0]);
        run_child(work, limits, ends[1]);
    }
    close(ends[1]);
    std::vector<std::byte> bytes;
    bool complete = false;
    bool no_memory = false;
    try {
        complete = read_all(ends[0], bytes, limits.result);
    } catch (const std::bad_alloc&) {
        no_memory = true;
    }
    close(ends[0]);
    if (!complete) kill(child, SIGKILL);
    int status = 0;
    rusage used{};
    while (wait4(child, &status, 0, &used) < 0 && errno == EINTR) {
    }
    if (no_memory) throw std::bad_alloc();
    if (!complete)
        throw model_error(who + ": the model takes more than the " + mebibytes(limits.result) +
                          " that a file of this size gets");
    if (WIFSIGNALED(status)) {
        const int signal = WTERMSIG(status);
        const auto seconds = static_cast<std::uint64_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + 1;
        if (signal == SIGKILL && seconds < limits.seconds)
            throw model_error(who + " was killed on this file, as the kernel does where memory runs out");
        if (signal == SIGXCPU || signal == SIGKILL)
            throw model_error(who + " needs more than the " + std::to_string(limits.seconds) +
                              " s that a file of this size gets");
        throw model_error(who + " broke down on this file (signal " + std::to_string(signal) + ")" + what_to_do);
    }
    if (bytes.empty()) throw model_error(who + " broke down on this file" + what_to_do);
    const auto how = static_cast<outcome>(bytes.front());
    bytes.erase(bytes.begin());
    if (how == outcome::done) return bytes;
    if (how == outcome::no_memory)
        throw isolation_memory_error(who + " needs more than the " + mebibytes(limits.memory) +
                                     " of memory that a file of this size gets");
    const std::string text = gltf::printable({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, 200);
    throw model_error(who + ": " + (text.empty() ? "the file cannot be read" : text));
}

} // namespace voxelize

#endif
