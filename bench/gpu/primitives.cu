// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The library's sort of pairs and prefix sum of counts beside CUB's, by number and key bits: where CUB is as fast, the
// library uses it (docs/optimizations.md). Each is timed as a graph, so the host's time for launches does not count.
// Prints a table of medians; --out writes it as CSV too.

#include "output.hpp"
#include "run.hpp"
#include "table.hpp"

#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cuda/std/functional>

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;
using namespace bench;

struct row {
    std::string primitive;
    std::uint64_t n;
    int bits;
    sample ours, cub;
};

template <class T>
void copy(gpu::device_array<T>& to, const std::vector<T>& from) {
    gpu::check(cudaMemcpy(to.data(), from.data(), from.size() * sizeof(T), cudaMemcpyHostToDevice), "copy");
}

[[nodiscard]] sample time_graph(const gpu::session& s, const gpu::repetition& how, const std::function<void()>& call) {
    const gpu::captured_call graph(s, call);
    return gpu::time_calls(s, how, [&] { graph.launch(); });
}

// Random keys of `bits` bits. Both sorts leave the keys that they read as they are, but for their scratch.
template <class Key>
[[nodiscard]] row time_sorts(const gpu::session& s, const gpu::repetition& how, std::uint64_t n, int bits) {
    std::mt19937_64 random(n + static_cast<std::uint64_t>(bits));
    std::vector<Key> keys(n);
    for (Key& k : keys) k = static_cast<Key>(random() & ((std::uint64_t{1} << bits) - 1));
    gpu::device_array<Key> k[2] = {gpu::device_array<Key>(n), gpu::device_array<Key>(n)};
    gpu::device_array<std::uint32_t> v[2] = {gpu::device_array<std::uint32_t>(n), gpu::device_array<std::uint32_t>(n)};
    copy(k[0], keys);
    gpu::check(cudaMemset(v[0].data(), 0, v[0].bytes()), "memset");
    row result{std::to_string(8 * sizeof(Key)) + "-bit keys", n, bits, {}, {}};
    {
        const std::size_t bytes = vp::device::sort_bytes<Key>(n, bits);
        const gpu::device_array<std::byte> storage(bytes);
        Key* const in_keys[2] = {k[0].data(), k[1].data()};
        std::uint32_t* const in_values[2] = {v[0].data(), v[1].data()};
        result.ours = time_graph(s, how, [&] {
            (void)vp::device::sort_by_cell<Key>(in_keys, in_values, n, bits, storage.data(), bytes,
                                                vp::stage::tile_sort, s.stream());
        });
    }
    {
        cub::DoubleBuffer<Key> d_keys(k[0].data(), k[1].data());
        cub::DoubleBuffer<std::uint32_t> d_values(v[0].data(), v[1].data());
        std::size_t bytes = 0;
        gpu::check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, d_keys, d_values, n, 0, bits, s.stream()), "CUB");
        const gpu::device_array<std::byte> storage(bytes);
        result.cub = time_graph(s, how, [&] {
            cub::DoubleBuffer<Key> in_keys(k[0].data(), k[1].data());
            cub::DoubleBuffer<std::uint32_t> in_values(v[0].data(), v[1].data());
            gpu::check(
                cub::DeviceRadixSort::SortPairs(storage.data(), bytes, in_keys, in_values, n, 0, bits, s.stream()),
                "CUB");
        });
    }
    return result;
}

[[nodiscard]] row time_scans(const gpu::session& s, const gpu::repetition& how, std::uint64_t n) {
    const gpu::device_array<std::uint32_t> counts(n);
    const gpu::device_array<unsigned long long> sums(n);
    gpu::check(cudaMemset(counts.data(), 1, counts.bytes()), "memset");
    row result{"prefix sum", n, 0, {}, {}};
    const auto num = static_cast<std::uint32_t>(n);
    {
        const std::size_t bytes = vp::device::cell_scan_bytes(num);
        const gpu::device_array<std::byte> storage(bytes);
        result.ours = time_graph(s, how, [&] {
            vp::device::sum_counts(counts.data(), sums.data(), num, storage.data(), bytes, vp::stage::coarse_raster,
                                   s.stream());
        });
    }
    {
        std::size_t bytes = 0;
        const auto scan = [&](void* storage) {
            gpu::check(cub::DeviceScan::ExclusiveScan(storage, bytes, counts.data(), sums.data(), cuda::std::plus<>{},
                                                      0ull, num, s.stream()),
                       "CUB");
        };
        scan(nullptr);
        const gpu::device_array<std::byte> storage(bytes);
        result.cub = time_graph(s, how, [&] { scan(storage.data()); });
    }
    return result;
}

void add(table& rows, const row& r) {
    rows.add_row({r.primitive, std::to_string(r.n), r.bits == 0 ? "" : std::to_string(r.bits),
                  significant(r.ours.median * 1e3), significant(r.cub.median * 1e3),
                  significant(r.cub.median / r.ours.median)});
}

} // namespace

int main(int argc, char** argv) {
    gpu::run_options how;
    gpu::command command("bench_gpu_primitives", "Sorts and prefix sums of the library beside CUB's.", how,
                         "gpu_primitives.md and gpu_primitives.csv");
    return command.run(argc, argv, [&](const std::string& typed) {
        gpu::session s;
        gpu::clock_watch watch;
        table rows({"primitive", "n", "key bits", "ours us", "CUB us", "CUB / ours"});
        for (const std::uint64_t n : {1'000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000})
            add(rows, time_scans(s, how.repeat, n));
        watch.read();
        for (const std::uint64_t n : {10'000, 100'000, 1'000'000, 10'000'000, 50'000'000}) {
            for (const int bits : {9, 15, 18, 24, 30}) add(rows, time_sorts<std::uint32_t>(s, how.repeat, n, bits));
            for (const int bits : {20, 30, 40, 48}) add(rows, time_sorts<std::uint64_t>(s, how.repeat, n, bits));
        }
        watch.read();
        gpu::write_report(
            how, {"Sorts and prefix sums beside CUB's", "gpu_primitives", "CUDA graphs between two events", {}, {}, {}},
            watch, typed, rows);
        return 0;
    });
}
