// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The records of a slab as the arrays of a mesh in host memory, and what is known of that into which a slab is drawn.

#include <voxelpipe/abuffer.hpp>
#include <voxelpipe/cells/links.hpp>
#include <voxelpipe/core/threads.hpp>
#include <voxelpipe/framebuffer.hpp>
#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/records.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <type_traits>
#include <vector>

namespace voxelpipe::slabs::detail {

// Bytes of a voxel in what a call draws into; 0 if that depends on the mesh.
template <class Output>
inline constexpr double bytes_per_voxel = 0;
template <class... Targets>
inline constexpr double bytes_per_voxel<framebuffer_view<Targets...>> =
    ((std::is_same_v<typename Targets::map::element, std::uint32_t> && Targets::map::is_bit
          ? 0.125
          : static_cast<double>(sizeof(typename Targets::value_type))) +
     ...);
template <class Backend, class... Targets>
inline constexpr double bytes_per_voxel<framebuffer<Backend, Targets...>> =
    bytes_per_voxel<framebuffer_view<Targets...>>;

template <class Output>
inline constexpr bool is_abuffer = false;
template <class Backend, class Payload>
inline constexpr bool is_abuffer<abuffer<Backend, Payload>> = true;
template <class Output>
inline constexpr bool is_links = false;
template <class Backend>
inline constexpr bool is_links<link_list<Backend>> = true;

// Three vertices a triangle.
template <class Varyings>
struct slab_arrays {
    core::raw_array<glm::vec3> positions;
    core::raw_array<glm::uvec3> triangles;
    core::raw_array<std::uint32_t> numbers; // in the whole mesh, by triangle
    core::raw_array<Varyings> varyings;     // no elements if Varyings is empty

    slab_arrays() = default;
    // Reads the bin by threads. Throws std::bad_alloc, and std::system_error of its file.
    slab_arrays(const bin<record<Varyings>>& from, unsigned threads)
        : positions(3 * numbered(from.size())), triangles(static_cast<std::size_t>(from.size())),
          numbers(static_cast<std::size_t>(from.size())),
          varyings(std::is_empty_v<Varyings> ? 0 : 3 * static_cast<std::size_t>(from.size())) {
        constexpr std::size_t block = 32768;
        const std::size_t count = numbers.size(), blocks = (count + block - 1) / block;
        std::vector<std::vector<record<Varyings>>> read(std::min<std::size_t>(std::max(1u, threads), blocks));
        core::parallel_for(threads, blocks, [&](unsigned worker, std::size_t b) {
            const std::size_t first = b * block;
            std::vector<record<Varyings>>& records = read[worker];
            records.resize(std::min(block, count - first));
            from.copy(first, std::span<record<Varyings>>(records));
            for (std::size_t i = 0; i < records.size(); ++i) put(first + i, records[i]);
        });
    }

    // One triangle that is dropped, for calls that need one.
    [[nodiscard]] static slab_arrays dropped() {
        constexpr float nan = std::numeric_limits<float>::quiet_NaN();
        slab_arrays a;
        a.positions = core::raw_array<glm::vec3>(3);
        a.triangles = core::raw_array<glm::uvec3>(1);
        a.numbers = core::raw_array<std::uint32_t>(1);
        a.varyings = core::raw_array<Varyings>(std::is_empty_v<Varyings> ? 0 : 3);
        record<Varyings> r{};
        for (glm::vec3& p : r.positions) p = glm::vec3(nan);
        a.put(0, r);
        return a;
    }

    [[nodiscard]] checked_indices good_indices() const {
        return {triangles.data(), triangles.size(), positions.size()};
    }

private:
    // So many triangles; not more than whose vertices can be numbered.
    [[nodiscard]] static std::size_t numbered(std::uint64_t count) {
        if (count > std::numeric_limits<std::uint32_t>::max() / 3) throw std::bad_alloc();
        return static_cast<std::size_t>(count);
    }
    void put(std::size_t i, const record<Varyings>& r) {
        for (std::size_t k = 0; k < 3; ++k) {
            positions[3 * i + k] = r.positions[k];
            if constexpr (!std::is_empty_v<Varyings>) varyings[3 * i + k] = r.varyings[k];
        }
        const auto first = static_cast<std::uint32_t>(3 * i);
        triangles[i] = {first, first + 1, first + 2};
        numbers[i] = r.number;
    }
};

// The mesh that a slab is drawn as. view_of: refers to the arrays; their indices are good. copy: in a backend's memory.
template <class Varyings>
struct slab_mesh {
    using view = mesh_view<Varyings>;
    using vertex_shader = stored_vertices<Varyings>;

    [[nodiscard]] static view view_of(const slab_arrays<Varyings>& a) {
        return {a.positions, a.triangles, core::make_pack(array_view<const Varyings>(a.varyings)), a.good_indices()};
    }
    template <class Backend>
    [[nodiscard]] static mesh<Backend, Varyings> copy(Backend& backend, const slab_arrays<Varyings>& a) {
        return {backend, array_view<const glm::vec3>(a.positions), array_view<const glm::uvec3>(a.triangles),
                array_view<const Varyings>(a.varyings)};
    }
};
template <class Varyings>
requires(std::is_empty_v<Varyings>) struct slab_mesh<Varyings> {
    using view = mesh_view<>;
    using vertex_shader = passthrough;

    [[nodiscard]] static view view_of(const slab_arrays<Varyings>& a) {
        return {a.positions, a.triangles, {}, a.good_indices()};
    }
    template <class Backend>
    [[nodiscard]] static mesh<Backend> copy(Backend& backend, const slab_arrays<Varyings>& a) {
        return {backend, array_view<const glm::vec3>(a.positions), array_view<const glm::uvec3>(a.triangles)};
    }
};

} // namespace voxelpipe::slabs::detail
