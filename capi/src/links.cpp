// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "backend_calls.hpp"

#include <voxelpipe/cells/links.hpp>

#include <algorithm>
#include <memory>

using namespace voxelpipe;
using namespace voxelpipe::capi;

namespace {

constexpr std::int32_t most_links = 26;

// Copies elements with -1 for a link that nothing crosses.
template <class T>
void copy_numbers(const std::vector<std::uint32_t>& from, std::uint64_t first, std::uint64_t count, T* to) {
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint32_t number = from[static_cast<std::size_t>(first + i)];
        to[i] = number == no_crossing ? T{-1} : static_cast<T>(number);
    }
}

} // namespace

extern "C" {

vp_code vp_link_direction(int32_t link, int32_t direction[3]) {
    return guarded([&] {
        check_enum(link, most_links - 1, "link");
        check_pointer(direction, "direction");
        const glm::ivec3 d = link_direction(link);
        for (int axis = 0; axis < 3; ++axis) direction[axis] = d[axis];
    });
}

vp_code vp_links_create(vp_context* context, const vp_mesh* mesh, const vp_grid* grid, const vp_link_options* options,
                        vp_links** links, vp_counters* counters) {
    return guarded([&] {
        const vp_context& c = checked_handle(context, "context");
        const vp_mesh& m = checked_handle(mesh, "mesh");
        check_pointer(links, "links");
        const voxelpipe::grid g = grid_of(grid);
        const vp_link_options o = options_of(options);
        if (o.neighbours != 0 && o.neighbours != 18 && o.neighbours != most_links)
            throw failure{VP_ERROR_BAD_OPTION, "neighbours is " + std::to_string(o.neighbours) + ", not 18 or 26"};
        check_counters(counters);
        auto made = std::make_unique<vp_links>();
        if (o.neighbours != 0) made->neighbours = static_cast<std::uint32_t>(o.neighbours);
        finish(c.on.fields->links(m, g, *made), counters);
        *links = made.release();
    });
}

vp_code vp_links_size(const vp_links* links, uint64_t* voxels, uint32_t* neighbours) {
    return guarded([&] {
        const vp_links& l = checked_handle(links, "links");
        check_pointer(voxels, "voxels");
        *voxels = l.voxels.size();
        if (neighbours != nullptr) *neighbours = l.neighbours;
    });
}

vp_code vp_links_read(const vp_links* links, uint64_t first, uint64_t count, int32_t* coordinates, float* q,
                      int64_t* triangles, int32_t* parts) {
    return guarded([&] {
        const vp_links& l = checked_handle(links, "links");
        const std::uint64_t voxels = l.voxels.size();
        if (first > voxels || count > voxels - first)
            throw failure{VP_ERROR_BAD_INDEX, "voxels from " + std::to_string(first) + ", " + std::to_string(count) +
                                                  " of them, of " + std::to_string(voxels) + " with links"};
        if (coordinates != nullptr)
            for (std::uint64_t i = 0; i < count; ++i)
                for (int axis = 0; axis < 3; ++axis)
                    coordinates[3 * i + static_cast<std::uint64_t>(axis)] =
                        l.voxels[static_cast<std::size_t>(first + i)][axis];
        if (count == 0) return;
        if (q != nullptr) std::copy_n(&l.q[l.neighbours * first], l.neighbours * count, q);
        if (triangles != nullptr) copy_numbers(l.triangles, l.neighbours * first, l.neighbours * count, triangles);
        if (parts != nullptr) copy_numbers(l.parts, l.neighbours * first, l.neighbours * count, parts);
    });
}

void vp_links_destroy(vp_links* links) { destroy(links); }

} // extern "C"
