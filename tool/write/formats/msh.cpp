// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "msh.hpp"

#include "cell_sets.hpp"
#include "hexahedra.hpp"
#include "mesh_parts.hpp"
#include "write_items.hpp"

#include <array>
#include <bit>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

constexpr std::int32_t gmsh_quadrangle = 3, gmsh_hexahedron = 5, of_surfaces = 2, of_volumes = 3;

// The corners of the side of a cell in each direction, counter-clockwise as seen from outside.
constexpr std::array<std::array<std::size_t, 4>, 6> corners_of_side{
    {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}};

// A surface, with its tag: each side once.
struct gmsh_surface {
    std::int32_t tag;
    const side_sets::side_set* sides;
};

// The outer sides of a volume have its tag; those between two volumes have tags above those of all volumes.
std::vector<gmsh_surface> surfaces_of(const cell_sets& sets, const side_sets& sides,
                                      const std::filesystem::path& path) {
    std::vector<gmsh_surface> surfaces;
    std::int64_t tag = sets.all().empty() ? 0 : sets.all().back().number + 1;
    for (const side_sets::side_set& set : sides.all())
        if (set.is_first())
            surfaces.push_back({static_cast<std::int32_t>(set.beside ? ++tag : sets.all()[set.of].number + 1), &set});
    if (tag > std::numeric_limits<std::int32_t>::max())
        throw write_error(path, ".msh has groups up to " + std::to_string(std::numeric_limits<std::int32_t>::max()) +
                                    ", and there are a material " + std::to_string(sets.all().back().number) +
                                    " and sides between materials, which come after it");
    return surfaces;
}

class msh_writer {
public:
    msh_writer(output_file& out, const hexahedra& mesh, const cell_sets& sets, const side_sets& sides,
               std::vector<gmsh_surface> surfaces, const write_options& options)
        : out_(out), mesh_(mesh), sets_(sets), sides_(sides), surfaces_(std::move(surfaces)), threads_(options.threads),
          meter_(options.progress, num_steps()) {}

    void write() {
        std::string text = "$MeshFormat\n4.1 1 8\n";
        put(text, std::int32_t{1}); // tells the order of bytes
        text += "\n$EndMeshFormat\n";
        add_groups(text);
        text += "$Nodes\n";
        const std::uint64_t nodes = mesh_.num_nodes(), blocks = nodes == 0 ? 0 : 1;
        for (const std::uint64_t n : {blocks, nodes, blocks, nodes}) put(text, n);
        if (nodes != 0) {
            for (const std::int32_t n : {of_volumes, tag(0), 0}) put(text, n);
            put(text, nodes);
        }
        out_.write(text);
        write_nodes();
        text = "\n$EndNodes\n$Elements\n";
        std::uint64_t elements = mesh_.num_cells();
        for (const gmsh_surface& each : surfaces_) elements += each.sides->sides;
        for (const std::uint64_t n : {std::uint64_t{sets_.all().size() + surfaces_.size()}, elements, blocks, elements})
            put(text, n);
        out_.write(text);
        for (std::size_t set = 0; set < sets_.all().size(); ++set) write_elements(set);
        std::uint64_t first = mesh_.num_cells() + 1;
        for (const gmsh_surface& each : surfaces_) {
            write_sides(each, first);
            first += each.sides->sides;
        }
        out_.write("\n$EndElements\n");
    }

private:
    [[nodiscard]] std::int32_t tag(std::size_t set) const {
        return static_cast<std::int32_t>(sets_.all()[set].number + 1);
    }

    // Parts to write, in all.
    [[nodiscard]] std::uint64_t num_steps() const {
        std::uint64_t steps = mesh_.num_parts() * (2 + sets_.all().size());
        for (const gmsh_surface& each : surfaces_) steps += each.sides->parts.size();
        return steps;
    }

    void add_groups(std::string& text) const {
        const auto& sets = sets_.all();
        text += "$PhysicalNames\n" + std::to_string(surfaces_.size() + sets.size()) + "\n";
        for (const gmsh_surface& each : surfaces_)
            text += "2 " + std::to_string(each.tag) + " \"SIDES_" + each.sides->name + "\"\n";
        for (std::size_t set = 0; set < sets.size(); ++set)
            text += "3 " + std::to_string(tag(set)) + " \"" + sets[set].name + "\"\n";
        text += "$EndPhysicalNames\n$Entities\n";
        for (const std::size_t count : {std::size_t{0}, std::size_t{0}, surfaces_.size(), sets.size()})
            put(text, std::uint64_t{count});
        for (const gmsh_surface& each : surfaces_) add_entity(text, each.tag, {});
        for (std::size_t set = 0; set < sets.size(); ++set) {
            std::vector<std::int32_t> boundary;
            for (const gmsh_surface& each : surfaces_) {
                if (each.sides->of == set) boundary.push_back(each.tag);
                if (each.sides->beside == set) boundary.push_back(-each.tag); // its quadrangles look into the volume
            }
            add_entity(text, tag(set), boundary);
        }
        text += "\n$EndEntities\n";
    }

    // A surface or a volume that is all of a physical group with its tag.
    void add_entity(std::string& text, std::int32_t tag, const std::vector<std::int32_t>& boundary) const {
        put(text, tag);
        for (std::size_t a = 0; a < 3; ++a) put(text, mesh_.shape().origin[a]); // the box of the grid
        for (std::size_t a = 0; a < 3; ++a)
            put(text, world(mesh_.shape(), a, static_cast<double>(mesh_.shape().extent[a])));
        put(text, std::uint64_t{1});
        put(text, tag);
        put(text, std::uint64_t{boundary.size()});
        for (const std::int32_t each : boundary) put(text, each);
    }

    // Writes what make(part, text) appends.
    template <class Make>
    void parts(const Make& make) {
        ordered_for(
            mesh_.num_parts(), thread_count(threads_),
            [&](std::size_t part) {
                std::string text;
                make(part, text);
                return text;
            },
            [&](std::size_t, const std::string& text) {
                out_.write(text);
                meter_.advance(1);
            });
    }

    void write_nodes() {
        parts([&](std::size_t part, std::string& text) {
            text.reserve(8 * mesh_.nodes_of(part));
            const std::uint64_t first = mesh_.first_node(part);
            for (std::uint64_t n = 1; n <= mesh_.nodes_of(part); ++n) put(text, first + n);
        });
        parts([&](std::size_t part, std::string& text) {
            text.reserve(24 * mesh_.nodes_of(part));
            mesh_.for_each_node(part, [&](std::size_t x, std::size_t y, std::size_t z) {
                const std::array<std::size_t, 3> corner{x, y, z};
                for (std::size_t a = 0; a < 3; ++a) put(text, world(mesh_.shape(), a, static_cast<double>(corner[a])));
            });
        });
    }

    void write_elements(std::size_t set) {
        std::string text;
        for (const std::int32_t n : {of_volumes, tag(set), gmsh_hexahedron}) put(text, n);
        put(text, sets_.all()[set].cells);
        out_.write(text);
        parts([&](std::size_t part, std::string& elements) {
            if (!sets_.is_in(part, set)) return;
            std::vector<bool> is_of_set(mesh_.cells_of(part));
            const std::uint64_t first = mesh_.first_cell(part);
            mesh_.for_each_voxel(part, [&](std::uint64_t cell, std::size_t brick, const glm::ivec3& voxel) {
                is_of_set[cell - first] = sets_.set_of(brick, voxel) == set;
            });
            mesh_.for_each_cell(part, [&](std::uint64_t cell, const std::array<std::uint64_t, 8>& corners) {
                if (!is_of_set[cell - first]) return;
                put(elements, cell + 1);
                for (const std::uint64_t corner : corners) put(elements, corner + 1);
            });
        });
    }

    void write_sides(const gmsh_surface& each, std::uint64_t first) {
        std::string text;
        for (const std::int32_t n : {of_surfaces, each.tag, gmsh_quadrangle}) put(text, n);
        put(text, each.sides->sides);
        out_.write(text);
        const side_choice choice = sides_.choice_of(*each.sides);
        const std::vector<side_sets::of_part>& some = each.sides->parts;
        ordered_for(
            some.size(), thread_count(threads_),
            [&](std::size_t n) {
                const std::uint64_t end = n + 1 == some.size() ? each.sides->sides : some[n + 1].first;
                return quadrangles(some[n].part, choice, first + some[n].first, end - some[n].first);
            },
            [&](std::size_t, const std::string& elements) {
                out_.write(elements);
                meter_.advance(1);
            });
    }

    // As many sides of a part, by their cells and directions, with tags from the first one on.
    [[nodiscard]] std::string quadrangles(std::size_t part, const side_choice& choice, std::uint64_t tag,
                                          std::uint64_t count) const {
        std::string text;
        text.reserve(count * 5 * sizeof(std::uint64_t));
        const std::vector<std::uint8_t> sides = mesh_.sides_of_cells(part, choice);
        const std::uint64_t first = mesh_.first_cell(part);
        mesh_.for_each_cell(part, [&](std::uint64_t cell, const std::array<std::uint64_t, 8>& corners) {
            for (unsigned bits = sides[cell - first]; bits != 0; bits &= bits - 1) {
                put(text, tag++);
                for (const std::size_t corner : corners_of_side[static_cast<std::size_t>(std::countr_zero(bits))])
                    put(text, corners[corner] + 1);
            }
        });
        return text;
    }

    output_file& out_;
    const hexahedra& mesh_;
    const cell_sets& sets_;
    const side_sets& sides_;
    std::vector<gmsh_surface> surfaces_;
    int threads_;
    progress_meter meter_;
};

} // namespace

std::vector<std::filesystem::path> write_msh(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    output_file out(path);
    const hexahedra mesh(v, options.threads);
    const cell_sets sets(mesh, options.threads);
    for (const cell_sets::cell_set& set : sets.all())
        if (set.number >= std::numeric_limits<std::int32_t>::max())
            throw write_error(path, ".msh has groups up to " +
                                        std::to_string(std::numeric_limits<std::int32_t>::max()) +
                                        ", and there is a material " + std::to_string(set.number));
    const side_sets sides(sets, options.threads);
    msh_writer(out, mesh, sets, sides, surfaces_of(sets, sides, path), options).write();
    out.commit();
    return {path};
}

} // namespace voxelize
