// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// Meshes of voxels are closed manifolds, whatever the voxels: judged by edges and cycles of faces, which say nothing of
// how the mesh was made.

#include "../../test_scale.hpp"
#include "test_volumes.hpp"
#include "write/formats/formats.hpp"
#include "write/formats/voxel_mesh.hpp"
#include "write/formats/voxel_sheets.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <vector>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class MeshManifold : public in_folder {};

using quad = std::array<std::uint32_t, 4>;

// How far a mesh is from a closed manifold.
struct faults {
    std::size_t edges = 0;      // directed edges that are there twice, or whose opposite is not there
    std::size_t vertices = 0;   // vertices whose faces are not one cycle
    std::size_t degenerate = 0; // faces that have a vertex twice

    friend bool operator==(const faults&, const faults&) = default;
    friend std::ostream& operator<<(std::ostream& out, const faults& f) {
        return out << f.edges << " edges, " << f.vertices << " vertices, " << f.degenerate << " degenerate";
    }
};

template <class Faces>
faults faults_of(const Faces& faces, std::size_t num_vertices) {
    faults result;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges, links; // links: across a face, around a vertex
    std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> around(num_vertices);
    for (const auto& face : faces) {
        const std::size_t n = face.size();
        for (std::size_t c = 0; c < n; ++c) {
            edges.emplace_back(face[c], face[(c + 1) % n]);
            around[face[c]].emplace_back(face[(c + 1) % n], face[(c + n - 1) % n]);
            for (std::size_t d = c + 1; d < n; ++d) result.degenerate += face[c] == face[d] ? 1 : 0;
        }
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t n = 0; n < edges.size(); ++n) {
        if (n != 0 && edges[n] == edges[n - 1]) ++result.edges;
        if (!std::binary_search(edges.begin(), edges.end(), std::pair(edges[n].second, edges[n].first))) ++result.edges;
    }
    for (const auto& faces_here : around) {
        if (faces_here.empty()) {
            ++result.vertices; // a vertex of no face
            continue;
        }
        std::size_t steps = 0;
        std::uint32_t at = faces_here.front().first;
        do {
            const auto next =
                std::find_if(faces_here.begin(), faces_here.end(), [at](const auto& face) { return face.first == at; });
            if (next == faces_here.end()) break;
            at = next->second;
            ++steps;
        } while (at != faces_here.front().first && steps <= faces_here.size());
        result.vertices += steps == faces_here.size() ? 0 : 1;
    }
    return result;
}

// Six times the volume that faces of unit squares enclose, in cubes.
double volume_of(const welded_mesh& mesh) {
    double sum = 0;
    for (const quad& q : mesh.quads)
        for (std::size_t t = 1; t < 3; ++t) {
            const auto &a = mesh.vertices[q[0]].corner, &b = mesh.vertices[q[t]].corner,
                       &c = mesh.vertices[q[t + 1]].corner;
            for (std::size_t x = 0; x < 3; ++x) {
                const std::size_t y = (x + 1) % 3, z = (x + 2) % 3;
                sum +=
                    static_cast<double>(a[x]) * (static_cast<double>(b[y]) * c[z] - static_cast<double>(b[z]) * c[y]);
            }
        }
    return sum;
}

welded_mesh mesh_of(const volume& v, bool splits_colors = false) {
    return weld(voxel_faces(voxel_shape(v, 1), false, 1, {}), v.extent, 1, splits_colors);
}

void expect_manifold(const volume& v, const std::string& what) {
    const welded_mesh mesh = mesh_of(v);
    EXPECT_EQ(faults{}, faults_of(mesh.quads, mesh.vertices.size())) << what;
    EXPECT_EQ(6.0 * static_cast<double>(v.popcount()), volume_of(mesh)) << what;
}

// All sets of voxels of a small box, side by side with empty voxels between them.
volume all_sets_of(std::array<std::int64_t, 3> box) {
    const std::int64_t bits = box[0] * box[1] * box[2], sets = std::int64_t{1} << bits;
    std::array<std::int64_t, 3> count{1, 1, 1};
    for (std::size_t a = 0; count[0] * count[1] * count[2] < sets; a = (a + 1) % 3) count[a] *= 2;
    volume v = make_volume({count[0] * (box[0] + 1), count[1] * (box[1] + 1), count[2] * (box[2] + 1)});
    channel& occupied = v.add("occupancy", scalar::bit);
    for (std::int64_t set = 0; set < sets; ++set)
        for (std::int64_t bit = 0; bit < bits; ++bit)
            if ((set >> bit & 1) != 0)
                v.set_bit(occupied, set % count[0] * (box[0] + 1) + bit % box[0],
                          set / count[0] % count[1] * (box[1] + 1) + bit / box[0] % box[1],
                          set / count[0] / count[1] * (box[2] + 1) + bit / box[0] / box[1]);
    return v;
}

// One voxel in `density` is set, out of reach of a pattern.
volume random_volume(std::array<std::int64_t, 3> extent, double density, unsigned seed) {
    volume v = make_volume(extent);
    channel& occupied = v.add("occupancy", scalar::bit);
    std::mt19937 random(seed);
    for (std::int64_t n = 0; n < v.num_voxels(); ++n)
        if (static_cast<double>(random()) < density * 4294967296.0)
            v.set_bit(occupied, n % extent[0], n / extent[0] % extent[1], n / (extent[0] * extent[1]));
    return v;
}

// The triangles of a .stl, whose vertices are joined by their bytes.
struct joined_stl {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::size_t num_vertices = 0;
};
joined_stl read_stl(const std::filesystem::path& path) {
    const std::string bytes = read_file(path);
    joined_stl mesh;
    std::map<std::string, std::uint32_t> numbers;
    for (std::size_t at = 84; at + 50 <= bytes.size(); at += 50) {
        auto& triangle = mesh.triangles.emplace_back();
        for (std::size_t c = 0; c < 3; ++c)
            triangle[c] =
                numbers.emplace(bytes.substr(at + 12 + 12 * c, 12), static_cast<std::uint32_t>(numbers.size()))
                    .first->second;
    }
    mesh.num_vertices = numbers.size();
    return mesh;
}

} // namespace

// The theorem's count, and that sheets have the same numbers along every axis.
TEST_F(MeshManifold, ThirtySixCornersHaveOneEdgeToChange) {
    for (int axis = 0; axis < 3; ++axis) {
        const voxel_sheets& table = voxel_sheets::along(axis);
        int to_change = 0, several = 0;
        for (unsigned mask = 0; mask < 256; ++mask) {
            to_change += table.edge_to_change(mask) != voxel_sheets::no_edge ? 1 : 0;
            bool has_several = false;
            for (unsigned place = 0; place < 4; ++place) {
                const unsigned sheet = table.sheet(mask, false, place & 1U, place >> 1U);
                EXPECT_GE(4U, sheet);
                has_several = has_several || sheet > 0;
            }
            several += has_several ? 1 : 0;
        }
        EXPECT_EQ(36, to_change);
        EXPECT_LT(60, several);
    }
}

TEST_F(MeshManifold, EverySetOfEightVoxels) { expect_manifold(all_sets_of({2, 2, 2}), "2 x 2 x 2"); }

// Both ends of an edge between corners: all neighbours that a corner looks at.
TEST_F(MeshManifold, EverySetOfTwelveVoxels) {
    for (const std::array<std::int64_t, 3> box :
         {std::array<std::int64_t, 3>{3, 2, 2}, std::array<std::int64_t, 3>{2, 3, 2},
          std::array<std::int64_t, 3>{2, 2, 3}})
        expect_manifold(all_sets_of(box), std::to_string(box[0]) + std::to_string(box[1]) + std::to_string(box[2]));
}

TEST_F(MeshManifold, RandomVoxelsDenseSparseAndInSlabs) {
    const bool slow = tests::is_slow_build();
    for (unsigned seed = 0; seed < (slow ? 20U : 200U); ++seed)
        expect_manifold(random_volume({4, 4, 4}, 0.3 + 0.002 * seed, seed), "4^3, seed " + std::to_string(seed));
    for (const double density : {0.02, 0.3, 0.5, 0.7, 0.98})
        for (const std::array<std::int64_t, 3> extent :
             {std::array<std::int64_t, 3>{19, 18, 17}, std::array<std::int64_t, 3>{60, 33, 1},
              std::array<std::int64_t, 3>{1, 40, 37}, std::array<std::int64_t, 3>{45, 2, 29}})
            expect_manifold(random_volume(extent, density, 7), "density " + std::to_string(density));
}

// Two voxels that touch in an edge are two bodies: the edge has two faces of each.
TEST_F(MeshManifold, VoxelsThatTouchInAnEdgeOrACornerComeApart) {
    for (const std::int64_t z : {0, 1}) {
        volume v = make_volume({2, 2, 2});
        channel& occupied = v.add("occupancy", scalar::bit);
        v.set_bit(occupied, 0, 0, 0);
        v.set_bit(occupied, 1, 1, z);
        const welded_mesh mesh = mesh_of(v);
        EXPECT_EQ(16u, mesh.vertices.size());
        expect_manifold(v, "two voxels");
    }
}

// A plane with more places than most_places() has a hash map of its corners: the mesh is the same.
TEST_F(MeshManifold, WidePlanesHaveTheSameMesh) {
    volume v = random_volume({9, 8, 7}, 0.5, 5);
    channel& color = v.add("color", scalar::u8, 4);
    for (std::size_t n = 0; n < color.data.size(); ++n) color.data[n] = static_cast<std::byte>(n / 16 % 3);
    const std::vector<voxel_face> faces = voxel_faces(voxel_shape(v, 1), false, 1, {});
    const std::array<std::int64_t, 3> wide{1 << 20, 1 << 20, 7};
    ASSERT_GT(std::uint64_t{1} << 40, most_places(faces.size()));
    for (const bool splits : {false, true}) {
        const welded_mesh narrow = weld(faces, v.extent, 2, splits), far = weld(faces, wide, 2, splits);
        EXPECT_TRUE(narrow.quads == far.quads);
        ASSERT_EQ(narrow.vertices.size(), far.vertices.size());
        for (std::size_t n = 0; n < far.vertices.size(); ++n) {
            EXPECT_EQ(narrow.vertices[n].corner, far.vertices[n].corner);
            EXPECT_EQ(narrow.vertices[n].rgb_and_sheet, far.vertices[n].rgb_and_sheet);
        }
    }
}

// Colours split vertices, and nothing else: without them it is the mesh that was.
TEST_F(MeshManifold, ColoursSplitVerticesOnlyWhereFacesDiffer) {
    volume v = random_volume({9, 8, 7}, 0.5, 3);
    channel& color = v.add("color", scalar::u8, 4);
    for (std::size_t n = 0; n < color.data.size(); ++n) color.data[n] = static_cast<std::byte>(n / 16 % 3);
    const std::vector<voxel_face> faces = voxel_faces(voxel_shape(v, 1), false, 1, {});
    const welded_mesh whole = weld(faces, v.extent, 1, false), split = weld(faces, v.extent, 1, true);
    EXPECT_EQ(faults{}, faults_of(whole.quads, whole.vertices.size()));
    ASSERT_EQ(whole.quads.size(), split.quads.size());
    std::map<std::uint32_t, std::uint32_t> origin; // of a vertex of the split mesh
    std::map<std::uint32_t, std::map<std::uint32_t, int>> colors_at;
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (std::size_t c = 0; c < 4; ++c) {
            const std::uint32_t from = whole.quads[f][c], to = split.quads[f][c];
            EXPECT_EQ(from, origin.emplace(to, from).first->second);
            ++colors_at[from][faces[f].rgb];
        }
    std::size_t wanted = 0;
    for (const auto& [vertex, colors] : colors_at) wanted += colors.size();
    EXPECT_EQ(wanted, split.vertices.size());
}

// Readers join the vertices of .stl by position.
TEST_F(MeshManifold, AnStlJoinedByPositionIsOne) {
    std::vector<std::string> warnings;
    write_options options;
    options.warn = [&](const std::string& line) { warnings.push_back(line); };
    std::size_t n = 0;
    for (const volume& v :
         {all_sets_of({2, 2, 2}), random_volume({12, 11, 10}, 0.5, 7), random_volume({60, 33, 1}, 0.4, 8)}) {
        const std::filesystem::path path = folder_ / ("m" + std::to_string(n++) + ".stl");
        write(v, path, options);
        const joined_stl mesh = read_stl(path);
        EXPECT_EQ(faults{}, faults_of(mesh.triangles, mesh.num_vertices)) << path;
        EXPECT_EQ(mesh_of(v).vertices.size(), mesh.num_vertices);
    }
    EXPECT_TRUE(warnings.empty());
    // Floats that hold the corners of the grid, but no 64th of a voxel.
    volume far = all_sets_of({2, 2, 2});
    far.origin = {1e6, 1e6, 1e6};
    write(far, folder_ / "far.stl", options);
    EXPECT_EQ(1u, warnings.size());
}

// Triangles of quads that share no corner with a sheet have none of its inset.
TEST_F(MeshManifold, AnStlWithoutTouchingPartsHasExactCorners) {
    volume v = make_volume({6, 5, 4});
    channel& occupied = v.add("occupancy", scalar::bit);
    for (std::int64_t i = 1; i < 5; ++i) v.set_bit(occupied, i, 2, 1);
    write(v, folder_ / "bar.stl");
    const std::string bytes = read_file(folder_ / "bar.stl");
    for (std::size_t at = 84; at < bytes.size(); at += 50)
        for (std::size_t c = 0; c < 9; ++c) {
            const double lattice =
                (static_cast<double>(read_value<float>(bytes, at + 12 + 4 * c)) - v.origin[c % 3]) / 0.125;
            EXPECT_EQ(std::round(lattice), lattice);
        }
}

// Every side is still there with --merge, whose vertices are those of the rectangles.
TEST_F(MeshManifold, MergedFacesHaveNoSheets) {
    const volume v = random_volume({9, 9, 9}, 0.5, 1);
    for (const voxel_face& face : voxel_faces(voxel_shape(v, 1), true, 1, {})) EXPECT_EQ(0u, face.sheets);
}
