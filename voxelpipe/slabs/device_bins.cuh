// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A mesh on one GPU, of whose triangles those stay that reach a slab.

#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::slabs::detail {

// What says which layers a triangle reaches.
struct bin_rule {
    core::snap_transform snap;
    glm::ivec3 extent;
    binning how;
};

// The triangles of a mesh as bin_rule sees them.
template <class Mesh, class VertexShader>
struct classifier {
    Mesh mesh;
    VertexShader shader;
    bin_rule by;

    [[nodiscard]] __device__ glm::vec3 position(std::uint32_t vertex) const {
        const auto result = shader(core::fetch_vertex(mesh, vertex, 0, 0));
        return core::vertex_result<std::remove_cvref_t<decltype(result)>>::widen(result).position;
    }
    [[nodiscard]] __device__ classified operator()(const glm::uvec3& t) const {
        const glm::vec3 at[3] = {position(t.x), position(t.y), position(t.z)};
        return by.how(by.snap, by.extent, at);
    }
};

// Words that a GPU counts into: triangles by class, triangles with a bad index, then those of a histogram.
inline constexpr std::size_t num_classes = 5, count_words = num_classes + 1;

template <class Mesh, class VertexShader>
struct layer_counter {
    classifier<Mesh, VertexShader> classes;
    std::uint64_t first; // triangle
    unsigned long long* words;

    __device__ void operator()(std::uint64_t i) const {
        const glm::uvec3 t = classes.mesh.triangles[first + i];
        const std::size_t n = classes.mesh.positions.size();
        if (t.x >= n || t.y >= n || t.z >= n) {
            atomicAdd(words + num_classes, 1ull);
            return;
        }
        const classified c = classes(t);
        atomicAdd(words + static_cast<int>(c.kind), 1ull);
        if (!classes.by.how.takes(c.kind) || c.reach.empty()) return;
        unsigned long long* axis = words + count_words;
        for (int a = 0; a < 3; ++a) {
            const int layers = a == 0 ? classes.by.extent.x : a == 1 ? classes.by.extent.y : classes.by.extent.z;
            atomicAdd(axis + c.reach.lo[a], 1ull);
            atomicAdd(axis + layers + c.reach.hi[a], 1ull);
            axis += 2 * layers;
        }
    }
};

// True if a triangle stays; the last flag, behind all triangles, is 0.
template <class Mesh, class VertexShader>
struct slab_chooser {
    classifier<Mesh, VertexShader> classes;
    int axis, begin, end; // layers
    std::uint64_t count;
    bool is_first_kept; // wherever it lies
    std::uint32_t* stays;

    __device__ void operator()(std::uint64_t i) const {
        bool reaches = false;
        if (i < count) {
            const classified c = classes(classes.mesh.triangles[i]);
            reaches =
                classes.by.how.takes(c.kind) && !c.reach.empty() && c.reach.lo[axis] < end && c.reach.hi[axis] >= begin;
            if (is_first_kept && i == 0) reaches = true;
        }
        stays[i] = reaches ? 1 : 0;
    }
};
// Moves the triangles that stay to their places, with their numbers.
struct slab_writer {
    const glm::uvec3* all;
    const std::uint64_t* places;
    glm::uvec3* triangles;
    std::uint32_t* numbers;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (places[i + 1] == places[i]) return;
        triangles[places[i]] = all[i];
        numbers[places[i]] = static_cast<std::uint32_t>(i);
    }
};

template <class... Attributes>
class binned_mesh {
public:
    using view_type = mesh_view<Attributes...>;

    // Copies from host memory. Throws as buffers do.
    binned_mesh(cuda_backend& gpu, const view_type& from)
        : vertices_(make_vertices(gpu, from, std::index_sequence_for<Attributes...>{})),
          triangles_(gpu, array_view<const glm::uvec3>(from.triangles)), numbers_(gpu, std::size_t{0}),
          whole_(from.triangles.size()) {}

    // Adds `count` triangles from `first` on to the layers that they reach, and to the counters. index_out_of_range if
    // one names no vertex. Waits.
    template <class VertexShader>
    [[nodiscard]] status count_layers(cuda_backend& gpu, const VertexShader& shader, const bin_rule& rule,
                                      std::uint64_t first, std::uint64_t count, histogram& layers,
                                      counters& counts) const {
        const std::vector<unsigned long long> zeros(count_words + layers.words().size());
        cuda_backend::buffer<unsigned long long> words(gpu, array_view<const unsigned long long>(zeros));
        gpu.for_each(count, layer_counter<view_type, VertexShader>{{all(), shader, rule}, first, words.data()});
        const std::vector<unsigned long long> host = words.to_host(gpu);
        if (host[num_classes] != 0) return core::failure(status_code::index_out_of_range);
        for (std::size_t k = 0; k < num_classes; ++k)
            core::count_class(counts, static_cast<core::triangle_class>(k), host[k]);
        for (std::size_t w = 0; w < layers.words().size(); ++w) layers.words()[w] += host[count_words + w];
        return {};
    }

    // Leaves the triangles that reach layers of an axis, and the first one where that is asked for. All indices are
    // good.
    template <class VertexShader>
    void keep(cuda_backend& gpu, const VertexShader& shader, const bin_rule& rule, int axis, const layer_range& layers,
              bool is_first_kept) {
        if (whole_ == 0) return;
        cuda_backend::buffer<std::uint32_t> stays(gpu, whole_ + 1);
        cuda_backend::buffer<std::uint64_t> places(gpu, whole_ + 1);
        gpu.for_each(whole_ + 1,
                     slab_chooser<view_type, VertexShader>{
                         {all(), shader, rule}, axis, layers.begin, layers.end, whole_, is_first_kept, stays.data()});
        const std::uint64_t kept = gpu.sum(stays, places);
        cuda_backend::buffer<glm::uvec3> triangles(gpu, kept);
        numbers_ = cuda_backend::buffer<std::uint32_t>(gpu, kept);
        gpu.for_each(whole_, slab_writer{triangles_.data(), places.data(), triangles.data(), numbers_.data()});
        triangles_ = std::move(triangles);
    }

    // All vertices of the mesh, shaded and snapped, in host memory. Waits.
    template <class VertexShader>
    [[nodiscard]] std::vector<core::snapped_position> snapped_vertices(cuda_backend& gpu, const VertexShader& shader,
                                                                       const core::snap_transform& snap) const {
        const view_type mesh = all();
        cuda_backend::buffer<core::snapped_position> exact(gpu, mesh.num_vertices());
        cuda_backend::buffer<device::int32_position> near(gpu, mesh.num_vertices());
        device::with_runtime_errors([&] {
            device::vertex_shade(mesh, shader, snap, 0, {exact.data(), near.data()}, static_cast<no_varyings*>(nullptr),
                                 gpu.stream);
        });
        return exact.to_host(gpu);
    }

    // After keep().
    [[nodiscard]] view_type view() const {
        view_type v = all();
        v.checked = {v.triangles.data(), v.triangles.size(), v.positions.size()};
        v.part = {numbers_.view(), whole_, 1};
        return v;
    }

private:
    template <std::size_t... I>
    [[nodiscard]] static mesh<cuda_backend, Attributes...> make_vertices(cuda_backend& gpu, const view_type& from,
                                                                         std::index_sequence<I...>) {
        return {gpu, array_view<const glm::vec3>(from.positions), triangle_source(nullptr, 0),
                voxelpipe::get<I>(from.attributes)...};
    }
    [[nodiscard]] view_type all() const {
        view_type v = vertices_.view();
        v.triangles = triangles_.view();
        return v;
    }

    mesh<cuda_backend, Attributes...> vertices_; // without triangles
    cuda_backend::buffer<glm::uvec3> triangles_;
    cuda_backend::buffer<std::uint32_t> numbers_;
    std::uint64_t whole_;
};

} // namespace voxelpipe::slabs::detail
