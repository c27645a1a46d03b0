// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "voxel_mesh.hpp"

#include "../parallel.hpp"
#include "../preview.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace voxelize {
namespace {

constexpr std::uint32_t packed(const rgb8& c) {
    return static_cast<std::uint32_t>(c[0]) | static_cast<std::uint32_t>(c[1]) << 8 |
           static_cast<std::uint32_t>(c[2]) << 16;
}

// Occupancy by words, empty outside the grid, and colours.
class voxel_reader {
public:
    explicit voxel_reader(const volume& v) : v_(v), bits_(*v.occupancy()), colors_(find_colors(v)) {}

    [[nodiscard]] std::uint32_t word(std::int64_t w, std::int64_t j, std::int64_t k) const {
        if (w < 0 || w >= v_.words_per_row() || j < 0 || j >= v_.extent[1] || k < 0 || k >= v_.extent[2]) return 0;
        return v_.word(bits_, w, j, k);
    }
    [[nodiscard]] std::uint32_t rgb(std::int64_t i, std::int64_t j, std::int64_t k) const {
        if (colors_ == nullptr) return packed(clay);
        const std::byte* at = colors_->data.data() + v_.index(i, j, k) * colors_->components;
        return std::to_integer<std::uint32_t>(at[0]) | std::to_integer<std::uint32_t>(at[1]) << 8 |
               std::to_integer<std::uint32_t>(at[2]) << 16;
    }
    // Voxels of a word whose neighbour on that side is empty.
    [[nodiscard]] std::uint32_t exposed(int direction, std::int64_t w, std::int64_t j, std::int64_t k) const {
        const std::uint32_t here = word(w, j, k);
        if (here == 0) return 0;
        switch (direction) {
        case 0:
            return here & ~(here << 1 | word(w - 1, j, k) >> 31);
        case 1:
            return here & ~(here >> 1 | word(w + 1, j, k) << 31);
        case 2:
            return here & ~word(w, j - 1, k);
        case 3:
            return here & ~word(w, j + 1, k);
        case 4:
            return here & ~word(w, j, k - 1);
        default:
            return here & ~word(w, j, k + 1);
        }
    }

private:
    const volume& v_;
    const channel& bits_;
    const channel* colors_;
};

// Joins single sides of one plane, which come by second axis, then first.
class rectangle_merger {
public:
    rectangle_merger(std::int64_t width, std::int64_t height)
        : width_(static_cast<std::uint32_t>(width)), height_(static_cast<std::uint32_t>(height)),
          cells_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

    void merge(std::span<const voxel_face> sides, std::vector<voxel_face>& out) {
        if (sides.empty()) return;
        const std::size_t u = (sides[0].direction / 2U + 1U) % 3U;
        const std::size_t v = (sides[0].direction / 2U + 2U) % 3U;
        for (const voxel_face& side : sides) cell(side.low[u], side.low[v]) = present | side.rgb;
        for (const voxel_face& side : sides) {
            const std::uint32_t from = side.low[u];
            std::uint32_t row = side.low[v];
            const std::uint32_t color = cell(from, row);
            if (color == 0) continue; // joined to an earlier one
            std::uint32_t to = from + 1;
            while (to < width_ && cell(to, row) == color) ++to;
            do {
                for (std::uint32_t i = from; i < to; ++i) cell(i, row) = 0;
                ++row;
            } while (row < height_ && is_row_of(color, from, to, row));
            voxel_face face = side;
            face.size = {to - from, row - side.low[v]};
            out.push_back(face);
        }
    }

private:
    static constexpr std::uint32_t present = std::uint32_t{1} << 24;

    std::uint32_t& cell(std::uint32_t u, std::uint32_t v) { return cells_[static_cast<std::size_t>(v) * width_ + u]; }
    bool is_row_of(std::uint32_t color, std::uint32_t from, std::uint32_t to, std::uint32_t row) {
        for (std::uint32_t i = from; i < to; ++i)
            if (cell(i, row) != color) return false;
        return true;
    }

    std::uint32_t width_;
    std::uint32_t height_;
    std::vector<std::uint32_t> cells_; // `present` and the colour, or 0; all 0 between calls
};

// The work that a thread takes at a time: all layers along x in one column of words, or one layer along y or z.
class layer_group {
public:
    layer_group(const volume& v, const voxel_reader& reader, std::size_t axis, std::int64_t number)
        : v_(v), reader_(reader), axis_(axis), number_(number) {}

    void append(std::vector<voxel_face>& out, bool merge) const {
        std::array<std::vector<voxel_face>, 64> layers; // layer, direction; only x has more than one layer
        for (std::int64_t k = axis_ == 2 ? number_ : 0; k < (axis_ == 2 ? number_ + 1 : v_.extent[2]); ++k) {
            // Sides come by the second axis of their plane, then by the first: for y that is x by z.
            for (std::int64_t j = axis_ == 1 ? number_ : 0; j < (axis_ == 1 ? number_ + 1 : v_.extent[1]); ++j)
                for (std::int64_t w = axis_ == 0 ? number_ : 0; w < (axis_ == 0 ? number_ + 1 : v_.words_per_row());
                     ++w)
                    add_word(layers, w, j, k);
        }
        if (axis_ == 1)
            for (std::size_t side = 0; side < 2; ++side)
                std::sort(layers[side].begin(), layers[side].end(), [](const voxel_face& a, const voxel_face& b) {
                    return a.low[0] != b.low[0] ? a.low[0] < b.low[0] : a.low[2] < b.low[2];
                });
        if (!merge) {
            for (const std::vector<voxel_face>& layer : layers) out.insert(out.end(), layer.begin(), layer.end());
            return;
        }
        rectangle_merger merger(v_.extent[(axis_ + 1) % 3], v_.extent[(axis_ + 2) % 3]);
        for (const std::vector<voxel_face>& layer : layers) merger.merge(layer, out);
    }

private:
    void add_word(std::array<std::vector<voxel_face>, 64>& layers, std::int64_t w, std::int64_t j,
                  std::int64_t k) const {
        for (std::uint8_t side = 0; side < 2; ++side) {
            const auto direction = static_cast<std::uint8_t>(2 * axis_ + side);
            for (std::uint32_t bits = reader_.exposed(direction, w, j, k); bits != 0; bits &= bits - 1) {
                const int bit = std::countr_zero(bits);
                const std::int64_t i = 32 * w + bit;
                voxel_face face;
                face.low = {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j),
                            static_cast<std::uint32_t>(k)};
                face.low[axis_] += side; // the plane beyond the voxel
                face.rgb = reader_.rgb(i, j, k);
                face.direction = direction;
                layers[(axis_ == 0 ? 2 * static_cast<std::size_t>(bit) : 0) + side].push_back(face);
            }
        }
    }

    const volume& v_;
    const voxel_reader& reader_;
    std::size_t axis_;
    std::int64_t number_;
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

std::vector<voxel_face> voxel_faces(const volume& v, bool merge, int threads,
                                    const std::function<void(double)>& progress) {
    const voxel_reader reader(v);
    const std::array<std::size_t, 3> groups{static_cast<std::size_t>(v.words_per_row()),
                                            static_cast<std::size_t>(v.extent[1]),
                                            static_cast<std::size_t>(v.extent[2])};
    const std::size_t total = groups[0] + groups[1] + groups[2];
    std::vector<std::vector<voxel_face>> parts(total);
    parallel_for(
        total, thread_count(threads),
        [&](std::size_t n) {
            std::size_t axis = 0;
            std::size_t number = n;
            for (; number >= groups[axis]; ++axis) number -= groups[axis];
            layer_group(v, reader, axis, static_cast<std::int64_t>(number)).append(parts[n], merge);
        },
        [&](std::size_t finished) {
            if (progress) progress(static_cast<double>(finished) / static_cast<double>(total));
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
