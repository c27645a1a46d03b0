// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the GPU tests: generated meshes, the benchmark scenes if present, and expect_same, which runs one call on
// cpu_backend and on cuda_backend and compares every byte of the results and every counter.

#include <cpu_ref/backend.hpp>
#include <voxelpipe/device/surface_calls.cuh>
#include <voxelpipe/voxelpipe.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <random>
#include <string>
#include <vector>

namespace device_test {

namespace vp = voxelpipe;

struct mesh_data {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
};

inline void add_triangle(mesh_data& m, glm::vec3 a, glm::vec3 b, glm::vec3 c) {
    const auto n = static_cast<std::uint32_t>(m.positions.size());
    m.positions.insert(m.positions.end(), {a, b, c});
    m.triangles.emplace_back(n, n + 1, n + 2);
}

// Long thin triangles across a grid and slightly beyond: large bounding boxes and few fragments. A third have a short
// side of about 20 voxels.
inline mesh_data long_triangles(glm::ivec3 extent, int count, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(-0.1f, 1.1f);
    mesh_data m;
    for (int i = 0; i < count; ++i) {
        const auto vector = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
        const glm::vec3 a = vector() * glm::vec3(extent), b = vector() * glm::vec3(extent);
        add_triangle(m, a, b, i % 3 == 0 ? a + 30.0f * vector() : b + 1.0f);
    }
    return m;
}

// Triangles of every size from a hundredth of a voxel to beyond the grid, in a grid of `size` voxels at the origin;
// among them some on voxel faces, zero-area ones, NaN, infinite, far away and outside.
inline mesh_data mixed_triangles(int count, float size, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    mesh_data m;
    for (int i = 0; i < count; ++i) {
        const glm::vec3 centre(unit(random) * size, unit(random) * size, unit(random) * size);
        const float extent = 0.01f * std::pow(size * 150.0f, unit(random) * unit(random));
        const auto point = [&] {
            glm::vec3 p = centre;
            for (int a = 0; a < 3; ++a) p[a] += (unit(random) - 0.5f) * extent;
            if (i % 7 == 0)
                for (int a = 0; a < 3; ++a) p[a] = std::round(p[a]);
            return p;
        };
        glm::vec3 a = point(), b = point(), c = point();
        switch (i % 97) {
        case 3:
            b = a;
            break;
        case 5:
            b = a;
            c = a;
            break;
        case 11:
            c = a + (b - a) * 0.5f;
            break;
        case 13:
            b.x = std::numeric_limits<float>::quiet_NaN();
            break;
        case 17:
            c.y = std::numeric_limits<float>::infinity();
            break;
        case 19:
            a.z = 1e30f;
            break;
        case 23:
            for (glm::vec3* p : {&a, &b, &c}) p->x += 3.0f * size;
            break;
        case 29:
            c.x += 40.0f * size;
            break; // wide path
        case 31:
            b.y = b.y - 2000.0f * size;
            break;
        default:
            break;
        }
        add_triangle(m, a, b, c);
    }
    return m;
}

// Triangles of some voxels in a grid, all at its lower or all at its upper faces.
inline mesh_data triangles_at_faces(glm::ivec3 extent, int count, bool upper, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    mesh_data m;
    for (int i = 0; i < count; ++i) {
        const int axis = i % 3;
        glm::vec3 centre(unit(random), unit(random), unit(random));
        centre *= glm::vec3(extent);
        centre[axis] = upper ? static_cast<float>(extent[axis]) - 2.0f * unit(random) : 2.0f * unit(random);
        const auto point = [&] {
            glm::vec3 p = centre;
            for (int a = 0; a < 3; ++a) p[a] += (unit(random) - 0.5f) * (a == axis ? 3.0f : 8.0f);
            return glm::clamp(p, glm::vec3(0.01f), glm::vec3(extent) - 0.01f);
        };
        add_triangle(m, point(), point(), point());
    }
    return m;
}

// A mesh finer than a grid of about 46 voxels a side. One triangle in `step` (0: none) is up to `longest` voxels long
// and one or two wide; some of these have no area, and some lie outside the grid. If the long ones are few and short,
// blocks of a first kernel draw them at their end (direct_raster.cuh).
inline mesh_data fine_triangles(int count, int step, float longest) {
    mesh_data m;
    for (int i = 0; i < count; ++i) {
        const glm::vec3 corner(0.9f * static_cast<float>(i % 50), 0.37f * static_cast<float>(i / 50 % 120),
                               0.53f * static_cast<float>(i % 83));
        const bool is_long = step != 0 && i % step == 0;
        const float size = is_long ? longest * (0.5f + 0.125f * static_cast<float>(i / step % 5)) : 0.7f;
        const int axis = i % 3;
        glm::vec3 along(0.1f), across(0.4f);
        along[axis] = size;
        across[(axis + 1) % 3] = is_long ? 1.2f : 0.7f;
        const bool is_flat = is_long && i / step % 6 == 5;
        add_triangle(m, corner, corner + along, is_flat ? corner + 0.5f * along : corner + across);
    }
    return m;
}

inline mesh_data translated(mesh_data m, glm::vec3 by) {
    for (glm::vec3& p : m.positions) p += by;
    return m;
}

inline void append(mesh_data& m, const mesh_data& more) {
    const auto first = static_cast<std::uint32_t>(m.positions.size());
    m.positions.insert(m.positions.end(), more.positions.begin(), more.positions.end());
    for (const glm::uvec3& t : more.triangles) m.triangles.push_back(t + glm::uvec3(first));
}

// A vertex shader whose positions are stored before the raster.
struct shift {
    float by;
    template <class Vertex>
    VOXELPIPE_HD glm::vec3 operator()(const Vertex& v) const {
        return glm::vec3(vp::exact::add(v.position.x, by), v.position.y, v.position.z);
    }
};

inline vp::grid box_grid(glm::ivec3 extent) {
    vp::grid g;
    g.extent = extent;
    return g;
}

// A scene by name (VPM file in VOXELPIPE_VPM_DIR); empty if absent.
inline mesh_data load_scene(const std::string& name) {
    mesh_data m;
    const char* const folder = std::getenv("VOXELPIPE_VPM_DIR");
    if (folder == nullptr) return m;
    std::ifstream in(std::string(folder) + "/" + name + ".vpm", std::ios::binary);
    char magic[8];
    std::uint32_t counts[2];
    if (!in.read(magic, 8) || std::memcmp(magic, "VPMESH1", 8) != 0) return m;
    in.read(reinterpret_cast<char*>(counts), 8);
    m.positions.resize(counts[0]);
    m.triangles.resize(counts[1]);
    in.read(reinterpret_cast<char*>(m.positions.data()), static_cast<std::streamsize>(sizeof(glm::vec3) * counts[0]));
    in.read(reinterpret_cast<char*>(m.triangles.data()), static_cast<std::streamsize>(sizeof(glm::uvec3) * counts[1]));
    return in ? m : mesh_data{};
}

inline void expect_same_counts(const vp::counters& a, const vp::counters& b) {
    EXPECT_EQ(a.triangles_in, b.triangles_in);
    EXPECT_EQ(a.triangles_nonfinite, b.triangles_nonfinite);
    EXPECT_EQ(a.triangles_too_far, b.triangles_too_far);
    EXPECT_EQ(a.triangles_zero_area, b.triangles_zero_area);
    EXPECT_EQ(a.triangles_outside, b.triangles_outside);
    EXPECT_EQ(a.triangles_drawn, b.triangles_drawn);
    EXPECT_EQ(a.fragments, b.fragments);
    EXPECT_EQ(a.fragments_discarded, b.fragments_discarded);
    EXPECT_EQ(a.voxels, b.voxels);
}

// Reports the first element that differs.
template <class T>
void expect_same_bytes(const std::vector<T>& cpu, const std::vector<T>& gpu, const char* what) {
    ASSERT_EQ(cpu.size(), gpu.size()) << what;
    if (cpu.empty() || std::memcmp(cpu.data(), gpu.data(), cpu.size() * sizeof(T)) == 0) return;
    std::size_t differing = 0, first = 0;
    for (std::size_t i = 0; i < cpu.size(); ++i)
        if (std::memcmp(&cpu[i], &gpu[i], sizeof(T)) != 0 && differing++ == 0) first = i;
    const auto hex = [](const T& v) {
        std::string text;
        const auto* const raw = reinterpret_cast<const unsigned char*>(&v);
        for (std::size_t i = sizeof(T); i-- > 0;) {
            static const char digits[] = "0123456789abcdef";
            text += {digits[raw[i] / 16], digits[raw[i] % 16]};
        }
        return text;
    };
    ADD_FAILURE() << what << ": " << differing << " of " << cpu.size() << " elements differ, first " << first
                  << ": cpu " << hex(cpu[first]) << ", gpu " << hex(gpu[first]);
}

// Start of the targets: cleared to their blends' identities, or loaded with a byte pattern that an earlier call drew.
enum class start { clear, load };

// The options of a call, or a coverage in their place, as voxelize takes them.
struct call_options : vp::voxelize_options {
    call_options() = default;
    call_options(vp::coverage rule_, bool count_voxels_ = true) // NOLINT(*-explicit-*)
        : vp::voxelize_options{rule_, count_voxels_} {}
    call_options(const vp::voxelize_options& o) : vp::voxelize_options(o) {} // NOLINT(*-explicit-*)
};

// True if calls know that a mesh's indices have been checked.
enum class indices { checked, unknown };

template <class Backend>
vp::mesh_view<> view_of(const vp::mesh<Backend>& mesh, indices known) {
    vp::mesh_view<> v = mesh.view();
    if (known == indices::unknown) v.checked = {};
    return v;
}

template <class Backend, class... Targets, class VertexShader, class FragmentShader>
vp::status draw_framebuffer(Backend& backend, vp::framebuffer<Backend, Targets...>& fb, const mesh_data& m,
                            const vp::grid& g, const VertexShader& vs, const FragmentShader& fs,
                            const call_options& options, start how, indices known = indices::checked) {
    const vp::mesh<Backend> mesh(backend, m.positions, m.triangles);
    const vp::mesh_view<> view = view_of(mesh, known);
    vp::status s = vp::voxelize(backend, view, g, vs, fs, fb, options);
    if (!s.ok() || how == start::clear) return s;
    vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() { vp::get<I>(fb).load(); });
    return vp::voxelize(backend, view, g, vs, fs, fb, options);
}

template <class... Targets, class VertexShader, class FragmentShader>
void expect_same(const mesh_data& m, const vp::grid& g, const VertexShader& vs, const FragmentShader& fs,
                 call_options options, start how = start::clear) {
    vp::cpu_backend cpu;
    vp::framebuffer<vp::cpu_backend, Targets...> a{cpu, g.extent};
    const vp::status sa = draw_framebuffer(cpu, a, m, g, vs, fs, options, how);
    // Constants are mostly drawn without lists and tiles, and by other kernels if indices must be checked.
    constexpr bool constant = vp::core::is_constant<FragmentShader>;
    for (const bool first : {true, false}) {
        SCOPED_TRACE(constant ? first ? "indices checked" : "indices unknown"
                     : first  ? "fragments listed, where they can be"
                              : "in tiles");
        vp::cuda_backend gpu;
        if (!constant && !first) gpu.strategy = vp::strategy::tiled;
        vp::framebuffer<vp::cuda_backend, Targets...> b{gpu, g.extent};
        const vp::status sb = draw_framebuffer(gpu, b, m, g, vs, fs, options, how,
                                               constant && !first ? indices::unknown : indices::checked);
        ASSERT_EQ(sa.code, sb.code) << sb.message();
        expect_same_counts(sa.counts, sb.counts);
        vp::core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            const std::string what = "target " + std::to_string(I);
            expect_same_bytes(vp::get<I>(a).to_host(cpu), vp::get<I>(b).to_host(gpu), what.c_str());
        });
    }
}

// Targets of several tests, named once, because each set of targets and shaders compiles its own kernels.
template <class... Targets>
struct target_list {
    template <class Backend>
    using framebuffer = vp::framebuffer<Backend, Targets...>;
};

template <class... Targets, class... Arguments>
void expect_same(target_list<Targets...>, const Arguments&... arguments) {
    expect_same<Targets...>(arguments...);
}

// Lists that were copied to the host.
template <class Payload>
void expect_same_on_host(const vp::host_abuffer<Payload>& a, const vp::host_abuffer<Payload>& b) {
    EXPECT_EQ(a.extent, b.extent);
    expect_same_bytes(a.voxels, b.voxels, "voxels");
    expect_same_bytes(a.offsets, b.offsets, "offsets");
    expect_same_bytes(a.primitives, b.primitives, "primitives");
    if constexpr (!std::is_void_v<Payload>) expect_same_bytes(a.payloads, b.payloads, "payloads");
}

template <class Payload, class VertexShader, class FragmentShader>
void expect_same_lists(const mesh_data& m, const vp::grid& g, const VertexShader& vs, const FragmentShader& fs,
                       call_options options) {
    vp::cpu_backend cpu;
    vp::cuda_backend gpu;
    vp::abuffer<vp::cpu_backend, Payload> a{cpu};
    vp::abuffer<vp::cuda_backend, Payload> b{gpu};
    vp::mesh<vp::cpu_backend> ma(cpu, m.positions, m.triangles);
    vp::mesh<vp::cuda_backend> mb(gpu, m.positions, m.triangles);
    const vp::status sa = vp::voxelize(cpu, ma, g, vs, fs, a, options);
    const vp::status sb = vp::voxelize(gpu, mb, g, vs, fs, b, options);
    ASSERT_EQ(sa.code, sb.code) << sb.message();
    expect_same_counts(sa.counts, sb.counts);
    expect_same_on_host(a.to_host(cpu), b.to_host(gpu));
}

// Counts live bytes, and refuses allocations beyond `limit`.
struct counting_resource {
    std::size_t live = 0, limit = std::size_t{1} << 40; // bytes
    int calls = 0;
    void* allocate_async(std::size_t bytes, std::size_t, cudaStream_t stream) {
        void* p = nullptr;
        if (live + bytes > limit || cudaMallocAsync(&p, bytes, stream) != cudaSuccess) throw std::bad_alloc();
        live += bytes;
        ++calls;
        return p;
    }
    void deallocate_async(void* p, std::size_t bytes, std::size_t, cudaStream_t stream) {
        cudaFreeAsync(p, stream);
        live -= bytes;
    }
};

struct stream_owner {
    cudaStream_t stream = nullptr;
    stream_owner() { cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking); }
    stream_owner(const stream_owner&) = delete;
    stream_owner& operator=(const stream_owner&) = delete;
    ~stream_owner() { cudaStreamDestroy(stream); }
};

// Stage times do not change the result. They are parts of the call's time, and a call without them does not write them.
template <class Call>
vp::stage_times time_stages(vp::cuda_backend& be, const Call& call) {
    cudaEvent_t begin = nullptr, end = nullptr;
    EXPECT_EQ(cudaEventCreate(&begin), cudaSuccess);
    EXPECT_EQ(cudaEventCreate(&end), cudaSuccess);
    vp::stage_times times;
    be.times = &times;
    EXPECT_EQ(cudaEventRecord(begin, be.stream), cudaSuccess);
    const vp::status s = call();
    EXPECT_EQ(cudaEventRecord(end, be.stream), cudaSuccess);
    EXPECT_EQ(cudaEventSynchronize(end), cudaSuccess);
    be.times = nullptr;
    EXPECT_TRUE(s.ok()) << s.message();
    float whole = 0;
    EXPECT_EQ(cudaEventElapsedTime(&whole, begin, end), cudaSuccess);
    for (const auto& [name, field] : vp::stage_time_fields) EXPECT_GE(times.*field, 0.0) << name;
    EXPECT_GT(vp::sum_of(times), 0.0);
    EXPECT_LE(vp::sum_of(times), whole + 0.01); // events have a resolution of half a microsecond
    const vp::stage_times before = times;
    EXPECT_TRUE(call().ok());
    EXPECT_EQ(before, times);
    cudaEventDestroy(begin);
    cudaEventDestroy(end);
    return times;
}

inline constexpr vp::coverage both_rules[] = {vp::coverage::thin, vp::coverage::conservative};
inline constexpr vp::coverage every_coverage[] = {vp::coverage::thin, vp::coverage::conservative,
                                                  vp::coverage::crosshair, vp::coverage::diagonal};

} // namespace device_test
