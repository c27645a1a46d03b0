// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Framebuffers that track their changes: after any sequence of calls they hold the bytes of a CPU framebuffer without
// tracking, and clears write only chunks that were drawn into.

#include "device_test.hpp"

#include <gtest/gtest.h>

#include <array>
#include <span>

namespace {

using namespace device_test;
namespace blend = voxelpipe::blend;

enum class before { clear, load, off };

// A call of a sequence: its mesh and how it is drawn. Meshes differ in position.
struct sequence_step {
    before targets[2];
    float clear_value;
    int mesh;
    float value;            // of constant shaders
    bool varies = false;    // a shader that computes
    bool is_listed = true;  // a computing shader by lists; in tiles, fragments are not marked
    bool fails = false;     // an index out of range
    bool elsewhere = false; // other code has written the memory before, and the framebuffer is told
    bool nothing = false;   // a mesh without triangles: a clear alone
};

// Small and large triangles in a part of the grid that differs by the number.
mesh_data sequence_mesh(const glm::ivec3& extent, int number) {
    mesh_data m = mixed_triangles(600, 40.0f, 17 + static_cast<std::uint32_t>(number));
    append(m, long_triangles(extent / 3, 12, 23 + static_cast<std::uint32_t>(number)));
    const glm::vec3 room = glm::vec3(extent) * 0.6f;
    return translated(m, room * glm::vec3(number % 2, number / 2 % 2, number % 3 == 0 ? 1 : 0));
}

// Two targets, their clear values and shaders, named by the way in which they are drawn.
struct by_atomics { // in place by atomics, or counted
    using first = vp::target<float, blend::add>;
    using second = vp::target<std::uint32_t, blend::add>;
    static auto constant(float v) { return vp::constant(v, 3u); }
    struct shader {
        float scale;
        VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
            return vp::outputs(scale * static_cast<float>(f.primitive % 8), f.primitive);
        }
    };
    static auto cleared(float v) { return std::pair(v, static_cast<std::uint32_t>(v)); }
};
struct by_occupancy_mask { // constants by an occupancy mask; computed fragments by lists
    using first = vp::target<float, blend::replace>;
    using second = vp::target<glm::vec3, blend::max, vp::layout::planar>;
    static auto constant(float v) { return vp::constant(v, glm::vec3(v, 1, 2)); }
    struct shader {
        float scale;
        VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
            const float v = scale * static_cast<float>(f.primitive % 8);
            return vp::outputs(v, glm::vec3(v, -v, 1));
        }
    };
    static auto cleared(float v) { return std::pair(v, glm::vec3(v, v, -v)); }
};
struct by_touched_vectors { // the same with 12 and 16 bytes a voxel
    using first = vp::target<glm::vec3, blend::min>;
    using second = vp::target<glm::dvec2, blend::replace>;
    static auto constant(float v) { return vp::constant(glm::vec3(v, -1, 2), glm::dvec2(v, 0.3)); }
    struct shader {
        float scale;
        VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
            const float v = scale * static_cast<float>(f.primitive % 8);
            return vp::outputs(glm::vec3(v, -v, 1), glm::dvec2(v, -2));
        }
    };
    static auto cleared(float v) { return std::pair(glm::vec3(v, v, -v), glm::dvec2(-v, v)); }
};
struct hash_chain {
    static constexpr bool order_free = false;
    VOXELPIPE_HD std::uint32_t identity() const { return 7; }
    VOXELPIPE_HD std::uint32_t combine(std::uint32_t a, std::uint32_t b) const { return (a ^ b) * 16777619u; }
};
struct in_order { // lists that are folded; with bits of unknown state
    using first = vp::target<std::uint32_t, hash_chain>;
    using second = vp::target<vp::bit, blend::bit_or>;
    static auto constant(float v) { return vp::constant(static_cast<std::uint32_t>(8 * v), true); }
    struct shader {
        float scale;
        VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
            return vp::outputs(f.primitive, true).discard_if(f.primitive % 5 == 0);
        }
    };
    static auto cleared(float v) { return std::pair(static_cast<std::uint32_t>(v), false); }
};

template <class Backend, class Kind>
class sequence {
public:
    explicit sequence(const glm::ivec3& extent) : fb_{backend_, extent}, grid_(box_grid(extent)) {
        for (int i = 0; i < num_meshes; ++i) {
            mesh_data m = sequence_mesh(extent, i);
            meshes_.emplace_back(backend_, m.positions, m.triangles);
            m.triangles[m.triangles.size() / 2].y = static_cast<std::uint32_t>(m.positions.size());
            broken_.emplace_back(backend_, m.positions, m.triangles);
        }
    }
    vp::status run(const sequence_step& s) {
        const auto begin = [&](auto&& target, before how, const auto& value) {
            if (how == before::clear)
                target.clear(value);
            else if (how == before::load)
                target.load();
            else
                target.off();
        };
        const auto cleared = Kind::cleared(s.clear_value);
        begin(vp::get<0>(fb_), s.targets[0], cleared.first);
        begin(vp::get<1>(fb_), s.targets[1], cleared.second);
        if constexpr (std::is_same_v<Backend, vp::cuda_backend>)
            backend_.strategy = s.varies && !s.is_listed ? vp::strategy::tiled : vp::strategy::automatic;
        const auto& mesh = s.nothing ? empty_ : (s.fails ? broken_ : meshes_)[static_cast<std::size_t>(s.mesh)];
        const vp::voxelize_options options{s.mesh < 3 ? vp::coverage::conservative : vp::coverage::thin,
                                           s.mesh % 2 == 0};
        if (s.varies)
            return vp::voxelize(backend_, mesh, grid_, vp::passthrough{}, typename Kind::shader{s.value}, fb_, options);
        return vp::voxelize(backend_, mesh, grid_, vp::passthrough{}, Kind::constant(s.value), fb_, options);
    }
    Backend& backend() { return backend_; }
    auto& framebuffer() { return fb_; }

    static constexpr int num_meshes = 4;

private:
    Backend backend_;
    vp::framebuffer<Backend, typename Kind::first, typename Kind::second> fb_;
    vp::grid grid_;
    std::vector<vp::mesh<Backend>> meshes_, broken_;
    vp::mesh<Backend> empty_{backend_, std::vector<glm::vec3>{}, std::vector<glm::uvec3>{}};
};

constexpr auto C = before::clear, L = before::load, O = before::off;
const sequence_step steps[] = {
    {{C, C}, 0, 0, 1},
    {{C, C}, 0, 1, 1}, // nothing of the previous mesh may remain
    {{L, L}, 0, 2, 1},
    {{C, C}, 0, 1, 1},
    {{C, C}, 2, 0, 1}, // another clear value: everything is cleared
    {{C, C}, 2, 3, 1},
    {{C, L}, 2, 1, 1}, // both targets share the marks
    {{C, C}, 2, 2, 1},
    {{O, C}, 2, 0, 1},
    {{C, C}, 2, 3, 1},
    {{C, O}, 0, 1, 1},
    {{L, C}, 0, 3, 1},
    {{C, C}, 0, 0, 0.1f}, // sums are counted, by the marks of the framebuffer
    {{C, C}, 0, 2, 0.1f},
    {{C, C}, 0, 1, 1},
    {{C, C}, 5, 0, 0.1f}, // counted; the last pass writes voxels that are not drawn
    {{C, C}, 0, 3, 1},
    {{C, C}, 0, 0, 1, true},
    {{C, C}, 0, 1, 1, true},
    {{L, L}, 0, 2, 1, true},
    {{C, C}, 0, 0, 1},
    {{C, C}, 0, 3, 1, true, false}, // drawn without marks
    {{C, C}, 0, 0, 1},
    {{L, L}, 0, 1, 1, true, false},
    {{C, C}, 0, 2, 1},
    {{C, C}, 0, 1, 1, false, true, true}, // the call fails, nothing changes
    {{C, C}, 0, 1, 1, true, true, true},
    {{C, C}, 0, 3, 1},
    {{C, C}, 0, 0, 1, false, true, false, true}, // the marks are forgotten
    {{C, C}, 0, 1, 1},
    {{C, C}, 0, 0, 1, false, true, false, false, true}, // clears alone, to the same value
    {{C, C}, 0, 1, 1},
    {{C, C}, 3, 0, 1, false, true, false, false, true}, // to another: what the marks said before holds no longer
    {{C, C}, 0, 2, 1},
    {{L, C}, 4, 0, 1, false, true, false, false, true},
    {{C, C}, 0, 3, 1},
};

template <class Kind>
void expect_same_sequences(const glm::ivec3& extent) {
    ASSERT_GE(sizeof(typename Kind::first::value_type) * static_cast<std::size_t>(extent.x) *
                  static_cast<std::size_t>(extent.y) * static_cast<std::size_t>(extent.z),
              vp::tuning::marked_bytes);
    sequence<vp::cpu_backend, Kind> expected(extent);
    sequence<vp::cuda_backend, Kind> tracked(extent);
    tracked.framebuffer().track_changes(tracked.backend());
    int number = 0;
    for (const sequence_step& s : steps) {
        SCOPED_TRACE("call " + std::to_string(number++));
        auto& fb = tracked.framebuffer();
        if (s.elsewhere) {
            ASSERT_EQ(cudaMemset(vp::get<0>(fb).view().elements, 0x55, std::size_t{1} << 20), cudaSuccess);
            fb.forget_changes(tracked.backend());
        }
        const vp::status a = expected.run(s), b = tracked.run(s);
        ASSERT_EQ(a.code, b.code) << b.message();
        expect_same_counts(a.counts, b.counts);
        auto& host = expected.framebuffer();
        expect_same_bytes(vp::get<0>(host).to_host(expected.backend()), vp::get<0>(fb).to_host(tracked.backend()),
                          "first target");
        expect_same_bytes(vp::get<1>(host).to_host(expected.backend()), vp::get<1>(fb).to_host(tracked.backend()),
                          "second target");
        if (testing::Test::HasFailure()) return;
    }
}

// Rows with and without 16-byte access, and rows of more than one word of marks.
TEST(TrackedChanges, SequencesByAtomicsLeaveTheCpusBytes) { expect_same_sequences<by_atomics>({256, 160, 206}); }
TEST(TrackedChanges, SequencesByAtomicsInOddRowsLeaveTheCpusBytes) {
    expect_same_sequences<by_atomics>({203, 211, 197});
}
TEST(TrackedChanges, SequencesByAtomicsInLongRowsLeaveTheCpusBytes) {
    expect_same_sequences<by_atomics>({1060, 95, 84});
}
TEST(TrackedChanges, SequencesByOccupancyMaskLeaveTheCpusBytes) {
    expect_same_sequences<by_occupancy_mask>({256, 160, 206});
}
TEST(TrackedChanges, SequencesByOccupancyMaskInOddRowsLeaveTheCpusBytes) {
    expect_same_sequences<by_occupancy_mask>({1061, 95, 84});
}
TEST(TrackedChanges, SequencesByOccupancyMaskOfVectorsLeaveTheCpusBytes) {
    expect_same_sequences<by_touched_vectors>({160, 131, 140});
}
TEST(TrackedChanges, SequencesInOrderLeaveTheCpusBytes) { expect_same_sequences<in_order>({203, 211, 197}); }

// A clear does not write chunks that no call has drawn into. So values that other code wrote there stay, unless the
// framebuffer is told.
TEST(TrackedChanges, ClearsOnlyWhatWasDrawn) {
    vp::cuda_backend be;
    const glm::ivec3 extent(256, 160, 206);
    const vp::grid g = box_grid(extent);
    vp::framebuffer<vp::cuda_backend, vp::target<float, blend::add>> fb{be, extent};
    fb.track_changes(be);
    mesh_data m;
    add_triangle(m, {40.5f, 20.5f, 30.5f}, {44.5f, 20.5f, 30.5f},
                 {40.5f, 25.5f, 33.5f}); // in a chunk, and in the next along y and z
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles);
    const auto draw = [&] { ASSERT_TRUE(vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(1.0f), fb).ok()); };
    const auto place = [&](int x, int y, int z) {
        return vp::get<0>(fb).view().elements +
               (static_cast<std::size_t>(z) * 160 + static_cast<std::size_t>(y)) * 256 + x;
    };
    const auto put = [&](int x, int y, int z) {
        ASSERT_EQ(cudaMemset(place(x, y, z), 0x41, sizeof(float)), cudaSuccess);
    };
    const auto has = [&](int x, int y, int z) {
        std::uint32_t bits = 0;
        EXPECT_EQ(cudaMemcpy(&bits, place(x, y, z), sizeof(bits), cudaMemcpyDeviceToHost), cudaSuccess);
        return bits == 0x41414141u;
    };
    put(63, 16, 24);
    put(64, 16, 24);
    draw();
    EXPECT_FALSE(has(63, 16, 24)); // the state was unknown
    EXPECT_FALSE(has(64, 16, 24));
    const auto emit_all = [&] {
        for (const glm::ivec3 v : {glm::ivec3(32, 16, 24), glm::ivec3(63, 31, 39), glm::ivec3(31, 20, 30),
                                   glm::ivec3(64, 20, 30), glm::ivec3(40, 15, 30), glm::ivec3(40, 20, 23)})
            put(v.x, v.y, v.z);
    };
    emit_all();
    draw();
    EXPECT_FALSE(has(32, 16, 24)); // the ends of the drawn chunks
    EXPECT_FALSE(has(63, 31, 39));
    EXPECT_TRUE(has(31, 20, 30)); // beside it
    EXPECT_TRUE(has(64, 20, 30));
    EXPECT_TRUE(has(40, 15, 30));
    EXPECT_TRUE(has(40, 20, 23));
    fb.forget_changes(be);
    draw();
    EXPECT_FALSE(has(31, 20, 30));
    EXPECT_FALSE(has(40, 20, 23));
}

// For every tracked way of drawing: a repeated call leaves voxels far from its triangles unchanged and clears those
// beside them. Without this test, clearing everything would give the same results.
template <class Kind, class Shader>
void expect_chunks_cleared(const Shader& shader, vp::coverage rule, const char* what) {
    SCOPED_TRACE(what);
    using first_type = typename Kind::first;
    static_assert(sizeof(typename first_type::value_type) == sizeof(std::uint32_t));
    vp::cuda_backend be;
    const glm::ivec3 extent(256, 160, 206);
    vp::framebuffer<vp::cuda_backend, first_type, typename Kind::second> fb{be, extent};
    fb.track_changes(be);
    // One of each size class: a voxel or two, a few, about ten, and one that is split.
    mesh_data m;
    for (const float size : {0.6f, 1.7f, 4.0f, 14.0f, 70.0f}) {
        const glm::vec3 at(110.3f, 84.2f, 100.4f);
        add_triangle(m, at, at + glm::vec3(size, 0.2f * size, 0.3f * size),
                     at + glm::vec3(0.1f * size, size, 0.4f * size));
    }
    const mesh_data moved = translated(m, glm::vec3(-90.0f, -70.0f, -90.0f));
    const vp::mesh<vp::cuda_backend> mesh(be, m.positions, m.triangles),
        elsewhere(be, moved.positions, moved.triangles);
    const auto draw = [&](const auto& which) {
        ASSERT_TRUE(vp::voxelize(be, which, box_grid(extent), vp::passthrough{}, shader, fb, {rule}).ok());
    };
    const auto place = [&](const glm::ivec3& v) {
        return reinterpret_cast<std::uint32_t*>(vp::get<0>(fb).view().elements) +
               (static_cast<std::size_t>(v.z) * 160 + static_cast<std::size_t>(v.y)) * 256 + v.x;
    };
    const glm::ivec3 beside(97, 81, 97); // in the same chunk as the first of them
    const glm::ivec3 far_ones[] = {{0, 0, 0},     {255, 159, 205}, {110, 84, 95}, {110, 79, 100},
                                   {95, 84, 100}, {20, 14, 10}}; // the last lies where the previous call drew
    draw(elsewhere);
    draw(elsewhere); // by now the number of fragments is known
    draw(mesh);
    const std::vector<typename first_type::element_type> expected = vp::get<0>(fb).to_host(be);
    const auto get = [&](const glm::ivec3& v) {
        std::uint32_t bits = 0;
        EXPECT_EQ(cudaMemcpy(&bits, place(v), sizeof(bits), cudaMemcpyDeviceToHost), cudaSuccess);
        return bits;
    };
    const auto put = [&](const glm::ivec3& v, std::uint32_t bits) {
        ASSERT_EQ(cudaMemcpy(place(v), &bits, sizeof(bits), cudaMemcpyHostToDevice), cudaSuccess);
    };
    const std::uint32_t cleared = get(far_ones[0]), other = 0x41414141;
    put(beside, other);
    for (const glm::ivec3& v : far_ones) put(v, other);
    draw(mesh);
    for (const glm::ivec3& v : far_ones) {
        EXPECT_EQ(get(v), other) << v.x << ' ' << v.y << ' ' << v.z;
        put(v, cleared);
    }
    expect_same_bytes(expected, vp::get<0>(fb).to_host(be), "all else");
}
template <class Kind>
void expect_chunks_cleared_of_all(bool counts) {
    for (const vp::coverage rule : {vp::coverage::thin, vp::coverage::conservative}) {
        expect_chunks_cleared<Kind>(Kind::constant(1.0f), rule, "a constant");
        if (counts) expect_chunks_cleared<Kind>(Kind::constant(0.1f), rule, "a constant that is counted");
        expect_chunks_cleared<Kind>(typename Kind::shader{0.5f}, rule, "a shader that computes");
    }
}
TEST(TrackedChanges, ClearsOnlyDrawnChunksByAtomics) { expect_chunks_cleared_of_all<by_atomics>(true); }
TEST(TrackedChanges, ClearsOnlyDrawnChunksByOccupancyMask) { expect_chunks_cleared_of_all<by_occupancy_mask>(false); }
TEST(TrackedChanges, ClearsOnlyDrawnChunksInOrder) { expect_chunks_cleared_of_all<in_order>(false); }

// Asynchronous calls captured in a graph. The device keeps the state between launches.
TEST(TrackedChanges, AGraphMayBeLaunchedAgain) {
    using target = vp::target<float, blend::add>;
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, vp::constant_output<float>>;
    const glm::ivec3 extent(256, 160, 206);
    const vp::grid g = box_grid(extent);
    const stream_owner owner;
    vp::cuda_backend be(owner.stream);
    vp::framebuffer<vp::cuda_backend, target> fb{be, extent};
    fb.track_changes(be);
    std::vector<vp::mesh<vp::cuda_backend>> meshes;
    std::vector<std::vector<float>> expected;
    for (int i = 0; i < 2; ++i) {
        const mesh_data m = sequence_mesh(extent, i);
        meshes.emplace_back(be, m.positions, m.triangles);
        vp::cpu_backend cpu;
        vp::framebuffer<vp::cpu_backend, target> a{cpu, extent};
        const vp::mesh<vp::cpu_backend> mesh(cpu, m.positions, m.triangles);
        ASSERT_TRUE(vp::voxelize(cpu, mesh, g, vp::passthrough{}, vp::constant(1.0f), a).ok());
        expected.push_back(vp::get<0>(a).to_host(cpu));
    }
    std::vector<cudaGraphExec_t> graphs;
    std::vector<void*> memory;
    for (const auto& mesh : meshes) {
        const draw_type d{mesh.view(), {}, vp::constant(1.0f)};
        const std::span<const draw_type> draws(&d, 1);
        const auto limits = vp::workspace_limits::for_triangles(mesh.view().triangles.size());
        const std::size_t bytes = vp::workspace_bytes(draws, g, fb.view(), {}, limits);
        ASSERT_EQ(cudaMalloc(&memory.emplace_back(nullptr), bytes), cudaSuccess);
        const vp::workspace_view workspace{memory.back(), bytes, limits};
        cudaGraph_t graph = nullptr;
        ASSERT_EQ(cudaStreamBeginCapture(owner.stream, cudaStreamCaptureModeGlobal), cudaSuccess);
        ASSERT_TRUE(vp::voxelize_async(be, draws, g, fb.view(), {}, workspace).ok());
        ASSERT_EQ(cudaStreamEndCapture(owner.stream, &graph), cudaSuccess);
        ASSERT_EQ(cudaGraphInstantiate(&graphs.emplace_back(nullptr), graph, 0), cudaSuccess);
        cudaGraphDestroy(graph);
    }
    for (const std::size_t which : {0, 1, 1, 0, 1}) {
        ASSERT_EQ(cudaGraphLaunch(graphs[which], owner.stream), cudaSuccess);
        expect_same_bytes(expected[which], vp::get<0>(fb).to_host(be), "sums");
    }
    for (cudaGraphExec_t graph : graphs) cudaGraphExecDestroy(graph);
    for (void* p : memory) cudaFree(p);
}

} // namespace
