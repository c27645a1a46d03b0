// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Valid calls of the API with all their arguments. bad_input_test breaks one argument at a time.

#include <cpu_ref/backend.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace unit {

namespace vp = voxelpipe;

// One pipeline for all tests, because compiling it is their main cost. The third target is on only in tests that need
// large values.
using floats = vp::target<float, vp::blend::max>;
using bits = vp::target<vp::bit, vp::blend::bit_or>;
using large = vp::target<glm::dvec4, vp::blend::replace>;
inline const auto shader = vp::constant(1.0f, true, glm::dvec4(1.0));
inline constexpr auto payload = vp::constant(7);
struct by_weight {
    glm::vec3 operator()(const vp::vertex<float>& v) const { return v.position * vp::get<0>(v); }
};
using mesh_type = vp::mesh_view<float>;
using draw = vp::draw<mesh_type, by_weight, std::remove_const_t<decltype(shader)>>;

// A valid call into memory that shows every write.
struct call {
    static constexpr float mark = -12345.0f;
    static constexpr std::uint32_t bit_mark = 0x5a5a5a5au;

    std::vector<glm::vec3> positions = {{1, 1, 1}, {6, 1, 2}, {1, 6, 3}};
    std::vector<glm::uvec3> triangles = {{0, 1, 2}, {2, 1, 0}};
    vp::grid grid;
    std::vector<float> depths = std::vector<float>(8 * 8 * 8, mark);
    std::vector<std::uint32_t> words = std::vector<std::uint32_t>(8 * 8, bit_mark);
    std::vector<float> weights;
    vp::framebuffer_view<floats, bits, large> view;
    mesh_type mesh;

    call() {
        grid.extent = {8, 8, 8};
        view.extent = {8, 8, 8};
        vp::get<0>(view.targets).elements = depths.data();
        vp::get<0>(view.targets).extent = {8, 8, 8};
        vp::get<1>(view.targets).elements = words.data();
        vp::get<1>(view.targets).extent = {8, 8, 8};
        vp::get<2>(view.targets).load = vp::load_operation::off;
        look();
    }
    call(const call&) = delete; // the views point into it
    call& operator=(const call&) = delete;

    void look() { // call after a change of the arrays
        weights.assign(positions.size(), 1.0f);
        mesh = {positions, triangles, vp::core::make_pack(vp::array_view<const float>(weights))};
    }
    bool untouched() const {
        return std::all_of(depths.begin(), depths.end(), [](float x) { return x == mark; }) &&
               std::all_of(words.begin(), words.end(), [](std::uint32_t x) { return x == bit_mark; });
    }
};

// Several tiles, and enough triangles (nearly all outside) that every stage divides its work among threads.
struct large_call : call {
    large_call() {
        grid.extent = {70, 8, 8};
        view.extent = grid.extent;
        depths.resize(70 * 8 * 8);
        words.resize(3 * 8 * 8);
        vp::get<0>(view.targets).elements = depths.data();
        vp::get<0>(view.targets).extent = grid.extent;
        vp::get<1>(view.targets).elements = words.data();
        vp::get<1>(view.targets).extent = grid.extent;
        positions = {{1, 1, 1}, {69, 1, 2}, {1, 6, 3}, {500, 1, 1}, {501, 1, 1}, {500, 2, 1}};
        triangles.assign(17000, {3, 4, 5});
        triangles.front() = {0, 1, 2};
        triangles.back() = {2, 1, 0};
        look();
        wipe();
    }
    void wipe() {
        std::fill(depths.begin(), depths.end(), mark);
        std::fill(words.begin(), words.end(), bit_mark);
    }
};

} // namespace unit
