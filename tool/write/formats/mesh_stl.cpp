// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "mesh_parts.hpp"
#include "stl.hpp"

#include <algorithm>
#include <compare>

namespace voxelize {
namespace {

// Readers of .stl join vertices by position, since the format has no others. Where a corner has several sheets, the
// vertex of each stands a little towards the middle of its sides, so that the sheets stay apart.
constexpr double inset = 1.0 / 64; // of the way to the mean of the centres of the sides

class sheet_insets {
public:
    explicit sheet_insets(std::span<const voxel_face> faces) {
        std::size_t count = 0;
        for (const voxel_face& face : faces)
            for (std::size_t c = 0; c < 4; ++c) count += face.sheet(c) != 0 ? 1 : 0;
        entries_.reserve(count);
        for (const voxel_face& face : faces) {
            if (face.sheets == 0) continue;
            const auto corners = corners_of(face);
            for (std::size_t c = 0; c < 4; ++c)
                if (face.sheet(c) != 0) entries_.push_back({corners[c], face.sheet(c), towards_middle(face, c), 1});
        }
        std::sort(entries_.begin(), entries_.end(), [](const entry& a, const entry& b) { return before(a, b); });
        std::size_t kept = 0;
        for (std::size_t n = 0; n < entries_.size(); ++n) {
            if (kept == 0 || before(entries_[kept - 1], entries_[n])) {
                entries_[kept++] = entries_[n];
                continue;
            }
            entry& same = entries_[kept - 1];
            for (std::size_t a = 0; a < 3; ++a) same.sum[a] += entries_[n].sum[a];
            ++same.sides;
        }
        entries_.resize(kept);
    }

    // Place of a corner of a face on the lattice, with its sheet's inset.
    [[nodiscard]] std::array<double, 3> place(const voxel_face& face, std::size_t corner) const {
        const std::array<std::uint32_t, 3> at = corners_of(face)[corner];
        const unsigned sheet = face.sheet(corner);
        if (sheet == 0) return {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
        return place(*std::lower_bound(entries_.begin(), entries_.end(), entry{at, sheet, {}, 0},
                                       [](const entry& a, const entry& b) { return before(a, b); }));
    }

    // True if the floats of two sheets of a corner are the same.
    [[nodiscard]] bool floats_join_sheets(const voxel_shape& v) const {
        const auto rounded = [&](const entry& e) {
            std::array<float, 3> floats{};
            const std::array<double, 3> at = place(e);
            for (std::size_t a = 0; a < 3; ++a) floats[a] = static_cast<float>(world(v, a, at[a]));
            return floats;
        };
        for (std::size_t n = 0; n < entries_.size(); ++n)
            for (std::size_t m = n + 1; m < entries_.size() && entries_[m].corner == entries_[n].corner; ++m)
                if (rounded(entries_[n]) == rounded(entries_[m])) return true;
        return false;
    }

private:
    // A sheet at a corner: how many sides it has there, and twice the sum of the ways to their centres.
    struct entry {
        std::array<std::uint32_t, 3> corner;
        unsigned sheet;
        std::array<int, 3> sum;
        int sides;
    };
    static bool before(const entry& a, const entry& b) {
        return a.corner != b.corner ? a.corner < b.corner : a.sheet < b.sheet;
    }
    static std::array<int, 3> towards_middle(const voxel_face& face, std::size_t corner) {
        const auto corners = corners_of(face);
        std::array<int, 3> way{};
        for (std::size_t a = 0; a < 3; ++a)
            way[a] = static_cast<int>(corners[(corner + 2) % 4][a]) - static_cast<int>(corners[corner][a]);
        return way;
    }
    static std::array<double, 3> place(const entry& e) {
        std::array<double, 3> at{};
        for (std::size_t a = 0; a < 3; ++a) at[a] = e.corner[a] + inset * e.sum[a] / (2 * e.sides);
        return at;
    }

    std::vector<entry> entries_; // by corner, then sheet
};

// True if two neighbouring planes of the lattice become one as floats.
bool floats_merge_planes(const voxel_shape& v) {
    for (std::size_t a = 0; a < 3; ++a)
        for (std::int64_t n = 0; n < v.extent[a]; ++n) {
            const auto here = static_cast<float>(world(v, a, static_cast<double>(n)));
            if (here == static_cast<float>(world(v, a, static_cast<double>(n + 1)))) return true;
        }
    return false;
}

} // namespace

std::vector<std::filesystem::path> write_stl(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    auto probe = std::make_unique<output_file>(path);
    const halves_of_progress halves(options);
    const std::vector<voxel_face> faces = voxel_faces(v, options.merge_faces, options.threads, halves.first, false);
    const sheet_insets insets(faces);
    if (options.warn && (floats_merge_planes(v) || insets.floats_join_sheets(v)))
        options.warn(path.string() + ": the floats of .stl cannot tell neighbouring corners of this grid apart, which "
                                     "is far from 0 for its voxel size; .ply and .obj can");
    return write_parts(std::move(probe), faces, path, options, max_faces, halves.second,
                       [&](output_file& out, std::span<const voxel_face> part, progress_meter& meter) {
                           write_stl_triangles(
                               out, 2 * std::uint64_t{part.size()}, options.threads, meter, [&](std::size_t n) {
                                   const voxel_face& face = part[n / 2];
                                   stl_triangle triangle{};
                                   for (std::size_t c = 0; c < 3; ++c) {
                                       const std::array<double, 3> at = insets.place(face, c == 0 ? 0 : c + n % 2);
                                       for (std::size_t a = 0; a < 3; ++a) triangle[c][a] = world(v, a, at[a]);
                                   }
                                   return triangle;
                               });
                       });
}

} // namespace voxelize
