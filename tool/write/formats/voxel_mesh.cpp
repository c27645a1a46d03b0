// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "voxel_mesh.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace voxelize {
namespace {

// Joins single sides of one plane, which come by second axis, then first.
class rectangle_merger {
public:
    void merge(std::span<const voxel_face> sides, std::vector<voxel_face>& out) {
        if (sides.empty()) return;
        const std::size_t u = (sides[0].direction / 2U + 1U) % 3U;
        const std::size_t v = (sides[0].direction / 2U + 2U) % 3U;
        begin(sides, u, v);
        for (const voxel_face& side : sides) cell(side.low[u], side.low[v]) = present | side.rgb;
        for (const voxel_face& side : sides) {
            const std::uint32_t from = side.low[u];
            std::uint32_t row = side.low[v];
            const std::uint32_t color = cell(from, row);
            if (color == 0) continue; // joined to an earlier one
            std::uint32_t to = from + 1;
            while (to < end_[0] && cell(to, row) == color) ++to;
            do {
                for (std::uint32_t i = from; i < to; ++i) cell(i, row) = 0;
                ++row;
            } while (row < end_[1] && is_row_of(color, from, to, row));
            voxel_face face = side;
            face.size = {to - from, row - side.low[v]};
            out.push_back(face);
        }
    }

private:
    static constexpr std::uint32_t present = std::uint32_t{1} << 24;

    // Makes room for the box around the sides.
    void begin(std::span<const voxel_face> sides, std::size_t u, std::size_t v) {
        low_ = {sides[0].low[u], sides[0].low[v]};
        end_ = low_;
        for (const voxel_face& side : sides) {
            low_ = {std::min(low_[0], side.low[u]), std::min(low_[1], side.low[v])};
            end_ = {std::max(end_[0], side.low[u] + 1), std::max(end_[1], side.low[v] + 1)};
        }
        const std::size_t cells = std::size_t{end_[0] - low_[0]} * (end_[1] - low_[1]);
        if (cells_.size() < cells) cells_.resize(cells);
    }
    std::uint32_t& cell(std::uint32_t u, std::uint32_t v) {
        return cells_[std::size_t{v - low_[1]} * (end_[0] - low_[0]) + (u - low_[0])];
    }
    bool is_row_of(std::uint32_t color, std::uint32_t from, std::uint32_t to, std::uint32_t row) {
        for (std::uint32_t i = from; i < to; ++i)
            if (cell(i, row) != color) return false;
        return true;
    }

    std::array<std::uint32_t, 2> low_{}, end_{}; // of the plane's sides, along u and v
    std::vector<std::uint32_t> cells_;           // `present` and the colour, or 0; all 0 between calls
};

// The planes of a brick along an axis: bit 8 * b + a of plane n is the voxel at a along axis + 1 and b along axis + 2.
using brick_planes = std::array<std::uint64_t, 8>;

brick_planes planes_of(const voxelpipe::brick_mask& mask, int axis) {
    brick_planes planes{};
    for (unsigned n = 0; n < 8; ++n)
        for (unsigned b = 0; b < 8; ++b) planes[n] |= std::uint64_t{brick_row(mask, axis, n, b)} << 8 * b;
    return planes;
}

// The sides across an axis of one layer of bricks, which a thread finds at a time.
class layer_sides {
public:
    layer_sides(const voxel_shape& shape, const brick_order& order, int axis,
                std::span<const brick_order::placed> layer, bool colors)
        : shape_(shape), order_(order), axis_(axis), colors_(colors), layer_(layer),
          below_(order.layer_at(layer.front().at() - 1)), above_(order.layer_at(layer.front().at() + 1)) {}

    void append(std::vector<voxel_face>& out, bool merge) {
        brick_order::for_each_row(layer_, [&](std::span<const brick_order::placed> row) { add_row(row); });
        if (!merge) {
            for (const std::vector<voxel_face>& plane : planes_) out.insert(out.end(), plane.begin(), plane.end());
            return;
        }
        rectangle_merger merger;
        for (const std::vector<voxel_face>& plane : planes_) merger.merge(plane, out);
    }

private:
    // The voxels of each plane of a brick whose neighbour below is empty, and those whose neighbour above is.
    using exposed_planes = std::array<std::uint64_t, 16>;

    // Planes of the brick beside this one, in a layer whose bricks before it are no longer wanted.
    brick_planes neighbour(std::span<const brick_order::placed>& layer, const brick_order::placed& of) const {
        while (!layer.empty() && layer.front().in_layer() < of.in_layer()) layer = layer.subspan(1);
        if (layer.empty() || layer.front().in_layer() != of.in_layer()) return {};
        return planes_of(shape_.mask(layer.front().brick), axis_);
    }
    void add_row(std::span<const brick_order::placed> row) {
        exposed_.clear();
        for (const brick_order::placed& p : row) {
            const brick_planes here = planes_of(shape_.mask(p.brick), axis_), below = neighbour(below_, p),
                               above = neighbour(above_, p);
            exposed_planes& exposed = exposed_.emplace_back();
            for (std::size_t n = 0; n < 8; ++n) {
                exposed[2 * n] = here[n] & ~(n == 0 ? below[7] : here[n - 1]);
                exposed[2 * n + 1] = here[n] & ~(n == 7 ? above[0] : here[n + 1]);
            }
        }
        for (unsigned b = 0; b < 8; ++b)
            for (std::size_t i = 0; i < row.size(); ++i)
                for (unsigned n = 0; n < 16; ++n) {
                    auto bits = static_cast<unsigned>(exposed_[i][n] >> 8 * b & 0xffU);
                    for (; bits != 0; bits &= bits - 1)
                        add_side(row[i], n, static_cast<unsigned>(std::countr_zero(bits)), b);
                }
    }
    void add_side(const brick_order::placed& p, unsigned n, unsigned a, unsigned b) {
        const glm::ivec3 voxel = order_.voxel_at(p, n / 2, a, b);
        voxel_face face;
        for (int i = 0; i < 3; ++i) face.low[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(voxel[i]);
        face.low[static_cast<std::size_t>(axis_)] += n % 2; // the plane beyond the voxel
        if (colors_) face.rgb = shape_.rgb(p.brick, voxel);
        face.direction = static_cast<std::uint8_t>(2 * static_cast<unsigned>(axis_) + n % 2);
        planes_[n].push_back(face);
    }

    const voxel_shape& shape_;
    const brick_order& order_;
    int axis_;
    bool colors_;
    std::span<const brick_order::placed> layer_, below_, above_;
    std::vector<exposed_planes> exposed_;            // of the bricks of a row
    std::array<std::vector<voxel_face>, 16> planes_; // two directions each
};

// The four corners of a face, counter-clockwise seen from outside.
std::array<std::array<std::uint32_t, 3>, 4> corners_of(const voxel_face& face) {
    const std::size_t u = (face.direction / 2U + 1U) % 3U;
    const std::size_t v = (face.direction / 2U + 2U) % 3U;
    std::array<std::array<std::uint32_t, 3>, 4> corners{face.low, face.low, face.low, face.low};
    corners[1][u] += face.size[0];
    corners[2][u] += face.size[0];
    corners[2][v] += face.size[1];
    corners[3][v] += face.size[1];
    if (face.direction % 2 == 0) std::swap(corners[1], corners[3]); // seen from the low side
    return corners;
}

// Numbers the corners of one plane of constant z: for each corner the list of its colours.
class plane_welder {
public:
    plane_welder(std::int64_t nx, std::int64_t ny)
        : width_(static_cast<std::size_t>(nx) + 1), first_(width_ * (static_cast<std::size_t>(ny) + 1), none) {}

    std::uint32_t number_of(const std::array<std::uint32_t, 3>& corner, std::uint32_t rgb) {
        const std::size_t corner_index = static_cast<std::size_t>(corner[1]) * width_ + corner[0];
        for (std::uint32_t n = first_[corner_index]; n != none; n = next_[n])
            if (vertices[n].rgb == rgb) return n;
        const auto number = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back({corner, rgb});
        next_.push_back(first_[corner_index]);
        first_[corner_index] = number;
        return number;
    }
    // Ready for another plane; the vertices of this one are given away.
    std::vector<welded_mesh::vertex> take() {
        for (const welded_mesh::vertex& v : vertices)
            first_[static_cast<std::size_t>(v.corner[1]) * width_ + v.corner[0]] = none;
        next_.clear();
        return std::exchange(vertices, {});
    }

    std::vector<welded_mesh::vertex> vertices;

private:
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    std::size_t width_;
    std::vector<std::uint32_t> first_; // vertex of a corner, then along next_
    std::vector<std::uint32_t> next_;
};

} // namespace

std::vector<voxel_face> voxel_faces(const voxel_shape& shape, bool merge, int threads,
                                    const std::function<void(double)>& progress, bool colors) {
    struct layer_of_axis {
        int axis;
        std::size_t layer;
    };
    std::vector<brick_order> orders;
    std::vector<layer_of_axis> work;
    for (int axis = 0; axis < 3; ++axis) {
        orders.emplace_back(shape, axis);
        for (std::size_t n = 0; n < orders.back().num_layers(); ++n) work.push_back({axis, n});
    }
    std::vector<std::vector<voxel_face>> parts(work.size());
    parallel_for(
        work.size(), thread_count(threads),
        [&](std::size_t n) {
            const auto [axis, layer] = work[n];
            const brick_order& order = orders[static_cast<std::size_t>(axis)];
            layer_sides(shape, order, axis, order.layer(layer), colors).append(parts[n], merge);
        },
        [&](std::size_t finished) {
            if (progress) progress(static_cast<double>(finished) / static_cast<double>(work.size()));
        });
    std::size_t count = 0;
    for (const std::vector<voxel_face>& part : parts) count += part.size();
    std::vector<voxel_face> faces;
    faces.reserve(count);
    for (std::vector<voxel_face>& part : parts) {
        faces.insert(faces.end(), part.begin(), part.end());
        part = {};
    }
    return faces;
}

welded_mesh weld(std::span<const voxel_face> faces, const std::array<std::int64_t, 3>& extent, int threads) {
    // Corners by their z, each as 4 * face + corner.
    const auto planes = static_cast<std::size_t>(extent[2]) + 1;
    std::vector<std::size_t> begin(planes + 1);
    for (const voxel_face& face : faces)
        for (const auto& corner : corners_of(face)) ++begin[corner[2] + 1];
    for (std::size_t z = 0; z < planes; ++z) begin[z + 1] += begin[z];
    std::vector<std::uint32_t> by_plane(4 * faces.size());
    {
        std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
        for (std::size_t f = 0; f < faces.size(); ++f) {
            const auto corners = corners_of(faces[f]);
            for (std::size_t c = 0; c < 4; ++c) by_plane[next[corners[c][2]]++] = static_cast<std::uint32_t>(4 * f + c);
        }
    }
    welded_mesh mesh;
    mesh.quads.resize(faces.size());
    std::vector<std::vector<welded_mesh::vertex>> vertices(planes);
    const int workers = thread_count(threads);
    // A few runs of planes for each thread: the table of corners is made once a run.
    const std::size_t runs = std::min(planes, static_cast<std::size_t>(4 * workers));
    parallel_for(runs, workers, [&](std::size_t run) {
        plane_welder welder(extent[0], extent[1]);
        for (std::size_t z = planes * run / runs; z < planes * (run + 1) / runs; ++z) {
            for (std::size_t n = begin[z]; n < begin[z + 1]; ++n) {
                const std::uint32_t id = by_plane[n];
                const voxel_face& face = faces[id / 4];
                mesh.quads[id / 4][id % 4] = welder.number_of(corners_of(face)[id % 4], face.rgb);
            }
            vertices[z] = welder.take();
        }
    });
    std::vector<std::uint32_t> first(planes);
    std::size_t count = 0;
    for (std::size_t z = 0; z < planes; ++z) {
        first[z] = static_cast<std::uint32_t>(count);
        count += vertices[z].size();
    }
    mesh.vertices.reserve(count);
    for (const auto& plane : vertices) mesh.vertices.insert(mesh.vertices.end(), plane.begin(), plane.end());
    constexpr std::size_t block = std::size_t{1} << 16;
    parallel_for((faces.size() + block - 1) / block, workers, [&](std::size_t b) {
        for (std::size_t f = b * block; f < std::min(faces.size(), (b + 1) * block); ++f) {
            const auto corners = corners_of(faces[f]);
            for (std::size_t c = 0; c < 4; ++c) mesh.quads[f][c] += first[corners[c][2]];
        }
    });
    return mesh;
}

} // namespace voxelize
