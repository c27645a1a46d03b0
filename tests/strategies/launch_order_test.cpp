// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The order and number of running blocks do not change the result: kernels that occupy some or all multiprocessors,
// fewer persistent blocks, draws and triangles in other orders. All bytes equal cpu_backend's.

#include "cells.hpp"

#include <algorithm>
#include <cmath>
#include <span>

using namespace device_test;

namespace {

// Ends by itself. The first blocks run longest, so multiprocessors become free one after the other.
__global__ void hold_multiprocessor(long long cycles, unsigned* sink) {
    extern __shared__ unsigned all_of_it[];
    const long long mine = cycles / (1 + blockIdx.x % 7);
    const long long start = clock64();
    unsigned n = threadIdx.x;
    while (clock64() - start < mine) n = n * 1664525u + 1013904223u;
    all_of_it[threadIdx.x] = n;
    if (n == 0) *sink = all_of_it[threadIdx.x];
}

// Occupies multiprocessors with one block each, which uses the largest possible shared memory.
class company {
public:
    company() : sink_(backend_, 1) {
        int device = 0;
        EXPECT_EQ(cudaGetDevice(&device), cudaSuccess);
        EXPECT_EQ(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device), cudaSuccess);
        EXPECT_EQ(cudaDeviceGetAttribute(&bytes_, cudaDevAttrMaxSharedMemoryPerBlockOptin, device), cudaSuccess);
        EXPECT_EQ(cudaFuncSetAttribute(hold_multiprocessor, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes_),
                  cudaSuccess);
        EXPECT_EQ(cudaStreamSynchronize(owner_.stream), cudaSuccess);
    }
    // One, a third, all but one, all, and more than exist.
    [[nodiscard]] std::vector<int> numbers() const {
        return {1, multiprocessors_ / 3 + 1, std::max(1, multiprocessors_ - 1), multiprocessors_, 3 * multiprocessors_};
    }
    void come(int blocks) {
        constexpr long long cycles = 4'000'000; // some milliseconds
        (void)::emulation::launch([=](const auto&... a) { hold_multiprocessor(a...); }, static_cast<unsigned>(blocks), 256, static_cast<std::size_t>(bytes_), owner_.stream, cycles, sink_.data())
;
        ASSERT_EQ(cudaGetLastError(), cudaSuccess);
    }
    void wait() { ASSERT_EQ(cudaStreamSynchronize(owner_.stream), cudaSuccess); }

private:
    stream_owner owner_;
    vp::cuda_backend backend_{owner_.stream};
    vp::cuda_backend::buffer<unsigned> sink_;
    int multiprocessors_ = 0, bytes_ = 0;
};

// Persistent blocks a multiprocessor: the kernels are the same, and the host launches other numbers of blocks.
template <int Blocks>
struct few_blocks {
    constexpr vp::tuning::fine_raster_policy operator()(int bits, int capability) const {
        vp::tuning::fine_raster_policy p = vp::tuning::fine_raster_selector{}(bits, capability);
        p.blocks_per_sm = Blocks;
        return p;
    }
};

template <class Backend, class FragmentShader>
struct model {
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, FragmentShader>;
    std::vector<vp::mesh<Backend>> meshes;
    std::vector<draw_type> draws;
    std::uint64_t triangles = 0;

    model(Backend& be, const std::vector<mesh_data>& parts, const FragmentShader& shader) {
        for (const mesh_data& m : parts) {
            meshes.emplace_back(be, m.positions, m.triangles);
            triangles += m.triangles.size();
        }
        for (const auto& m : meshes) draws.push_back({m.view(), {}, shader});
    }
    [[nodiscard]] std::span<const draw_type> all() const { return draws; }
};

// Parts of different sizes with large triangles. Triangles far beyond the grid, which take long, are only in the
// smallest part.
std::vector<mesh_data> make_parts() {
    std::vector<mesh_data> parts;
    for (std::uint32_t k = 0; k < 4; ++k) {
        mesh_data m = mixed_triangles(300 << (2 * k), 90.0f, 110 + k);
        if (k != 0)
            std::erase_if(m.triangles, [&](const glm::uvec3& t) {
                for (int i = 0; i < 3; ++i)
                    for (int a = 0; a < 3; ++a)
                        if (std::abs(m.positions[t[i]][a]) > 1000.0f) return true; // not NaN
                return false;
            });
        parts.push_back(std::move(m));
    }
    add_triangle(parts[2], {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 150.0f}, {-300.0f, 500.0f, 60.0f});
    add_triangle(parts[0], {10.0f, -20.0f, 95.0f}, {80.0f, 120.0f, 3.0f}, {-30.0f, 60.0f, 40.0f});
    return parts;
}

// Calls f with the parts unchanged, and with draws and triangles in other orders.
template <class F>
void for_each_order(const F& f) {
    std::vector<mesh_data> parts = make_parts();
    std::mt19937 random(115);
    for (int order = 0; order < 3; ++order) {
        SCOPED_TRACE("order " + std::to_string(order));
        f(parts);
        std::shuffle(parts.begin(), parts.end(), random);
        for (mesh_data& m : parts) std::shuffle(m.triangles.begin(), m.triangles.end(), random);
    }
}

const vp::grid whole = box_grid({90, 81, 97});

template <class... Targets, class FragmentShader>
void compare(target_list<Targets...>, const FragmentShader& shader, vp::coverage rule, bool lists = false) {
    company others;
    stream_owner owner;
    vp::cuda_backend gpu{owner.stream};
    if (!lists && !vp::core::is_constant<FragmentShader>) gpu.strategy = vp::strategy::tiled;
    vp::cpu_backend cpu;
    const vp::voxelize_options options{rule};
    for_each_order([&](const std::vector<mesh_data>& parts) {
        const model<vp::cpu_backend, FragmentShader> on_cpu(cpu, parts, shader);
        const model<vp::cuda_backend, FragmentShader> on_gpu(gpu, parts, shader);
        vp::framebuffer<vp::cpu_backend, Targets...> a{cpu, whole.extent};
        vp::framebuffer<vp::cuda_backend, Targets...> b{gpu, whole.extent};
        const vp::status sa = vp::voxelize(cpu, on_cpu.all(), whole, a, options);
        ASSERT_TRUE(sa.ok()) << sa.message();
        const auto run = [&]<class Selector>(Selector, int held) {
            SCOPED_TRACE("held: " + std::to_string(held));
            if (held > 0) others.come(held);
            const vp::status sb = gpu.run<Selector>(on_gpu.all(), whole, b.view(), options, on_gpu.triangles);
            ASSERT_TRUE(sb.ok()) << sb.message();
            expect_same_counts(sa.counts, sb.counts);
            vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), "target");
            });
            others.wait();
        };
        for (const int held : others.numbers()) run(vp::tuning::fine_raster_selector{}, held);
        for (const int held : {0, others.numbers()[1]}) {
            run(few_blocks<1>{}, held);
            run(few_blocks<2>{}, held);
        }
    });
}

TEST(LaunchOrder, DoesNotChangeTiles) {
    for (const vp::coverage rule : both_rules) compare(tile_targets{}, tile_values{9}, rule);
}

TEST(LaunchOrder, DoesNotChangeListedFragments) {
    for (const vp::coverage rule : both_rules) compare(tile_targets{}, tile_values{9}, rule, true);
}

TEST(LaunchOrder, DoesNotChangeTargetsWithoutTiles) {
    for (const vp::coverage rule : both_rules) compare(bit_targets{}, same_bits(true), rule);
}

// Many draws use count-and-emit, one draw the lists' own raster.
TEST(LaunchOrder, DoesNotChangeLists) {
    company others;
    stream_owner owner;
    vp::cuda_backend gpu{owner.stream};
    vp::cpu_backend cpu;
    const auto shader = vp::constant(true);
    const auto compare_lists = [&](const std::vector<mesh_data>& parts) {
        const model<vp::cpu_backend, vp::constant_output<bool>> on_cpu(cpu, parts, shader);
        const model<vp::cuda_backend, vp::constant_output<bool>> on_gpu(gpu, parts, shader);
        vp::abuffer<vp::cpu_backend> a{cpu};
        vp::abuffer<vp::cuda_backend> b{gpu};
        const vp::status sa = vp::voxelize(cpu, on_cpu.all(), whole, a);
        ASSERT_TRUE(sa.ok()) << sa.message();
        const auto ha = a.to_host(cpu);
        for (const int held : others.numbers()) {
            SCOPED_TRACE("held: " + std::to_string(held));
            others.come(held);
            const vp::status sb = vp::voxelize(gpu, on_gpu.all(), whole, b);
            ASSERT_TRUE(sb.ok()) << sb.message();
            expect_same_counts(sa.counts, sb.counts);
            expect_same_on_host(ha, b.to_host(gpu));
            others.wait();
        }
    };
    for_each_order([&](const std::vector<mesh_data>& parts) {
        compare_lists(parts);
        compare_lists({parts[3]});
    });
}

} // namespace
