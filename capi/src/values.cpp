// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <bindings/sparse_values.hpp>

#include <algorithm>
#include <memory>

using namespace voxelpipe;
using namespace voxelpipe::capi;

namespace {

// Rows of values that were checked against the mesh.
struct checked_rows {
    bindings::value_rows<float> rows; // with the columns of the first pass
    std::int32_t blend = VP_BLEND_MEAN;
    std::uint32_t columns = 0;
};

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
    return {{r.values, static_cast<std::size_t>(stride / sizeof(float)), 0,
             r.per == VP_ROWS_PER_TRIANGLE ? nullptr : m.triangles.data()},
            r.blend,
            r.columns};
}

// The voxels and their values, three columns a pass.
status draw_list(const vp_mesh& m, const grid& g, coverage rule, const checked_rows& rows, unsigned threads,
                 vp_list& list) {
    status s;
    list.columns = rows.columns;
    for (std::uint32_t first = 0; first < rows.columns; first += 3) {
        bindings::bake_call<float> call{m.view(), g, rule, rows.rows, threads};
        const std::uint32_t n = std::min(rows.columns - first, 3u);
        call.rows.values += first;
        call.rows.count = static_cast<int>(n);
        const auto draw = [&]<class Blend>() {
            return bindings::first_columns(
                bindings::draw_sparse_values<float, 3, Blend>(call, rows.blend == VP_BLEND_MEAN, first == 0), n);
        };
        auto drawn = rows.blend == VP_BLEND_MIN    ? draw.operator()<blend::min>()
                     : rows.blend == VP_BLEND_MAX  ? draw.operator()<blend::max>()
                     : rows.blend == VP_BLEND_LAST ? draw.operator()<blend::replace>()
                                                   : draw.operator()<blend::add>();
        s = drawn.result;
        if (!s.ok()) return s;
        if (first == 0) list.coordinates = std::move(drawn.coordinates);
        if (rows.columns <= 3) {
            list.values = std::move(drawn.values);
            break;
        }
        list.values.resize(drawn.num_voxels * rows.columns);
        for (std::size_t i = 0; i < drawn.num_voxels; ++i)
            for (std::uint32_t c = 0; c < n; ++c) list.values[i * rows.columns + first + c] = drawn.values[i * n + c];
    }
    return s;
}

// The voxels alone.
status draw_list(const vp_mesh& m, const grid& g, coverage rule, unsigned threads, vp_list& list) {
    using bits = target<bit, blend::bit_or>;
    cpu_backend backend{threads};
    sparse_framebuffer<cpu_backend, bits> fb{backend, g.extent};
    const status s = voxelize(backend, m.view(), g, passthrough{}, constant(true), fb, voxelize_options{rule});
    if (s.ok()) list.coordinates = bindings::coordinates_of(fb.view().table);
    return s;
}

} // namespace

extern "C" {

vp_code vp_surface_values(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                          const vp_surface_options* options, const vp_rows* rows, const float* background,
                          const vp_array* out, vp_counters* counters) {
    return guarded([&] {
        const unsigned threads = checked_handle(context, "context").threads;
        const vp_mesh& m = checked_handle(mesh, "mesh");
        const voxelpipe::grid g = grid_of(grid);
        const voxelize_options o = surface_options_of(options);
        const checked_rows from = rows_of(rows, m);
        const array_place to = place_of(out, "out", {VP_TYPE_FLOAT32}, g.extent, from.columns);
        check_counters(counters);
        vp_list list;
        const status drawn = draw_list(m, g, o.rule, from, threads, list);
        finish(drawn, nullptr);
        const std::size_t n = from.columns;
        finish(draw_into<float>(to, threads,
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
        const unsigned threads = checked_handle(context, "context").threads;
        const vp_mesh& m = checked_handle(mesh, "mesh");
        check_pointer(list, "list");
        const voxelpipe::grid g = grid_of(grid);
        const voxelize_options o = surface_options_of(options);
        check_counters(counters);
        auto made = std::make_unique<vp_list>();
        finish(rows == nullptr ? draw_list(m, g, o.rule, threads, *made)
                               : draw_list(m, g, o.rule, rows_of(rows, m), threads, *made),
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
