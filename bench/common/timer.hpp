// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Times of repeated runs: medians of wall time, and of the time that all threads of the process together computed,
// which shows where a run had to share the machine.

#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

namespace bench {

struct timing {
    double wall_ms = 0; // median
    double cpu_ms = 0;  // median of user and system time of all threads
    double best_ms = 0; // shortest wall time
    int runs = 0;
};

struct repetition {
    int warmups = 1;
    int min_runs = 3;
    int max_runs = 20;
    double seconds = 2.0; // enough runs once they have taken so long together
};

inline double median(std::vector<double> v) {
    if (v.empty()) return 0;
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    if (v.size() % 2 == 1) return *middle;
    return 0.5 * (*middle + *std::max_element(v.begin(), middle));
}

inline double process_cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

// `after(run)` is called, untimed, after every run that counts.
template <class Work, class After>
timing measure(const repetition& how, Work&& work, After&& after) {
    std::vector<double> wall, cpu;
    double total = 0;
    for (int i = 0; i < how.warmups; ++i) work();
    while (static_cast<int>(wall.size()) < how.max_runs &&
           (static_cast<int>(wall.size()) < how.min_runs || total < how.seconds * 1e3)) {
        const double cpu_start = process_cpu_ms();
        const auto start = std::chrono::steady_clock::now();
        work();
        const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
        cpu.push_back(process_cpu_ms() - cpu_start);
        wall.push_back(ms.count());
        total += ms.count();
        after(static_cast<int>(wall.size()) - 1);
    }
    return {median(wall), median(cpu), *std::min_element(wall.begin(), wall.end()), static_cast<int>(wall.size())};
}

template <class Work>
timing measure(const repetition& how, Work&& work) {
    return measure(how, work, [](int) {});
}

} // namespace bench
