// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// surface_cells on a GPU: by words of 32 cells (passes/words.hpp), with kernels of its own for vertices, faces and
// components. The bytes are those of the passes that other backends run.

#include <voxelpipe/device/base/for_each.cuh>
#include <voxelpipe/device/scene/prefix_sum.cuh>
#include <voxelpipe/surfaces/device/word_edges_kernels.cuh>
#include <voxelpipe/surfaces/device/word_joins_kernels.cuh>
#include <voxelpipe/surfaces/passes/build.hpp>

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

namespace voxelpipe::core {

// The cells of a grid of bits. Waits twice: for the number of words, and for those of vertices and crossed edges.
template <class Backend>
requires std::same_as<Backend, cuda_backend>
class surface_cells<Backend> {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    using list_type = passes::indexed_cells<passes::grouped_index>; // what passes take
    static constexpr bool is_sparse = false;
    static constexpr bool makes_meshes = true; // makes vertices and faces by kernels of its own

    // The samples are those of a grid of this extent; their memory outlives the object, and so does the backend.
    surface_cells(Backend& backend, const std::uint32_t* samples, const glm::ivec3& extent)
        : backend_(backend), grid_{{samples, extent.x, extent.y, extent.z}},
          table_(backend, array_view<const cell_sheets>(cell_table())), masks_(backend, num_groups()),
          first_of_group_(backend, num_groups() + num_counters), keys_(backend, 0), words_(backend, 0),
          edges_(backend, 0), faces_(backend, 0), states_(backend, 0), cell_keys_(backend, 0),
          first_vertices_(backend, 0), first_edges_(backend, 0) {
        find_words();
        if (are_too_many()) return;
        number();
    }

    [[nodiscard]] bool are_too_many() const { return num_vertices_ > most; }
    [[nodiscard]] std::uint64_t count() const { return count_; }
    [[nodiscard]] std::uint64_t num_vertices() const { return num_vertices_; }
    [[nodiscard]] std::uint64_t num_edges() const { return num_edges_; } // crossed ones, which are the quads
    [[nodiscard]] const passes::cell_grid& grid() const { return grid_; }

    // Refers to the object. The arrays of cells are made when they are first asked for.
    [[nodiscard]] list_type list() const {
        if (first_edges_.size() == 0) list_cells();
        return {{where(), words_.data()}, table_.data(),          cell_keys_.data(),
                states_.data(),           first_vertices_.data(), first_edges_.data()};
    }

    // The vertices where all crossings lie in the middle of their edges.
    void place_middles(place where, surface_vertex* vertices) const {
        if (num_words_ == 0) return;
        const buffer<cell_place> places(backend_, device::num_placed_states);
        backend_.for_each(device::num_placed_states,
                          device::place_states{table_.data(), where, const_cast<cell_place*>(places.data())});
        run([&] { device::place_words(words(), blocks(), places.data(), vertices, backend_.stream); });
    }
    // As core::for_each_edge.
    template <int Axis, class Use>
    void for_each_edge(const Use& use) const {
        if (num_words_ == 0) return;
        run([&] { device::for_word_edges<Axis>(words(), blocks(), use, backend_.stream); });
    }
    // The quads, or the triangles that they are cut into by the places of their vertices.
    void list_quads(glm::uvec4* quads) const { list_faces({nullptr, false, nullptr, quads}); }
    void list_triangles(const surface_vertex* vertices, bool folds, glm::uvec3* triangles) const {
        list_faces({vertices, folds, triangles, nullptr});
    }
    // Components of the whole surface. Waits.
    [[nodiscard]] std::uint64_t count_components() const {
        if (num_words_ == 0) return 0;
        buffer<std::uint32_t> parents(backend_, num_vertices_);
        buffer<std::uint64_t> components(backend_, 1);
        run([&] {
            device::check(cudaMemsetAsync(components.data(), 0, sizeof(std::uint64_t), backend_.stream));
            device::count_components(words(), blocks(), parents.data(), components.data(), backend_.stream);
        });
        return components.to_host(backend_)[0];
    }

private:
    static constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
    enum counter : int { num_words, marked_cells, num_cells, vertices, edges, num_counters }; // behind the groups

    template <class F>
    static void run(const F& f) {
        device::with_runtime_errors(f);
    }
    [[nodiscard]] passes::word_groups where() const { return {grid_, masks_.data(), first_of_group_.data()}; }
    [[nodiscard]] std::uint64_t num_groups() const {
        const std::uint64_t n = passes::word_groups{grid_, nullptr, nullptr}.count();
        if (n >= most) throw std::length_error("voxelpipe: more rows of samples than 32 bits number");
        return n;
    }
    [[nodiscard]] const std::uint64_t* counters() const { return first_of_group_.data() + masks_.size(); }
    [[nodiscard]] std::uint64_t* counters() { return first_of_group_.data() + masks_.size(); }
    [[nodiscard]] std::vector<std::uint64_t> read_counters() const {
        return backend_.read(backend_view<const std::uint64_t>{counters(), num_counters});
    }
    [[nodiscard]] std::uint32_t blocks() const { return device::word_blocks(num_words_); }
    [[nodiscard]] device::surface_words words() const {
        return {where(),       table_.data(), counters(),    keys_.data(),
                words_.data(), edges_.data(), faces_.data(), states_.data()};
    }

    // The words, and the number of cells.
    void find_words() {
        const auto n = static_cast<std::uint32_t>(masks_.size() + 1);
        buffer<std::uint32_t> counts(backend_, n);
        run([&] {
            const std::size_t bytes = device::cell_scan_bytes(n);
            buffer<std::uint8_t> storage(backend_, bytes);
            device::check(cudaMemsetAsync(counters(), 0, sizeof(std::uint64_t) * num_counters, backend_.stream));
            device::mark_words(where(), masks_.data(), counts.data(), counters() + marked_cells, backend_.stream);
            device::sum_counts(counts.data(), reinterpret_cast<unsigned long long*>(first_of_group_.data()), n,
                               storage.data(), bytes, stage::coarse_raster, backend_.stream);
        });
        const std::vector<std::uint64_t> found = read_counters();
        num_words_ = found[num_words];
        count_ = found[marked_cells];
        if (count_ > most) num_vertices_ = count_; // a cell has a vertex at least
    }
    void number() {
        const std::uint32_t n = blocks();
        keys_ = buffer<std::uint64_t>(backend_, num_words_);
        words_ = buffer<passes::surface_word>(backend_, num_words_ + 1);
        edges_ = buffer<passes::word_edges>(backend_, num_words_);
        faces_ = buffer<passes::word_faces>(backend_, num_words_);
        states_ = buffer<std::uint16_t>(backend_, count_);
        buffer<unsigned long long> sums(backend_, std::uint64_t{3} * n);
        run([&] {
            device::list_words(where(), counters(), keys_.data(), backend_.stream);
            device::number_surface_words({grid_, table_.data(), counters(), keys_.data(), words_.data(), edges_.data(),
                                          faces_.data(), states_.data(), sums.data(), n, counters() + num_cells},
                                         backend_.stream);
        });
        const std::vector<std::uint64_t> found = read_counters();
        num_vertices_ = found[vertices];
        num_edges_ = found[edges];
    }
    void list_cells() const {
        cell_keys_ = buffer<std::uint64_t>(backend_, count_);
        first_vertices_ = buffer<std::uint64_t>(backend_, count_ + 1);
        first_edges_ = buffer<std::uint64_t>(backend_, count_ + 1);
        run([&] {
            device::list_cells(words(), blocks(), cell_keys_.data(), first_vertices_.data(), first_edges_.data(),
                               backend_.stream);
        });
    }
    void list_faces(const device::face_arrays& out) const {
        if (num_words_ == 0) return;
        run([&] { device::list_faces(words(), blocks(), out, backend_.stream); });
    }

    Backend& backend_;
    passes::cell_grid grid_;
    buffer<cell_sheets> table_;
    buffer<std::uint32_t> masks_;
    buffer<std::uint64_t> first_of_group_;
    buffer<std::uint64_t> keys_;
    buffer<passes::surface_word> words_;
    buffer<passes::word_edges> edges_;
    buffer<passes::word_faces> faces_;
    buffer<std::uint16_t> states_;
    mutable buffer<std::uint64_t> cell_keys_, first_vertices_, first_edges_;
    std::uint64_t num_words_ = 0, count_ = 0, num_vertices_ = 0, num_edges_ = 0;
};

} // namespace voxelpipe::core
