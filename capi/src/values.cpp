// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "backend_calls.hpp"

#include <algorithm>
#include <memory>

using namespace voxelpipe;
using namespace voxelpipe::capi;

namespace {

checked_rows rows_of(const vp_rows* from, const vp_mesh& m) {
    const vp_rows& r = checked_struct(from, "rows");
    check_enum(r.per, VP_ROWS_PER_TRIANGLE, "per");
    check_enum(r.blend, VP_BLEND_LAST, "blend");
    if (r.columns < 1 || r.columns > 1024)
        throw failure{VP_ERROR_BAD_OPTION, "columns is " + std::to_string(r.columns) + ", not from 1 to 1024"};
    const std::uint64_t expected = r.per == VP_ROWS_PER_TRIANGLE ? m.triangles.size() : m.positions.size();
    if (r.num_rows != expected)
        throw failure{VP_ERROR_BAD_ARRAY, "num_rows is " + std::to_string(r.num_rows) + ", and the mesh has " +
                                              std::to_string(expected) +
                                              (r.per == VP_ROWS_PER_TRIANGLE ? " triangles" : " vertices")};
    if (expected != 0) check_pointer(r.values, "values");
    const std::uint64_t stride = r.row_stride == 0 ? r.columns * sizeof(float) : r.row_stride;
    if (stride % sizeof(float) != 0 || stride < r.columns * sizeof(float) ||
        reinterpret_cast<std::uintptr_t>(r.values) % alignof(float) != 0)
        throw failure{VP_ERROR_BAD_ARRAY, "row_stride is no whole number of floats, or less than a row, or values are "
                                          "not aligned"};
    if (expected != 0 && stride > UINT64_MAX / 2 / expected)
        throw failure{VP_ERROR_BAD_ARRAY, "row_stride: more bytes than can be addressed"};
    return {r.values,
            static_cast<std::size_t>(expected),
            static_cast<std::size_t>(stride / sizeof(float)),
            r.per == VP_ROWS_PER_TRIANGLE,
            r.blend,
            r.columns};
}

} // namespace

extern "C" {

vp_code vp_surface_values(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                          const vp_surface_options* options, const vp_rows* rows, const float* background,
                          const vp_array* out, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const voxelize_options o = surface_options_of(options);
        const checked_rows from = rows_of(rows, m);
        const array_place to = place_of(out, "out", {VP_TYPE_FLOAT32}, g.extent, from.columns);
        check_counters(counters);
        vp_list list;
        const status drawn = c.on.surfaces->list(m, g, o.rule, from, list);
        finish(drawn, nullptr);
        const std::size_t n = from.columns;
        finish(draw_into<float>(to, c.threads,
                                [&](float* packed) {
                                    const std::size_t elements = to.elements();
                                    for (std::size_t i = 0; i < elements; ++i)
                                        packed[i] = background == nullptr ? 0.0f : background[i % n];
                                    for (std::size_t v = 0; v < list.coordinates.size() / 3; ++v) {
                                        const std::int32_t* const p = &list.coordinates[3 * v];
                                        const std::size_t at = (static_cast<std::size_t>(p[2]) * to.count[1] +
                                                                static_cast<std::size_t>(p[1])) *
                                                                   to.count[0] +
                                                               static_cast<std::size_t>(p[0]);
                                        std::copy_n(&list.values[v * n], n, packed + at * n);
                                    }
                                    return drawn;
                                }),
               counters);
    });
}

vp_code vp_surface_list(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                        const vp_surface_options* options, const vp_rows* rows, vp_list** list, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        check_pointer(list, "list");
        const voxelpipe::grid g = grid_of(grid);
        const voxelize_options o = surface_options_of(options);
        check_counters(counters);
        auto made = std::make_unique<vp_list>();
        finish(rows == nullptr ? c.on.surfaces->list(m, g, o.rule, *made)
                               : c.on.surfaces->list(m, g, o.rule, rows_of(rows, m), *made),
               counters);
        *list = made.release();
    });
}

vp_code vp_list_size(const vp_list* list, uint64_t* voxels, uint32_t* columns) {
    return guarded([&] {
        const vp_list& l = checked_handle(list, "list");
        check_pointer(voxels, "voxels");
        *voxels = l.coordinates.size() / 3;
        if (columns != nullptr) *columns = l.columns;
    });
}

vp_code vp_list_read(const vp_list* list, uint64_t first, uint64_t count, int32_t* coordinates, float* values) {
    return guarded([&] {
        const vp_list& l = checked_handle(list, "list");
        const std::uint64_t voxels = l.coordinates.size() / 3;
        if (first > voxels || count > voxels - first)
            throw failure{VP_ERROR_BAD_INDEX, "voxels from " + std::to_string(first) + ", " + std::to_string(count) +
                                                  " of them, of a list of " + std::to_string(voxels)};
        if (values != nullptr && l.columns == 0) throw failure{VP_ERROR_BAD_OPTION, "the list has no values"};
        if (count == 0) return;
        if (coordinates != nullptr) std::copy_n(&l.coordinates[3 * first], 3 * count, coordinates);
        if (values != nullptr) std::copy_n(&l.values[l.columns * first], l.columns * count, values);
    });
}

void vp_list_destroy(vp_list* list) { destroy(list); }

} // extern "C"
