// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Results do not depend on the tile policy, the memory resource, the order of calls, or other work on the device at the
// same time.

// Enables the toolkit's memory resources, which CUDA 13.0 still hides. It must come before the first header.
#define LIBCUDACXX_ENABLE_EXPERIMENTAL_MEMORY_RESOURCE
#include <cuda/memory_resource>

#include "cells.hpp"

#include <algorithm>
#include <numeric>

using namespace device_test;
namespace blend = voxelpipe::blend;

// Named, because nvcc would warn that functions are unused which only the library's concepts require.
namespace resources {

// ---- memory resources: the forms that cuda_backend accepts
// -----------------------------------------------------------

struct account {
    std::size_t live = 0, total = 0;
    int calls = 0;
    void* take(std::size_t bytes, cudaStream_t stream) {
        void* p = nullptr;
        if (cudaMallocAsync(&p, bytes, stream) != cudaSuccess) throw std::bad_alloc();
        live += bytes;
        total += bytes;
        ++calls;
        return p;
    }
    void emit(void* p, std::size_t bytes, cudaStream_t stream) {
        cudaFreeAsync(p, stream);
        live -= bytes;
    }
};

// As CCCL 2 and 3.0 spell it.
struct async_form : account {
    void* allocate_async(std::size_t bytes, std::size_t alignment, cudaStream_t stream) {
        EXPECT_LE(alignment, 256u);
        return take(bytes, stream);
    }
    void deallocate_async(void* p, std::size_t bytes, std::size_t, cudaStream_t stream) { emit(p, bytes, stream); }
};

// As later ones do.
struct stream_first_form : account {
    void* allocate(cudaStream_t stream, std::size_t bytes, std::size_t alignment) {
        EXPECT_LE(alignment, 256u);
        return take(bytes, stream);
    }
    void deallocate(cudaStream_t stream, void* p, std::size_t bytes, std::size_t) noexcept { emit(p, bytes, stream); }
};

// A resource by the concepts of the toolkit's library; tests pass it as a type-erased reference.
struct library_form : account {
    void* allocate(std::size_t bytes, std::size_t = 256) {
        void* const p = take(bytes, nullptr);
        cudaStreamSynchronize(nullptr);
        return p;
    }
    void deallocate(void* p, std::size_t bytes, std::size_t = 256) noexcept { emit(p, bytes, nullptr); }
    void* allocate_async(std::size_t bytes, std::size_t, cuda::stream_ref stream) { return take(bytes, stream.get()); }
    void* allocate_async(std::size_t bytes, cuda::stream_ref stream) { return take(bytes, stream.get()); }
    void deallocate_async(void* p, std::size_t bytes, std::size_t, cuda::stream_ref stream) {
        emit(p, bytes, stream.get());
    }
    void deallocate_async(void* p, std::size_t bytes, cuda::stream_ref stream) { emit(p, bytes, stream.get()); }
    bool operator==(const library_form& other) const { return this == &other; }
    bool operator!=(const library_form& other) const { return this != &other; }
    friend void get_property(const library_form&, cuda::mr::device_accessible) noexcept {}
};
static_assert(cuda::mr::async_resource_with<library_form, cuda::mr::device_accessible>);

} // namespace resources

namespace {

using list = vp::framebuffer<vp::cuda_backend, vp::target<float, blend::add>, vp::target<std::uint32_t, blend::count>>;

template <class Resource>
std::vector<float> sums_through(Resource& resource, cudaStream_t stream) {
    vp::cuda_backend be{stream, resource};
    const mesh_data m = mixed_triangles(3000, 60.0f, 90);
    const vp::grid g = box_grid({61, 50, 67});
    const vp::mesh mesh{be, m.positions, m.triangles};
    list fb{be, g.extent};
    EXPECT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(0.3f, 1u), fb).ok());
    vp::abuffer<vp::cuda_backend> lists{be};
    EXPECT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), lists).ok());
    EXPECT_GT(lists.num_fragments(), 0u);
    return vp::get<0>(fb).to_host(be);
}

TEST(Invariance, EveryFormOfMemoryResourceIsAccepted) {
    resources::async_form first;
    resources::stream_first_form second;
    resources::library_form third;
    cudaStream_t stream = nullptr;
    ASSERT_EQ(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), cudaSuccess);
    const auto expected = sums_through(first, stream);
    expect_same_bytes(expected, sums_through(second, stream), "allocate(stream, bytes, alignment)");
    {
        cuda::mr::async_resource_ref<cuda::mr::device_accessible> reference{third};
        expect_same_bytes(expected, sums_through(reference, stream), "cuda::mr::async_resource_ref");
    }
    for (const resources::account* a : std::initializer_list<const resources::account*>{&first, &second, &third}) {
        EXPECT_GT(a->calls, 5);
        EXPECT_EQ(a->live, 0u);
    }
    EXPECT_EQ(first.calls, second.calls);
    EXPECT_EQ(first.calls, third.calls);
    cudaStreamDestroy(stream);
}

// ---- policies -------------------------------------------------------------------------------------------------------

template <int Threads, int Log2Size, int MinBlocks, int Blocks = 0>
struct fixed_policy {
    constexpr vp::tuning::fine_raster_policy operator()(int) const { return {Threads, Log2Size, MinBlocks, Blocks}; }
};

using several = vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_xor>, vp::target<float, blend::add>,
                                vp::target<std::uint32_t, blend::replace>, vp::target<glm::u8vec4, blend::max>>;
struct several_values {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const std::uint32_t h = mix_bits(f.primitive + static_cast<std::uint32_t>(f.voxel.x + 64 * f.voxel.y));
        return vp::outputs(h % 2 == 0, f.barycentric.x, f.primitive, glm::u8vec4(h & 255u, h >> 8 & 255u, 3, h >> 24))
            .discard_if(h % 9 == 0);
    }
};

struct several_results {
    vp::counters counts;
    std::vector<std::uint32_t> bits, last;
    std::vector<float> sums;
    std::vector<glm::u8vec4> maxima;
};

void expect_same_results(const several_results& a, const several_results& b) {
    expect_same_counts(a.counts, b.counts);
    expect_same_bytes(a.bits, b.bits, "bits");
    expect_same_bytes(a.sums, b.sums, "sums");
    expect_same_bytes(a.last, b.last, "last");
    expect_same_bytes(a.maxima, b.maxima, "maxima");
}

several_results results_of(vp::cuda_backend& be, several& fb, const vp::status& s) {
    EXPECT_TRUE(s.ok()) << s.message();
    return {s.counts, vp::get<0>(fb).to_host(be), vp::get<2>(fb).to_host(be), vp::get<1>(fb).to_host(be),
            vp::get<3>(fb).to_host(be)};
}

template <class Selector>
several_results with(const mesh_data& m, const vp::grid& g, vp::coverage rule, vp::cuda_backend be = {}) {
    be.strategy = vp::strategy::tiled;
    const vp::mesh mesh{be, m.positions, m.triangles};
    several fb{be, g.extent};
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, several_values>;
    const draw_type d{mesh.view(), {}, {}};
    const vp::status s = be.run<Selector>(std::span<const draw_type>(&d, 1), g, fb.view(), vp::voxelize_options{rule},
                                          m.triangles.size());
    return results_of(be, fb, s);
}

TEST(Invariance, ThePolicyDoesNotChangeTheResult) {
    mesh_data m = mixed_triangles(4000, 60.0f, 91);
    add_triangle(m, {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 150.0f}, {-300.0f, 500.0f, 60.0f});
    const vp::grid g = box_grid({61, 50, 67});
    for (const vp::coverage rule : both_rules) {
        const several_results expected = with<vp::tuning::fine_raster_selector>(m, g, rule);
        expect_same_results(expected, with<fixed_policy<32, 3, 1>>(m, g, rule));
        expect_same_results(expected, with<fixed_policy<128, 3, 4>>(m, g, rule));
        expect_same_results(expected, with<fixed_policy<512, 4, 1>>(m, g, rule));
        expect_same_results(expected, with<fixed_policy<512, 4, 1, 1>>(m, g, rule));
    }
}

// Only bits, for which a tile can have any size.
struct bits_of_some {
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        return vp::outputs(f.primitive % 3 != 0);
    }
};
template <class Selector>
std::vector<std::uint32_t> bits_with(const mesh_data& m, const vp::grid& g, vp::coverage rule) {
    vp::cuda_backend be;
    be.strategy = vp::strategy::tiled;
    const vp::mesh mesh{be, m.positions, m.triangles};
    vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_xor>> fb{be, g.extent};
    const vp::draw<vp::mesh_view<>, vp::passthrough, bits_of_some> d{mesh.view(), {}, {}};
    const vp::status s =
        be.run<Selector>(std::span(&d, 1), g, fb.view(), vp::voxelize_options{rule}, m.triangles.size());
    EXPECT_TRUE(s.ok()) << s.message();
    return vp::get<0>(fb).to_host(be);
}

TEST(Invariance, TheTileSizeOfBitsDoesNotChangeTheResult) {
    mesh_data m = mixed_triangles(4000, 60.0f, 17);
    add_triangle(m, {-300.0f, -300.0f, -10.0f}, {500.0f, -300.0f, 150.0f}, {-300.0f, 500.0f, 60.0f});
    const vp::grid g = box_grid({61, 50, 67});
    for (const vp::coverage rule : both_rules) {
        const std::vector<std::uint32_t> expected = bits_with<vp::tuning::fine_raster_selector>(m, g, rule);
        expect_same_bytes(expected, bits_with<fixed_policy<128, 3, 4>>(m, g, rule), "tiles of 8^3");
        expect_same_bytes(expected, bits_with<fixed_policy<512, 4, 1>>(m, g, rule), "tiles of 16^3");
        expect_same_bytes(expected, bits_with<fixed_policy<256, 5, 2>>(m, g, rule), "tiles of 32^3");
        EXPECT_NE(std::count(expected.begin(), expected.end(), 0u), static_cast<std::ptrdiff_t>(expected.size()));
    }
}

// Small tiles for the code of one architecture, larger ones for all others.
template <int Capability>
struct small_tiles_for {
    constexpr vp::tuning::fine_raster_policy operator()(int bits, int capability) const {
        return capability == Capability ? fixed_policy<32, 3, 1>{}(bits) : fixed_policy<512, 4, 1>{}(bits);
    }
};

__global__ void any_kernel() {}

// The compute capability whose code the current device runs, reported by the code itself.
int running_capability() {
    cudaFuncAttributes attributes{};
    EXPECT_EQ(cudaFuncGetAttributes(&attributes, any_kernel), cudaSuccess);
    return attributes.ptxVersion;
}

struct policy_run {
    several_results results;
    std::size_t bytes; // of all allocations; the workspace depends on the tile's size
};
template <class Selector>
policy_run measure(const mesh_data& m, const vp::grid& g) {
    resources::async_form counted;
    policy_run r{with<Selector>(m, g, vp::coverage::conservative, vp::cuda_backend{nullptr, counted}), 0};
    r.bytes = counted.total;
    return r;
}

TEST(Invariance, TheSelectorIsAskedForTheArchitectureThatRuns) {
    const mesh_data m = mixed_triangles(60, 60.0f, 93); // few, so that the memory of the first attempt suffices
    const vp::grid g = box_grid({61, 50, 67});
    const policy_run small = measure<fixed_policy<32, 3, 1>>(m, g), large = measure<fixed_policy<512, 4, 1>>(m, g);
    ASSERT_NE(small.bytes, large.bytes);
    int times_small = 0;
    const auto expect_own = [&]<int Capability>(std::integral_constant<int, Capability>) {
        const policy_run r = measure<small_tiles_for<Capability>>(m, g);
        const bool runs = Capability == running_capability();
        times_small += runs;
        EXPECT_EQ(r.bytes, runs ? small.bytes : large.bytes) << Capability;
        expect_same_results(small.results, r.results);
    };
    [&]<std::size_t... I>(std::index_sequence<I...>) {
        (expect_own(std::integral_constant<int, vp::tuning::compiled_architectures()[I].capability>{}), ...);
    }
    (std::make_index_sequence<vp::tuning::compiled_architectures().size()>{});
    EXPECT_EQ(times_small, 1);
    EXPECT_EQ(measure<small_tiles_for<0>>(m, g).bytes, large.bytes); // no such architecture
}

// ---- order of calls, other work
// ----------------------------------------------------------------------------------------------

__global__ void keep_busy(unsigned long long cycles, unsigned* sink) {
    const long long start = clock64();
    unsigned n = threadIdx.x;
    while (static_cast<unsigned long long>(clock64() - start) < cycles) n = n * 1664525u + 1013904223u;
    if (n == 0) *sink = n;
}

// Other kernels occupy a changing part of the device, so that blocks start at other times and in another order.
TEST(Invariance, OtherWorkOnTheDeviceDoesNotChangeTheResult) {
    const mesh_data m = mixed_triangles(60000, 100.0f, 92);
    const vp::grid g = box_grid({100, 90, 110});
    cudaStream_t other = nullptr;
    ASSERT_EQ(cudaStreamCreateWithFlags(&other, cudaStreamNonBlocking), cudaSuccess);
    unsigned* sink = nullptr;
    ASSERT_EQ(cudaMalloc(&sink, sizeof(unsigned)), cudaSuccess);
    cudaStream_t own = nullptr;
    ASSERT_EQ(cudaStreamCreateWithFlags(&own, cudaStreamNonBlocking), cudaSuccess);
    {
        vp::cuda_backend be{own};
        const vp::mesh mesh{be, m.positions, m.triangles};
        several fb{be, g.extent};
        const auto draw = [&] {
            const vp::status s = vp::voxelize(be, mesh, g, vp::passthrough{}, several_values{}, fb);
            return results_of(be, fb, s);
        };
        const several_results expected = draw();
        for (int round = 0; round < 12; ++round) {
            for (int i = 0; i < 8; ++i)
                (void)::emulation::launch([=](const auto&... a) { keep_busy(a...); }, 1 + 37 * ((round + i) % 7), 64 << (round % 4), 0, other, 200000u << (i % 3), sink);
            expect_same_results(expected, draw());
            if (HasFailure()) break;
        }
    }
    EXPECT_EQ(cudaStreamSynchronize(other), cudaSuccess);
    cudaFree(sink);
    cudaStreamDestroy(other);
    cudaStreamDestroy(own);
}

// A mesh in parts. Each call draws one part and loads the targets. Order-free blends give the result of a single call
// in any order of the parts.
TEST(Invariance, CallsInAnyOrderGiveOneResult) {
    const mesh_data m = mixed_triangles(8000, 60.0f, 93);
    const vp::grid g = box_grid({61, 50, 67});
    using targets = vp::framebuffer<vp::cuda_backend, vp::target<vp::bit, blend::bit_xor>,
                                    vp::target<std::uint32_t, blend::add>, vp::target<std::int16_t, blend::min>>;
    const auto shader = vp::constant(true, 3u, std::int16_t{-5});
    constexpr std::size_t num_parts = 5;
    const auto run = [&](const std::vector<std::size_t>& order) {
        vp::cuda_backend be;
        targets fb{be, g.extent};
        for (const std::size_t part : order) {
            std::vector<glm::uvec3> triangles;
            for (std::size_t t = 0; t < m.triangles.size(); ++t)
                if (order.size() == 1 || t % num_parts == part) triangles.push_back(m.triangles[t]);
            const vp::mesh mesh{be, m.positions, triangles};
            EXPECT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, shader, fb).ok());
            vp::core::for_each_index<3>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
        }
        return std::tuple{vp::get<0>(fb).to_host(be), vp::get<1>(fb).to_host(be), vp::get<2>(fb).to_host(be)};
    };
    const auto expected = run({0});
    std::vector<std::size_t> order(num_parts);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::mt19937 random(94);
    for (int i = 0; i < 6; ++i) {
        const auto actual = run(order);
        expect_same_bytes(std::get<0>(expected), std::get<0>(actual), "bits");
        expect_same_bytes(std::get<1>(expected), std::get<1>(actual), "sums");
        expect_same_bytes(std::get<2>(expected), std::get<2>(actual), "minima");
        std::shuffle(order.begin(), order.end(), random);
    }
}

} // namespace
