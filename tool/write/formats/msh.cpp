// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "msh.hpp"

#include "cell_sets.hpp"
#include "hexahedra.hpp"
#include "mesh_parts.hpp"
#include "write_items.hpp"

#include <array>
#include <limits>
#include <string>
#include <vector>

namespace voxelize {
namespace {

constexpr std::int32_t gmsh_hexahedron = 5, of_volumes = 3;

class msh_writer {
public:
    msh_writer(output_file& out, const hexahedra& mesh, const cell_sets& sets, const write_options& options)
        : out_(out), mesh_(mesh), sets_(sets), threads_(options.threads),
          meter_(options.progress, mesh.num_parts() * (2 + sets.all().size())) {}

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
        const std::uint64_t cells = mesh_.num_cells();
        for (const std::uint64_t n : {std::uint64_t{sets_.all().size()}, cells, blocks, cells}) put(text, n);
        out_.write(text);
        for (std::size_t set = 0; set < sets_.all().size(); ++set) write_elements(set);
        out_.write("\n$EndElements\n");
    }

private:
    [[nodiscard]] std::int32_t tag(std::size_t set) const {
        return static_cast<std::int32_t>(sets_.all()[set].number + 1);
    }

    void add_groups(std::string& text) const {
        const auto& sets = sets_.all();
        text += "$PhysicalNames\n" + std::to_string(sets.size()) + "\n";
        for (std::size_t set = 0; set < sets.size(); ++set)
            text += "3 " + std::to_string(tag(set)) + " \"" + sets[set].name + "\"\n";
        text += "$EndPhysicalNames\n$Entities\n";
        for (const std::uint64_t count :
             {std::uint64_t{0}, std::uint64_t{0}, std::uint64_t{0}, std::uint64_t{sets.size()}})
            put(text, count);
        for (std::size_t set = 0; set < sets.size(); ++set) {
            put(text, tag(set));
            for (std::size_t a = 0; a < 3; ++a) put(text, mesh_.shape().origin[a]); // the box of the grid
            for (std::size_t a = 0; a < 3; ++a)
                put(text, world(mesh_.shape(), a, static_cast<double>(mesh_.shape().extent[a])));
            put(text, std::uint64_t{1});
            put(text, tag(set));
            put(text, std::uint64_t{0}); // of bounding surfaces
        }
        text += "\n$EndEntities\n";
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

    output_file& out_;
    const hexahedra& mesh_;
    const cell_sets& sets_;
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
    msh_writer(out, mesh, sets, options).write();
    out.commit();
    return {path};
}

} // namespace voxelize
