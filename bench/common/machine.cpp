// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "machine.hpp"

#include "built_commit.hpp"

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

#include <malloc.h>
#include <sys/utsname.h>

namespace bench {

namespace {

// The rest of the first line of `file` that starts with `key`, without what separates them.
std::string field(const char* file, const std::string& key) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
        if (!line.starts_with(key)) continue;
        const std::size_t at = line.find_first_not_of(" \t:=\"", key.size());
        if (at == std::string::npos) return "";
        line = line.substr(at);
        while (!line.empty() && line.back() == '"') line.pop_back();
        return line;
    }
    return "";
}

} // namespace

machine_record describe_machine() {
    machine_record m;
    m.cpu =
        field("/proc/cpuinfo", "model name") + ", " + std::to_string(std::thread::hardware_concurrency()) + " logical";
    utsname system{};
    if (uname(&system) == 0) m.system = std::string(system.sysname) + " " + system.release;
    m.system += ", " + field("/etc/os-release", "PRETTY_NAME");
#if defined(__clang__)
    m.compiler = "clang++ " __clang_version__;
#else
    m.compiler = "g++ " __VERSION__;
#endif
    m.flags = VOXELPIPE_BENCH_FLAGS;
    // The commit that the program was built from; the environment may name another, for programs that were copied here.
    const char* const told = std::getenv("VOXELPIPE_COMMIT");
    m.commit = told != nullptr ? told : VOXELPIPE_BENCH_COMMIT;
    const std::time_t now = std::time(nullptr);
    char text[32];
    std::tm utc{};
    std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", gmtime_r(&now, &utc));
    m.date = text;
    m.load = field("/proc/loadavg", "");
    m.load = m.load.substr(0, m.load.find(' '));
    return m;
}

std::string machine_record::markdown() const {
    return "- processor: " + cpu + "\n- system: " + system + "\n- compiler: " + compiler + "\n- flags: " + flags +
           "\n- commit: " + commit + "\n- date: " + date + "\n- load average before the run: " + load + "\n";
}

std::uint64_t peak_memory() {
    const std::string text = field("/proc/self/status", "VmHWM");
    return text.empty() ? 0 : std::stoull(text) * 1024;
}

void reset_peak_memory() {
    malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << "5";
}

} // namespace bench
