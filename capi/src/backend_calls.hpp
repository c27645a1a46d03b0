// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the functions of the C API ask of a backend. All arrays are in the host's memory, packed, and checked against
// the mesh and the grid. The results are the same bytes on every backend: surface_calls.hpp, solid_calls.hpp and
// field_calls.hpp implement them once, cpu_calls.cpp and cuda/ compile that.

#include "calls.hpp"

#include <bindings/value_rows.hpp>
#include <voxelpipe/distance/distance.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>

namespace voxelpipe::capi {

// Rows of values that were checked against the mesh: one a vertex, or one a triangle.
struct checked_rows {
    const float* values = nullptr;
    std::size_t num_rows = 0;
    std::size_t stride = 0; // floats from row to row
    bool per_triangle = false;
    std::int32_t blend = VP_BLEND_MEAN;
    std::uint32_t columns = 0;
};

// Calls that draw triangles.
class surface_calls {
public:
    virtual ~surface_calls() = default;
    // `words` has rows of bits, as VP_TYPE_BITS.
    [[nodiscard]] virtual status surface(const vp_mesh& m, const grid& g, coverage rule,
                                         std::uint32_t* words) const = 0;
    // The voxels alone.
    [[nodiscard]] virtual status list(const vp_mesh& m, const grid& g, coverage rule, vp_list& out) const = 0;
    // The voxels and their values.
    [[nodiscard]] virtual status list(const vp_mesh& m, const grid& g, coverage rule, const checked_rows& rows,
                                      vp_list& out) const = 0;
};

// Calls that fill bodies.
class solid_calls {
public:
    virtual ~solid_calls() = default;
    [[nodiscard]] virtual status solid(const vp_mesh& m, const grid& g, const solid_options& o,
                                       std::uint32_t* words) const = 0;
    [[nodiscard]] virtual status list(const vp_mesh& m, const grid& g, const solid_options& o, vp_list& out) const = 0;
};

// Calls that measure.
class field_calls {
public:
    virtual ~field_calls() = default;
    // An element of each array for every sample of an extent. `nearest` may be null.
    [[nodiscard]] virtual status distance_field(const vp_mesh& m, const grid& g, const glm::ivec3& samples,
                                                const distance_options& o, float* distances,
                                                std::int64_t* nearest) const = 0;
    // Either of the arrays may be null.
    [[nodiscard]] virtual status distances_at(const vp_mesh& m, const grid& g, const distance_options& o,
                                              const std::vector<glm::vec3>& points, float* distances,
                                              std::int64_t* nearest) const = 0;
    [[nodiscard]] virtual status fractions(const vp_mesh& m, const grid& g, int axis, float* out) const = 0;
    // All of `out` but its neighbours, which say what is wanted.
    [[nodiscard]] virtual status links(const vp_mesh& m, const grid& g, vp_links& out) const = 0;
};

struct backend_calls {
    std::unique_ptr<const surface_calls> surfaces;
    std::unique_ptr<const solid_calls> solids;
    std::unique_ptr<const field_calls> fields;
};

[[nodiscard]] backend_calls cpu_calls(unsigned threads);
// Makes the calls of the first CUDA device. Throws a failure where there is none. Only a build with CUDA defines it.
[[nodiscard]] backend_calls cuda_calls(unsigned threads);
[[nodiscard]] std::unique_ptr<const surface_calls> cuda_surfaces(unsigned threads);
[[nodiscard]] std::unique_ptr<const solid_calls> cuda_solids();
[[nodiscard]] std::unique_ptr<const field_calls> cuda_fields();

} // namespace voxelpipe::capi

struct vp_context {
    static constexpr std::uint64_t its_kind = 0x7670'636f'6e74'6578; // "vpcontex"
    std::uint64_t kind = its_kind;
    unsigned threads = 0;
    voxelpipe::capi::backend_calls on;
};
