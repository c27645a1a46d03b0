// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// --solid exterior and --vote for a model that is read block by block: what the slabs, which are drawn one by one, need
// of each other. A flood takes the walls of all slabs first (voxelpipe/slabs/exterior.hpp), a vote the crossings of all
// triangles with the columns (voxelpipe/slabs/columns.hpp).

#include "../surface.hpp"
#include "../triangle_stream.hpp"
#include "../voxelizer.hpp"

#include <voxelpipe/slabs/columns.hpp>
#include <voxelpipe/slabs/exterior.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/solid.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace voxelize {

class streamed_repairs {
public:
    // Nothing unless the request asks for one of them. room: bytes that the run may take.
    streamed_repairs(const triangle_stream& model, const voxelize_request& request, double room,
                     const std::filesystem::path& folder);

    [[nodiscard]] bool floods() const { return floods_; }
    [[nodiscard]] bool is_any() const { return floods_ || votes_; }
    // Bytes of one layer of a slab while that is decided, about.
    [[nodiscard]] double layer_bytes() const;

    // The layers of the slabs that will be drawn, ascending; some may be empty. Throws memory_error.
    void begin(std::span<const voxelpipe::slabs::layer_range> drawn);
    // All triangles, once each.
    void add(const triangle_stream::block& block);
    // The triangles of layers of the whole grid.
    void add_walls(scene&& of_slab, const voxelpipe::slabs::layer_range& layers,
                   const std::function<void(double)>& progress);
    // Once all walls are there.
    void flood();
    // The needs of a slab's call, valid until the next one is asked for; slabs come in order. part: of the request's
    // grid.
    [[nodiscard]] vp::solid_slab of(const voxelpipe::grid& part);

private:
    const voxelize_request& request_;
    bool floods_, votes_;
    double room_;
    std::vector<placed_vertex_shader> places_; // by part
    voxelpipe::grid inner_;                    // without the padding, relative to the reference point
    vp::core::snap_transform snap_{};
    std::vector<voxelpipe::slabs::layer_range> slabs_; // of inner_, not empty
    std::size_t next_ = 0;
    std::optional<voxelpipe::slabs::column_parities> columns_;
    std::optional<vp::slabs::slab_exterior> exterior_;
    std::optional<vp::core::bit_grid> inside_; // of the slab that was asked for
};

} // namespace voxelize
