// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Micro benchmarks of the stages (Google Benchmark): snapping, setup, coverage by triangle size, tile enumeration,
// blends, the radix sort. Run with --benchmark_filter=REGEX to choose.

#include "generated_meshes.hpp"

#include <benchmark/benchmark.h>
#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace core = voxelpipe::core;

constexpr int fraction = 14;
constexpr std::size_t count = 4096; // stays in the cache

struct triangle {
    core::snapped_position v[3];
};

// Triangles whose vertices lie in a cube of `size` voxels.
std::vector<triangle> make_triangles(double size) {
    bench::random_numbers random(7);
    std::vector<triangle> out(count);
    const double units = size * (1 << fraction);
    for (triangle& t : out) {
        std::int64_t at[3];
        for (auto& c : at) c = static_cast<std::int64_t>(random.below(std::uint64_t{1024} << fraction));
        for (auto& p : t.v) {
            const auto c = [&](int a) { return at[a] + static_cast<std::int64_t>(random.signed_unit() * units / 2); };
            p = {c(0), c(1), c(2)};
        }
    }
    return out;
}

double voxels(const benchmark::State& state) { return static_cast<double>(state.range(0)) / 100.0; }
constexpr std::array<std::int64_t, 6> sizes{30, 100, 300, 1000, 3000, 10000}; // hundredths of a voxel
void all_sizes(benchmark::internal::Benchmark* b) {
    for (const std::int64_t s : sizes) b->Arg(s);
}

void snap(benchmark::State& state) {
    const bench::mesh_data m = bench::icosphere(20);
    const core::snap_transform t = core::make_snap_transform(vp::fit(m.positions, glm::ivec3(1024)));
    for (auto _ : state)
        for (const glm::vec3& p : m.positions) benchmark::DoNotOptimize(core::snap(t, p.x, p.y, p.z));
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(m.positions.size()));
}
BENCHMARK(snap);

template <core::span_rule Rule, class Int>
void setup(benchmark::State& state) {
    const auto triangles = make_triangles(4);
    for (auto _ : state)
        for (const triangle& t : triangles) {
            auto s = core::setup_triangle<Rule, Int>(t.v[0], t.v[1], t.v[2], fraction);
            benchmark::DoNotOptimize(s);
        }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
}
BENCHMARK(setup<core::span_rule::conservative, std::int64_t>);
BENCHMARK(setup<core::span_rule::thin, std::int64_t>);
BENCHMARK(setup<core::span_rule::conservative, vp::int128>);

// Setup and all spans of a triangle inside the grid; items are triangles, `spans` and `fragments` per triangle.
template <core::span_rule Rule>
void coverage(benchmark::State& state) {
    const auto triangles = make_triangles(voxels(state));
    const core::voxel_box clip{{{-200, -200, -200}}, {{1300, 1300, 1300}}};
    std::int64_t spans = 0, fragments = 0;
    for (auto _ : state)
        for (const triangle& t : triangles)
            core::rasterize<Rule>(t.v[0], t.v[1], t.v[2], fraction, clip,
                                  [&](const auto&, std::int64_t, std::int64_t, std::int64_t w0, std::int64_t w1) {
                                      ++spans;
                                      fragments += w1 - w0 + 1;
                                  });
    const auto n = static_cast<double>(state.iterations()) * static_cast<double>(count);
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
    state.counters["spans"] = static_cast<double>(spans) / n;
    state.counters["fragments"] = static_cast<double>(fragments) / n;
}
BENCHMARK(coverage<core::span_rule::conservative>)->Apply(all_sizes);
BENCHMARK(coverage<core::span_rule::thin>)->Apply(all_sizes);

template <vp::coverage Rule>
void tiles(benchmark::State& state) {
    const auto triangles = make_triangles(voxels(state));
    const core::voxel_box whole{{{0, 0, 0}}, {{1023, 1023, 1023}}};
    const core::tile_grid grid(glm::ivec3(1024), vp::cpu::log2_tile_size);
    std::uint64_t sum = 0;
    for (auto _ : state)
        for (const triangle& t : triangles) {
            core::voxel_box reach{};
            if (core::classify<Rule>(t.v[0], t.v[1], t.v[2], fraction, whole, reach) != core::triangle_class::drawn)
                continue;
            core::for_each_tile<Rule>(t.v[0], t.v[1], t.v[2], fraction, reach, grid,
                                      [&](std::uint64_t tile) { sum += tile; });
        }
    benchmark::DoNotOptimize(sum);
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
}
BENCHMARK(tiles<vp::coverage::conservative>)->Apply(all_sizes);
BENCHMARK(tiles<vp::coverage::thin>)->Apply(all_sizes);

// Terms blended into a few accumulators, as fragments of a tile are.
template <class T, class Blend>
void blend_terms(benchmark::State& state) {
    using traits = core::blend_traits<Blend, T>;
    bench::random_numbers random(3);
    std::vector<T> terms(count);
    for (T& t : terms) t = static_cast<T>(static_cast<float>(random.signed_unit() * 100));
    std::array<typename traits::accumulator, 64> sums;
    for (auto& s : sums) s = traits::begin(traits::identity());
    for (auto _ : state) {
        for (std::size_t i = 0; i < count; ++i) traits::apply(sums[i % sums.size()], terms[i]);
        benchmark::ClobberMemory();
    }
    for (auto& s : sums) {
        auto end = traits::end(s);
        benchmark::DoNotOptimize(end);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
}
BENCHMARK(blend_terms<float, vp::blend::add>);
BENCHMARK(blend_terms<float, vp::blend::add_unordered>);
BENCHMARK(blend_terms<float, vp::blend::max>);
BENCHMARK(blend_terms<double, vp::blend::add>);
BENCHMARK(blend_terms<vp::half, vp::blend::add>);
BENCHMARK(blend_terms<std::uint32_t, vp::blend::add>);

template <class T>
void round_sums(benchmark::State& state) {
    using traits = core::blend_traits<vp::blend::add, T>;
    bench::random_numbers random(3);
    std::vector<typename traits::accumulator> sums(count, traits::begin(traits::identity()));
    for (auto& s : sums)
        for (int i = 0; i < 5; ++i) traits::apply(s, static_cast<T>(static_cast<float>(random.signed_unit() * 100)));
    for (auto _ : state)
        for (const auto& s : sums) {
            auto end = traits::end(s);
            benchmark::DoNotOptimize(end);
        }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
}
BENCHMARK(round_sums<float>);
BENCHMARK(round_sums<double>);
BENCHMARK(round_sums<vp::half>);

void radix_sort(benchmark::State& state) {
    bench::random_numbers random(5);
    using pair = vp::cpu::tile_pair<std::uint32_t>;
    std::vector<pair> items(1'000'000);
    vp::cpu::raw_array<pair> work(items.size());
    const int bits = static_cast<int>(state.range(0));
    for (std::uint32_t i = 0; i < items.size(); ++i)
        items[i] = {static_cast<std::uint32_t>(random.below(std::uint64_t{1} << bits)), i};
    for (auto _ : state) {
        std::copy(items.begin(), items.end(), work.begin());
        vp::cpu::radix_sort(1, work, bits);
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(items.size()));
}
BENCHMARK(radix_sort)->Arg(6)->Arg(12)->Arg(15)->Arg(18)->Unit(benchmark::kMillisecond);

} // namespace

BENCHMARK_MAIN();
