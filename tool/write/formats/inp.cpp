// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "inp.hpp"

#include "cell_sets.hpp"
#include "hexahedra.hpp"
#include "mesh_parts.hpp"
#include "model/parallel.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

constexpr std::uint64_t most_of_abaqus = 999'999'999;

// The number of a face of a C3D8 by the direction in which it looks.
constexpr std::array<std::string_view, 6> face_names{"S6", "S4", "S3", "S5", "S1", "S2"};

void append_number(std::string& text, std::uint64_t number) {
    std::array<char, 24> digits{};
    text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
}

// World coordinates of the lattice planes along an axis, of at most 20 characters, which is what Abaqus reads of one.
std::vector<std::string> short_coordinates(const voxel_shape& v, std::size_t axis) {
    constexpr std::size_t most_characters = 20;
    constexpr int decimals = 12; // beside a sign, a digit, a point and an exponent of five
    std::vector<std::string> texts;
    for (std::int64_t n = 0; n <= v.extent[axis]; ++n) {
        const double value = world(v, axis, static_cast<double>(n));
        std::string text = number(value);
        if (text.size() > most_characters) {
            std::array<char, 32> digits{};
            text.assign(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                                     std::chars_format::scientific, decimals)
                                           .ptr);
        }
        texts.push_back(std::move(text));
    }
    return texts;
}

// Numbers from 1 in lines of 16, the most that a line may have.
std::string numbered_lines(std::span<const std::uint64_t> numbers) {
    std::string text;
    for (std::size_t n = 0; n < numbers.size(); ++n) {
        append_number(text, numbers[n] + 1);
        text += n % 16 == 15 || n + 1 == numbers.size() ? "\n" : ", ";
    }
    return text;
}

// The side of an element in a direction, as a line of a surface.
void append_side(std::string& text, std::uint64_t element, unsigned direction) {
    append_number(text, element);
    text.append(", ").append(face_names[direction]).append("\n");
}

class inp_writer {
public:
    inp_writer(output_file& out, const hexahedra& mesh, const write_options& options)
        : out_(out), mesh_(mesh), threads_(options.threads), sets_(mesh, options.threads),
          sides_(has_materials() ? std::make_unique<const side_sets>(sets_, options.threads) : nullptr),
          meter_(options.progress, num_steps()) {}

    void write() {
        const std::array<std::vector<std::string>, 3> places{short_coordinates(mesh_.shape(), 0),
                                                             short_coordinates(mesh_.shape(), 1),
                                                             short_coordinates(mesh_.shape(), 2)};
        out_.write("*HEADING\nmade by voxelize\n*NODE, NSET=NODES\n");
        parts([&](std::size_t part) {
            std::string text;
            std::uint64_t number = mesh_.first_node(part);
            mesh_.for_each_node(part, [&](std::size_t x, std::size_t y, std::size_t z) {
                append_number(text, ++number);
                text.append(", ").append(places[0][x]).append(", ").append(places[1][y]);
                text.append(", ").append(places[2][z]).append("\n");
            });
            return text;
        });
        if (mesh_.num_cells() == 0) return;
        out_.write("*ELEMENT, TYPE=C3D8, ELSET=VOXELS\n");
        parts([&](std::size_t part) {
            std::string text;
            mesh_.for_each_cell(part, [&](std::uint64_t cell, const std::array<std::uint64_t, 8>& corners) {
                append_number(text, cell + 1);
                for (const std::uint64_t corner : corners) append_number(text += ", ", corner + 1);
                text += '\n';
            });
            return text;
        });
        if (has_materials()) {
            for (std::size_t set = 0; set < sets_.all().size(); ++set) write_material(set);
            for (const side_sets::side_set& set : sides_->all()) write_side_set(set);
        }
        for (unsigned direction = 0; direction < 6; ++direction) write_side(direction);
    }

private:
    [[nodiscard]] bool has_materials() const { return mesh_.shape().has_materials(); }

    // Parts to write, in all.
    [[nodiscard]] std::uint64_t num_steps() const {
        constexpr std::uint64_t of_all = 2, of_directions = 12;
        std::uint64_t steps = mesh_.num_parts() * (of_all + of_directions);
        if (!has_materials()) return steps;
        for (std::size_t set = 0; set < sets_.all().size(); ++set) {
            const std::vector<std::size_t> parts = sets_.parts_of(set);
            steps += parts.size() + mesh_.parts_of_nodes(parts).size();
        }
        for (const side_sets::side_set& set : sides_->all())
            steps += set.parts.size() + (set.is_first() ? sides_->parts_of_nodes(set).size() : 0);
        return steps;
    }

    // Writes what make(part) returns, for some parts or all of them.
    template <class Make>
    void parts(std::span<const std::size_t> some, const Make& make) {
        ordered_for(
            some.size(), thread_count(threads_), [&](std::size_t n) { return make(some[n]); },
            [&](std::size_t, const std::string& text) {
                out_.write(text);
                meter_.advance(1);
            });
    }
    template <class Make>
    void parts(const Make& make) {
        ordered_for(mesh_.num_parts(), thread_count(threads_), make, [&](std::size_t, const std::string& text) {
            out_.write(text);
            meter_.advance(1);
        });
    }
    void write_material(std::size_t set) {
        const std::string& name = sets_.all()[set].name;
        const std::vector<std::size_t> of_set = sets_.parts_of(set);
        out_.write("*ELSET, ELSET=" + name + "\n");
        parts(of_set, [&](std::size_t part) {
            std::vector<std::uint64_t> numbers;
            mesh_.for_each_voxel(part, [&](std::uint64_t cell, std::size_t brick, const glm::ivec3& voxel) {
                if (sets_.set_of(brick, voxel) == set) numbers.push_back(cell);
            });
            return numbered_lines(numbers);
        });
        out_.write("*NSET, NSET=" + name + "\n");
        const cell_choice cells = sets_.cells_of(set);
        parts(mesh_.parts_of_nodes(of_set),
              [&](std::size_t part) { return numbered_lines(mesh_.nodes_of_cells(part, cells)); });
    }
    void write_side_set(const side_sets::side_set& set) {
        const side_choice sides = sides_->choice_of(set);
        if (set.is_first()) { // the other one of two has the same nodes
            out_.write("*NSET, NSET=NODES_" + set.name + "\n");
            parts(sides_->parts_of_nodes(set),
                  [&](std::size_t part) { return numbered_lines(mesh_.nodes_of_sides(part, sides)); });
        }
        out_.write("*SURFACE, TYPE=ELEMENT, NAME=SIDES_" + set.name + "\n");
        std::vector<std::size_t> of_set;
        for (const side_sets::of_part& each : set.parts) of_set.push_back(each.part);
        parts(of_set, [&](std::size_t part) {
            std::string text;
            std::uint64_t number = mesh_.first_cell(part);
            for (const std::uint8_t directions : mesh_.sides_of_cells(part, sides)) {
                ++number;
                for (unsigned bits = directions; bits != 0; bits &= bits - 1)
                    append_side(text, number, static_cast<unsigned>(std::countr_zero(bits)));
            }
            return text;
        });
    }
    void write_side(unsigned direction) {
        const std::string name(direction_names[direction]);
        out_.write("*NSET, NSET=NODES_" + name + "\n");
        parts([&](std::size_t part) { return numbered_lines(mesh_.nodes_at_side(part, direction)); });
        out_.write("*SURFACE, TYPE=ELEMENT, NAME=SIDES_" + name + "\n");
        parts([&](std::size_t part) {
            std::string text;
            for (const std::uint64_t cell : mesh_.cells_at_side(part, direction))
                append_side(text, cell + 1, direction);
            return text;
        });
    }

    output_file& out_;
    const hexahedra& mesh_;
    int threads_;
    cell_sets sets_;
    std::unique_ptr<const side_sets> sides_; // where there are materials
    progress_meter meter_;
};

} // namespace

std::vector<std::filesystem::path> write_inp(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    output_file out(path);
    const hexahedra mesh(v, options.threads);
    const std::uint64_t most = options.highest_number != 0 ? options.highest_number : most_of_abaqus;
    if (mesh.num_nodes() > most)
        throw write_error(path, ".inp numbers its nodes up to " + std::to_string(most) + ", and there are " +
                                    std::to_string(mesh.num_nodes()) + "; .vtu and .msh hold more");
    inp_writer(out, mesh, options).write();
    out.commit();
    return {path};
}

} // namespace voxelize
