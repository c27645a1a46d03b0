// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The triangles that programs make of draws, any chunk at a time, as meshes in the backend's memory.

#include <voxelpipe/programs/passes/passes.hpp>
#include <voxelpipe/programs/passes/types.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::core {

// Makes the triangles of a draw, any chunk at a time. Stored: varyings of its meshes.
template <class Backend, class Mesh, class VertexShader, class Stored>
class program_draw_base {
protected:
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using V = typename shaded<Mesh, VertexShader>::varyings;
    using elements = elements_of<Mesh>;

    // Runs the vertex shader.
    program_draw_base(Backend& backend, const Mesh& mesh, const VertexShader& shader, std::uint32_t draw)
        : backend_(backend), in_(elements::indices(mesh)), num_inputs_(elements::count(mesh) * mesh.copies.count),
          draw_(draw), vertices_(backend, mesh.positions.size() * mesh.copies.count) {
        const auto of_vertices = elements::vertices(mesh);
        backend.for_each(vertices_.size(), shade_elements<std::remove_const_t<decltype(of_vertices)>, VertexShader, V>{
                                               of_vertices, shader, draw, vertices_.data()});
    }

    Backend& backend_;
    element_indices<elements::size> in_;
    std::uint64_t num_inputs_;
    std::uint32_t draw_;
    buffer<vertex_output<V>> vertices_;
};

// total(): how many there are. is_one(most): they are one chunk. for_each_chunk(most, has_origins, visit) calls
// visit(first, mesh) for ranges of them.
template <class Backend, class Mesh, class VertexShader, class Amplify, class Stored>
class program_draw;

template <class Backend, class Mesh, class VertexShader, class Program, class Stored>
class program_draw<Backend, Mesh, VertexShader, tessellate<Program>, Stored>
    : program_draw_base<Backend, Mesh, VertexShader, Stored> {
    using base = program_draw_base<Backend, Mesh, VertexShader, Stored>;

public:
    program_draw(Backend& backend, const Mesh& mesh, const VertexShader& shader, const tessellate<Program>& amplify,
                 std::uint32_t draw, std::uint64_t* counts, std::uint64_t)
        : base(backend, mesh, shader, draw),
          pass_(backend, amplify.program, this->vertices_.data(), this->in_, this->num_inputs_, counts) {}
    [[nodiscard]] std::uint64_t total() const { return pass_.total(); }
    [[nodiscard]] bool is_one(std::uint64_t most) const { return total() <= most; }
    template <class Visit>
    void for_each_chunk(std::uint64_t most, bool has_origins, const glm::vec3& outside, const Visit& visit) const {
        for (std::uint64_t first = 0; first < total(); first += most)
            visit(first, pass_.template emit<Stored>(first, std::min(total(), first + most), has_origins, outside));
    }

private:
    tessellation_pass<Backend, Program, typename base::V> pass_;
};

template <class Backend, class Mesh, class VertexShader, class Program, class Stored>
class program_draw<Backend, Mesh, VertexShader, geometry<Program>, Stored>
    : program_draw_base<Backend, Mesh, VertexShader, Stored> {
    using base = program_draw_base<Backend, Mesh, VertexShader, Stored>;
    using types = program_types<Mesh, VertexShader, geometry<Program>>;

public:
    program_draw(Backend& backend, const Mesh& mesh, const VertexShader& shader, const geometry<Program>& amplify,
                 std::uint32_t draw, std::uint64_t* counts, std::uint64_t)
        : base(backend, mesh, shader, draw),
          pass_(backend, amplify.program, {this->vertices_.data(), this->in_, this->num_inputs_, nullptr, 0, draw},
                counts) {}
    [[nodiscard]] std::uint64_t total() const { return pass_.total(); }
    [[nodiscard]] bool is_one(std::uint64_t most) const { return total() <= most; }
    template <class Visit>
    void for_each_chunk(std::uint64_t most, bool has_origins, const glm::vec3&, const Visit& visit) const {
        for (std::uint64_t first = 0; first < total(); first += most)
            visit(first, pass_.emit(first, std::min(total(), first + most), has_origins));
    }

private:
    geometry_pass<Backend, Program, types::size, types::template input, typename base::V, Stored> pass_;
};

// The tessellation is made in chunks as well; the geometry program runs on each.
template <class Backend, class Mesh, class VertexShader, class T, class G, class Stored>
class program_draw<Backend, Mesh, VertexShader, tessellate_then_geometry<T, G>, Stored>
    : program_draw_base<Backend, Mesh, VertexShader, Stored> {
    using base = program_draw_base<Backend, Mesh, VertexShader, Stored>;
    using first_pass = tessellation_pass<Backend, T, typename base::V>;
    using W = tessellated<T, typename base::V>;
    using second_pass = geometry_pass<Backend, G, 3, triangle, W, Stored>;

public:
    program_draw(Backend& backend, const Mesh& mesh, const VertexShader& shader,
                 const tessellate_then_geometry<T, G>& amplify, std::uint32_t draw, std::uint64_t* counts,
                 std::uint64_t most)
        : base(backend, mesh, shader, draw), program_(amplify.second.program), counts_(counts), most_(most),
          pass_(backend, amplify.first.program, this->vertices_.data(), this->in_, this->num_inputs_, counts) {
        for_each_part([&](std::uint64_t, const second_pass& pass) { total_ += pass.total(); });
    }
    [[nodiscard]] std::uint64_t total() const { return total_; }
    [[nodiscard]] bool is_one(std::uint64_t most) const { return pass_.total() <= most && total_ <= most; }
    template <class Visit>
    void for_each_chunk(std::uint64_t most, bool has_origins, const glm::vec3&, const Visit& visit) const {
        for_each_part([&](std::uint64_t before, const second_pass& pass) {
            for (std::uint64_t first = 0; first < pass.total(); first += most)
                visit(before + first, pass.emit(first, std::min(pass.total(), first + most), has_origins));
        });
    }

private:
    // Calls visit(triangles before, pass) for the geometry pass of each chunk of the tessellation.
    template <class Visit>
    void for_each_part(const Visit& visit) const {
        std::uint64_t before = 0;
        for (std::uint64_t first = 0; first < pass_.total(); first += most_) {
            const std::uint64_t last = std::min(pass_.total(), first + most_);
            const auto joined = pass_.emit_joined(first, last);
            const auto count = static_cast<std::uint32_t>(last - first);
            const element_indices<3> in{reinterpret_cast<const std::uint32_t*>(joined.triangles.data()),
                                        std::uint64_t{3} * count, 3, count, joined.num_vertices};
            const second_pass pass(
                this->backend_, program_,
                {joined.vertices.data(), in, count, joined.origins.data(), this->in_.each, this->draw_}, counts_);
            visit(before, pass);
            before += pass.total();
        }
    }

    G program_;
    std::uint64_t* counts_;
    std::uint64_t most_, total_ = 0;
    first_pass pass_;
};

// The emitted triangles of all draws. IsPlain: the shader needs no varyings and no numbers.
template <class Backend, class Mesh, class VertexShader, class FragmentShader, class Amplify, bool IsPlain>
class program_call {
    using draw_type = draw<Mesh, VertexShader, FragmentShader, Amplify>;
    using varyings = typename program_types<Mesh, VertexShader, Amplify>::varyings;
    using shader = emitted_shader<FragmentShader, varyings, IsPlain>;
    using stored = typename shader::stored;
    using mesh_type = emitted_mesh<Backend, stored>;
    using vertex_shader = emitted_vertex_shader<stored>;
    using view_type = decltype(std::declval<const mesh_type&>().view());
    using amplified_type = program_draw<Backend, Mesh, VertexShader, Amplify, stored>;

public:
    using emitted_draw = draw<view_type, vertex_shader, typename shader::type>;

    // Counts all triangles; state() tells whether the call can go on. outside: where triangles lie that are left out,
    // position_outside or position_nowhere. Waits.
    program_call(Backend& backend, std::span<const draw_type> draws, const glm::vec3& outside,
                 std::uint64_t chunk_triangles)
        : backend_(backend), draws_(draws),
          most_(std::clamp<std::uint64_t>(chunk_triangles, 1, std::uint64_t{1} << 30)), outside_(outside),
          counts_(backend, array_view<const std::uint64_t>(zeros.data(), zeros.size())) {
        std::uint64_t total = 0;
        for (std::size_t d = 0; d < draws.size(); ++d) {
            amplified_.push_back(std::make_unique<amplified_type>(backend, draws[d].mesh, draws[d].vertex_shader,
                                                                  draws[d].amplify, static_cast<std::uint32_t>(d),
                                                                  counts_.data(), most_));
            total += amplified_.back()->total();
        }
        const std::vector<std::uint64_t> counts = counts_.to_host(backend);
        if (counts_left_out<Amplify>) left_out_ = counts[index_of(program_count::left_out)];
        state_ = check_counts(counts, total);
    }
    [[nodiscard]] const status& state() const { return state_; }
    [[nodiscard]] std::uint64_t left_out() const { return left_out_; }
    // True if each draw is one chunk, and all of them together are not more.
    [[nodiscard]] bool fits() const {
        return state_.counts.triangles_in <= most_ &&
               std::all_of(amplified_.begin(), amplified_.end(), [&](const auto& d) { return d->is_one(most_); });
    }

    // Calls run(draws) with all triangles, one mesh a draw.
    template <class Run>
    [[nodiscard]] status draw_at_once(const Run& run) const {
        std::vector<mesh_type> meshes;
        std::vector<emitted_draw> emitted;
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            mesh_type none(backend_, 0, 0, false);
            meshes.push_back(std::move(none));
            amplified_[d]->for_each_chunk(most_, !IsPlain, outside_,
                                          [&](std::uint64_t, mesh_type&& m) { meshes.back() = std::move(m); });
        }
        for (std::size_t d = 0; d < draws_.size(); ++d) emitted.push_back(draw_of_mesh(meshes[d], d, 0));
        const status s = run(std::span<const emitted_draw>(emitted));
        return outside_.x == outside_.x ? without_left_out(s, left_out_) : without_left_out_nowhere(s, left_out_);
    }
    // Calls run(draw, first primitive) for each chunk, until a status is not ok.
    template <class Run>
    [[nodiscard]] status draw_in_chunks(const Run& run) const {
        status s;
        std::uint64_t before = 0;
        for (std::size_t d = 0; d < draws_.size(); ++d) {
            amplified_[d]->for_each_chunk(most_, !IsPlain, outside_, [&](std::uint64_t first, const mesh_type& m) {
                if (s.ok()) s = run(draw_of_mesh(m, d, before + first), static_cast<std::uint32_t>(before + first));
            });
            before += amplified_[d]->total();
        }
        return s;
    }

private:
    static constexpr std::array<std::uint64_t, index_of(program_count::size)> zeros{};

    [[nodiscard]] emitted_draw draw_of_mesh(const mesh_type& m, std::size_t d, std::uint64_t first) const {
        if constexpr (IsPlain) {
            return {m.view(), {}, draws_[d].fragment_shader};
        } else {
            const auto each = static_cast<std::uint32_t>(elements_of<Mesh>::count(draws_[d].mesh));
            return {m.view(),
                    {},
                    {draws_[d].fragment_shader, m.origins.data(), each, static_cast<std::uint32_t>(d),
                     static_cast<std::uint32_t>(first), nullptr}};
        }
    }

    Backend& backend_;
    std::span<const draw_type> draws_;
    std::uint64_t most_;
    glm::vec3 outside_;
    typename Backend::template buffer<std::uint64_t> counts_;
    std::vector<std::unique_ptr<amplified_type>> amplified_;
    std::uint64_t left_out_ = 0;
    status state_;
};

} // namespace voxelpipe::core
