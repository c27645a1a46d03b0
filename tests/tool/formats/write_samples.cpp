// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Writes the files that read_back.py reads, and manifest.json, which says what they hold: write_samples FOLDER.

#include "model/targets.hpp"
#include "test_volumes.hpp"
#include "write/formats/blocks.hpp"
#include "write/formats/formats.hpp"
#include "write/sparse_formats.hpp"

#include <cstdio>
#include <iostream>
#include <limits>
#include <map>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

struct sample_case {
    std::string name;
    volume v;
    std::uint32_t density; // one voxel in so many is set; 0: none
    std::vector<std::string> extensions;
    write_options options;
};

volume with_channels(std::array<std::int64_t, 3> extent, std::uint32_t density, bool color, bool all_types) {
    volume v = make_volume(extent);
    v.add("occupancy", scalar::bit);
    if (color) v.add("color", scalar::u8, 4);
    if (all_types)
        for (int type = 1; type < 10; ++type)
            for (int components = 1; components <= 4; ++components)
                v.add(std::string(name_of(static_cast<scalar>(type))) + "x" + std::to_string(components),
                      static_cast<scalar>(type), components);
    for (std::size_t n = density == 0 ? 1 : 0; n < v.channels.size(); ++n) fill(v, n, density);
    return v;
}

// Every target, empty where no voxel is occupied; three materials, numbers of triangles.
volume with_targets(std::array<std::int64_t, 3> extent, std::uint32_t density) {
    volume v = make_volume(extent);
    for (const target_info& info : target_table) v.add(std::string(info.name), info.type, info.components);
    for (std::size_t n = 0; n < v.channels.size(); ++n) fill(v, n, density);
    for (std::size_t n = 1; n < v.channels.size(); ++n) {
        const std::size_t each = v.channels[n].data.size() / static_cast<std::size_t>(v.num_voxels());
        for (std::int64_t at = 0; at < v.num_voxels(); ++at) {
            std::byte* const value = v.channels[n].data.data() + static_cast<std::size_t>(at) * each;
            std::uint32_t bits;
            std::memcpy(&bits, value, 4);
            if (target_table[n].id == target::material) bits %= 3;
            if (target_table[n].id == target::triangle) bits &= 0x7fffffff;
            if (v.occupied(at % extent[0], at / extent[0] % extent[1], at / (extent[0] * extent[1])))
                std::memcpy(value, &bits, 4);
            else
                for (std::size_t i = 0; i < each; i += 4) std::memcpy(value + i, &target_table[n].empty, 4);
        }
    }
    return v;
}

// 300 blocks of generated colours, and two of materials.
std::shared_ptr<const block_list> many_blocks() {
    auto list = std::make_shared<block_list>();
    for (std::uint32_t n = 0; n < 300; ++n) {
        list->names.push_back("test:block_" + std::to_string(n) + (n % 7 == 0 ? "[axis=y,lit=true]" : ""));
        const std::uint32_t h = pattern(n, 1, 2, 0, 0);
        list->colors.push_back(
            {{static_cast<std::uint8_t>(h), static_cast<std::uint8_t>(h >> 8U), static_cast<std::uint8_t>(h >> 16U)},
             static_cast<std::uint16_t>(n + 1)});
    }
    list->names.emplace_back("minecraft:glass");
    list->of_number = {{1, 301}, {3, 2}, {4, 301}};
    return list;
}

// Numbers from -1 to 4.
void add_materials(volume& v) {
    channel& c = v.add("material", scalar::i32);
    for (std::int64_t k = 0; k < v.extent[2]; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i)
                store(c.data.data() + 4 * v.index(i, j, k), static_cast<std::int32_t>(pattern(i, j, k, 9, 0) % 6) - 1);
}

// Floats around 0 to 1, and NaN: (i + 2 j + 3 k) / 64 - 0.25.
void fill_shares(volume& v) {
    channel& c = v.add("fraction", scalar::f32);
    for (std::int64_t k = 0; k < v.extent[2]; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i)
                store(c.data.data() + 4 * v.index(i, j, k), static_cast<float>(i + 2 * j + 3 * k) / 64 - 0.25F);
    store(c.data.data(), std::numeric_limits<float>::quiet_NaN());
}

// The faces across an axis, with the channel aperture_x, aperture_y or aperture_z.
volume faces_of(const volume& v, std::size_t axis) {
    volume faces = v;
    faces.channels.clear();
    faces.faces.clear();
    ++faces.extent[axis];
    faces.origin[axis] -= faces.voxel_size[axis] / 2;
    faces.add(std::string("aperture_") + "xyz"[axis], scalar::f32);
    fill(faces, 0);
    return faces;
}

std::vector<sample_case> make_cases() {
    const std::vector<std::string> any{".npy", ".npz", ".vti", ".pvti", ".nrrd", ".nii", ".nii.gz", ".zarr"};
    const std::vector<std::string> solid{".npy",   ".npz",       ".vti",    ".nrrd", ".zarr", ".vox",
                                         ".schem", ".litematic", ".binvox", ".glb",  ".obj",  ".ply",
                                         ".stl",   ".3mf",       ".xyz",    ".png",  ".html", ".vtu"};
    const std::vector<std::string> meshes{".glb", ".obj", ".ply", ".stl", ".3mf"};
    std::vector<sample_case> cases;
    const auto add = [&](const char* name, std::array<std::int64_t, 3> extent, std::uint32_t density, bool color,
                         bool all_types, const std::vector<std::string>& extensions) -> sample_case& {
        cases.push_back({name, with_channels(extent, density, color, all_types), density, extensions, {}});
        cases.back().options.preview.width = 160;
        cases.back().options.preview.height = 120;
        return cases.back();
    };
    add("one", {1, 1, 1}, 1, true, false, solid);
    add("plain", {32, 32, 32}, 5, false, false, solid);
    add("odd", {37, 23, 11}, 5, true, false, solid);
    add("words", {65, 33, 9}, 3, true, false, solid);
    add("thin", {3, 1, 200}, 2, true, false, solid);
    add("long", {300, 17, 40}, 23, true, false, solid);
    add("split", {260, 40, 513}, 997, true, false, {".vox", ".schem", ".binvox"}).options.up = up_axis::z;
    add("upright", {26, 40, 51}, 17, true, false, {".litematic"}).options.up = up_axis::z;
    add("split_y", {270, 513, 33}, 997, true, false, {".vox"});
    add("empty", {9, 8, 7}, 0, false, false,
        {".npy", ".npz", ".vti", ".nrrd", ".nii", ".zarr", ".schem", ".litematic", ".binvox", ".glb",
         ".obj", ".ply", ".stl", ".3mf",  ".xyz", ".png",  ".html",  ".vtu",       ".inp",    ".msh"});
    add("merged", {40, 33, 21}, 2, false, false, meshes).options.merge_faces = true;
    add("merged_colors", {40, 33, 21}, 1, true, false, meshes).options.merge_faces = true;
    add("pieces", {37, 23, 11}, 5, true, false, meshes).options.faces_per_file = 1000;
    add("points", {37, 23, 11}, 5, true, false, {".ply"}).options.points = true;
    add("boxes", {37, 23, 11}, 5, true, false, {".glb", ".obj", ".ply", ".stl", ".3mf", ".xyz", ".vtu", ".inp", ".msh"})
        .v.voxel_size = {0.1, 0.25, 3};
    sample_case& flat = add("stored", {37, 23, 11}, 5, true, false, {".3mf", ".vtu"});
    flat.options.compression = 0;
    // Blocks of a list: of three materials out of five, and of more colours than a byte can number.
    sample_case& listed = add("listed", {37, 23, 11}, 2, true, false, {".schem", ".litematic"});
    listed.options.blocks = many_blocks();
    add_materials(listed.v);
    // Faces between voxels, beside voxels and alone.
    sample_case& faces =
        add("faces", {13, 7, 5}, 5, true, false, {".vti", ".npy", ".npz", ".nrrd", ".nii", ".nii.gz", ".zarr"});
    faces.v.voxel_size = {0.1, 0.25, 3};
    for (std::size_t axis = 0; axis < 3; ++axis) faces.v.faces.push_back(faces_of(faces.v, axis));
    cases.push_back(cases.back());
    cases.back().name = "only_faces";
    cases.back().v.channels.clear();
    cases.push_back(cases.back());
    cases.back().name = "one_face";
    cases.back().v.faces.resize(1);
    // Hexahedra: of five materials and of voxels without, by fractions, and with numbers of 64 bits.
    const std::vector<std::string> hexahedra{".vtu", ".inp", ".msh"};
    add_materials(add("materials", {70, 13, 11}, 2, true, false, hexahedra).v);
    add("none", {9, 8, 7}, 5, false, false, hexahedra).v.add("material", scalar::i32); // all are of number 0
    sample_case& chosen = add("chosen", {37, 23, 11}, 5, false, false, hexahedra);
    chosen.v.add("fraction", scalar::f32);
    fill(chosen.v, 1);
    chosen.options.threshold = 0.125;
    add("wide", {37, 23, 11}, 5, false, false, {".vtu"}).options.highest_number = 1000;
    sample_case& types = add("types", {13, 7, 5}, 2, false, true, any);
    types.v.voxel_size = {0.1, 0.25, 3};
    types.extensions.insert(types.extensions.end(), {".html", ".vtu"});
    types.options.pieces = 3;
    sample_case& raw = add("raw", {13, 7, 5}, 2, false, true, any);
    raw.extensions.emplace_back(".vtu");
    raw.options.compression = 0;
    raw.options.space = patient_axes::ras;
    if (has_zstd()) add("zstd", {150, 70, 90}, 5, true, false, {".zarr"}).options.zstd = true;
    // Channels of every type that .nvdb has. Floats come first, since tinyvdb reads the first grid alone.
    sample_case& grids = add("grids", {150, 17, 40}, 5, false, false, {".nvdb"});
    grids.v.channels.clear();
    grids.v.add("f32x1", scalar::f32);
    grids.v.add("occupancy", scalar::bit);
    grids.v.add("color", scalar::u8, 4);
    grids.v.add("f32x3", scalar::f32, 3);
    grids.v.add("u32x1", scalar::u32);
    grids.v.add("i32x1", scalar::i32);
    for (std::size_t n = 0; n < grids.v.channels.size(); ++n) fill(grids.v, n, grids.density);
    add("slabs", grids.v.extent, 5, false, false, {".nvdb"}).v = grids.v;
    cases.back().options.pieces = 3;
    cases.push_back({"levels", with_targets({150, 20, 270}, 7), 7, {".zarr"}, {}});
    cases.back().v.voxel_size = {0.1, 0.25, 3};
    cases.back().options.levels = true;
    add("slices", {37, 23, 11}, 5, false, false, {"/{z}.png"});
    sample_case& shares = add("shares", {37, 23, 300}, 5, false, false, {"/{z}.png"});
    shares.v.channels.clear();
    fill_shares(shares.v);
    shares.options.compression = 0;
    cases.push_back(shares);
    cases.back().name = "bytes_of_shares";
    cases.back().options.slice_bits = 8;
    add("glass", {16, 16, 16}, 2, true, false, {".png"}).options.preview.backdrop = *parse_background("transparent");
    return cases;
}

std::string list_of(const auto& values) {
    std::string out;
    for (const auto value : values) {
        std::array<char, 40> text{};
        std::snprintf(text.data(), text.size(), "%.17g", static_cast<double>(value));
        if (!out.empty()) out += ", ";
        out += text.data();
    }
    return out;
}

std::string describe(const sample_case& c, const std::map<std::string, std::vector<std::string>>& files) {
    std::string out = "  {\"name\": \"" + c.name + "\", \"density\": " + std::to_string(c.density);
    out += ", \"clay\": [" + list_of(clay) + "], \"up\": \"";
    out += c.options.up == up_axis::y ? "y" : "z";
    out += std::string("\", \"space\": \"") + (c.options.space == patient_axes::lps ? "lps" : "ras");
    out += std::string("\", \"merge\": ") + (c.options.merge_faces ? "true" : "false") +
           ", \"points\": " + (c.options.points ? "true" : "false");
    out += ", \"extent\": [" + list_of(c.v.extent) + "], \"origin\": [" + list_of(c.v.origin);
    out += "], \"voxel_size\": [" + list_of(c.v.voxel_size) + "],\n   \"channels\": [";
    for (std::size_t n = 0; n < c.v.channels.size(); ++n) {
        const channel& ch = c.v.channels[n];
        if (n != 0) out += ", ";
        out.append("[\"").append(ch.name).append("\", \"").append(name_of(ch.type));
        out.append("\", ").append(std::to_string(ch.components)).append("]");
    }
    out += "],\n   \"faces\": [";
    for (const volume& f : c.v.faces) {
        if (&f != &c.v.faces.front()) out += ", ";
        out.append("\"").append(f.channels.front().name).append("\"");
    }
    out += "],\n   \"threshold\": " + list_of(std::array{c.options.threshold}) + ", \"listed\": ";
    out += c.options.blocks ? "true" : "false";
    out += ", \"files\": {";
    bool first = true;
    for (const auto& [extension, paths] : files) {
        if (!first) out += ", ";
        first = false;
        out.append("\"").append(extension).append("\": [");
        for (std::size_t n = 0; n < paths.size(); ++n) {
            if (n != 0) out += ", ";
            out.append("\"").append(paths[n]).append("\"");
        }
        out += "]";
    }
    return out + "}}";
}

// What the blocks of a list are, for the reader: names, colours with their numbers, numbers of materials.
void write_table(const std::filesystem::path& path, const block_list& list) {
    std::string names, colors, materials;
    for (const std::string& name : list.names) names += (names.empty() ? "\"" : ", \"") + name + "\"";
    for (const block_list::of_color& c : list.colors)
        colors += (colors.empty() ? "[[" : ", [[") + list_of(c.color) + "], " + std::to_string(c.block) + "]";
    for (const auto& [number, block] : list.of_number)
        materials += (materials.empty() ? "[" : ", [") + std::to_string(number) + ", " + std::to_string(block) + "]";
    std::ofstream(path) << "{\"names\": [" << names << "],\n\"colors\": [" << colors << "],\n\"materials\": ["
                        << materials << "]}\n";
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::cerr << "usage: write_samples FOLDER\n";
        return 2;
    }
    try {
        const std::filesystem::path folder = argv[1];
        std::filesystem::remove_all(folder);
        std::filesystem::create_directories(folder);
        std::string manifest;
        for (const sample_case& c : make_cases()) {
            std::map<std::string, std::vector<std::string>> files;
            for (const std::string& extension : c.extensions) {
                const std::filesystem::path path = folder / (c.name + extension);
                std::filesystem::create_directories(path.parent_path());
                for (const auto& file : write(c.v, path, c.options))
                    files[extension == "/{z}.png" ? ".slices" : extension].push_back(
                        file.lexically_relative(folder).string());
            }
            if (c.density != 0 && c.extensions.front() == ".npy") {
                const sparse_volume bricks = make_sparse(c.v, 1);
                for (const std::string extension : {".npz", ".npy"})
                    for (const auto& path : write_sparse(bricks, folder / (c.name + "_sparse" + extension), c.options))
                        files[".sparse_" + extension.substr(1)].push_back(path.filename().string());
            }
            if (!manifest.empty()) manifest += ",\n";
            manifest += describe(c, files);
        }
        std::ofstream out(folder / "manifest.json");
        out << "[\n" << manifest << "\n]\n";
        write_table(folder / "blocks.json", default_blocks());
        write_table(folder / "listed.json", *many_blocks());
        return out ? 0 : 1;
    } catch (const std::exception& e) {
        std::cerr << "write_samples: " << e.what() << "\n";
        return 1;
    }
}
