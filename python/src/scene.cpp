// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include "read/assimp/linear_color.hpp"
#include "read/assimp_scene.hpp"
#include "read/mesh/mesh_formats.hpp"
#include "read/model_file.hpp"
#include "read/named_files.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <tuple>

namespace voxelpipe::python {
namespace {

namespace fs = std::filesystem;

model_scene load(const std::string& path, bool lenient) {
    voxelize::load_options options;
    options.gltf.lenient = lenient;
    const nb::gil_scoped_release released;
    try {
        return {voxelize::load_model(path, options)};
    } catch (const voxelize::model_error& error) {
        throw std::invalid_argument(path + ": " + error.what() +
                                    (error.lenient_helps ? " (lenient=True goes on all the same)" : ""));
    }
}

// Whether the readers know files of this extension (".ply", lower case).
bool is_read(const std::string& extension) {
    return extension == ".gltf" || extension == ".glb" || voxelize::is_mesh_format(extension) ||
           voxelize::is_for_assimp(extension);
}

std::vector<std::string> files_of(const std::string& path) {
    std::vector<std::string> names;
    for (const fs::path& file : voxelize::named_files(path)) names.push_back(file.string());
    return names;
}

// ---- scenes of arrays ----------------------------------------------------------------------------------------------

using texcoord_array = nb::ndarray<const float, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using line_array = nb::ndarray<const std::uint32_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using linear_array = nb::ndarray<const float, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using picture_array = nb::ndarray<const std::uint8_t, nb::shape<-1, -1, 4>, nb::c_contig, nb::device::cpu>;

// Name, positions, their origin, triangles, texture coordinates from the picture's top left corner, linear colours of
// vertices, number of the material; (l, 2) vertices of lines.
using part_tuple =
    std::tuple<std::string, position_array, std::array<double, 3>, triangle_array, std::optional<texcoord_array>,
               std::optional<linear_array>, std::uint32_t, std::optional<line_array>>;
// Name, linear colour, number of the texture or -1, "opaque", "mask" or "blend", the mask's limit, double-sided.
using material_tuple = std::tuple<std::string, std::array<float, 4>, std::int32_t, std::string, float, bool>;
// Number of the picture, "repeat", "clamp" or "mirror" along u and v, "linear" or "nearest".
using texture_tuple = std::tuple<std::uint32_t, std::string, std::string, std::string>;

template <class T, class Array>
std::vector<T> list_of(const Array& a) {
    const auto* const first = reinterpret_cast<const T*>(a.data());
    return std::vector<T>(first, first + a.shape(0));
}

voxelize::primitive primitive_of(const part_tuple& part, std::size_t num_materials) {
    const auto& [name, positions, origin, triangles, texcoords, colors, material, lines] = part;
    voxelize::primitive made;
    made.name = name;
    made.positions = list_of<glm::vec3>(positions);
    made.triangles = list_of<glm::uvec3>(triangles);
    for (std::size_t i = 0; i < made.triangles.size(); ++i) {
        const glm::uvec3& t = made.triangles[i];
        if (std::max({t.x, t.y, t.z}) >= made.positions.size())
            throw std::out_of_range("triangle " + std::to_string(i) + " is (" + std::to_string(t.x) + ", " +
                                    std::to_string(t.y) + ", " + std::to_string(t.z) + "), the mesh has " +
                                    std::to_string(made.positions.size()) + " vertices");
    }
    if (lines) made.lines = list_of<glm::uvec2>(*lines);
    for (std::size_t i = 0; i < made.lines.size(); ++i) {
        const glm::uvec2& l = made.lines[i];
        if (std::max(l.x, l.y) >= made.positions.size())
            throw std::out_of_range("line " + std::to_string(i) + " is (" + std::to_string(l.x) + ", " +
                                    std::to_string(l.y) + "), there are " + std::to_string(made.positions.size()) +
                                    " vertices");
    }
    if (texcoords) made.texcoords = list_of<glm::vec2>(*texcoords);
    if (colors) made.colors = list_of<glm::vec4>(*colors);
    if ((texcoords && made.texcoords.size() != made.positions.size()) ||
        (colors && made.colors.size() != made.positions.size()))
        throw nb::value_error("colours and texture coordinates need one row for each vertex");
    if (material >= num_materials) throw nb::value_error("a part names a material that does not exist");
    made.material = material;
    return made;
}

model_scene scene_of(const std::vector<part_tuple>& parts, const std::vector<material_tuple>& materials,
                     const std::vector<texture_tuple>& textures, const std::vector<picture_array>& pictures) {
    model_scene made;
    for (const auto& [name, color, texture, alpha, cutoff, double_sided] : materials) {
        if (texture < -1 || texture >= static_cast<std::int32_t>(textures.size()))
            throw nb::value_error("a material names a texture that does not exist");
        voxelize::material& m = made.scene.materials.emplace_back();
        m.name = name;
        m.base_color = {color[0], color[1], color[2], color[3]};
        m.texture = texture;
        m.alpha = named<voxelize::alpha_mode>("the alpha of a material", alpha,
                                              {{"opaque", voxelize::alpha_mode::opaque},
                                               {"mask", voxelize::alpha_mode::mask},
                                               {"blend", voxelize::alpha_mode::blend}});
        m.alpha_cutoff = cutoff;
        m.double_sided = double_sided;
    }
    const auto wrap_of = [](const std::string& name) {
        return named<voxelize::wrap_mode>("the wrapping of a texture", name,
                                          {{"repeat", voxelize::wrap_mode::repeat},
                                           {"clamp", voxelize::wrap_mode::clamp_to_edge},
                                           {"mirror", voxelize::wrap_mode::mirrored_repeat}});
    };
    for (const auto& [picture, wrap_u, wrap_v, filter] : textures) {
        if (picture >= pictures.size()) throw nb::value_error("a texture names a picture that does not exist");
        const auto filter_mode = named<voxelize::filter_mode>(
            "the filter of a texture", filter,
            {{"linear", voxelize::filter_mode::linear}, {"nearest", voxelize::filter_mode::nearest}});
        made.scene.textures.push_back({picture, wrap_of(wrap_u), wrap_of(wrap_v), filter_mode});
    }
    for (const picture_array& texels : pictures) {
        const std::size_t width = texels.shape(1), height = texels.shape(0);
        constexpr std::size_t most = 16384;
        if (width == 0 || height == 0 || width > most || height > most)
            throw nb::value_error("a picture has 1 to 16384 texels a side");
        voxelize::picture& p = made.scene.images.emplace_back();
        p.width = static_cast<std::uint32_t>(width);
        p.height = static_cast<std::uint32_t>(height);
        p.rgba.assign(texels.data(), texels.data() + texels.size());
    }
    for (const part_tuple& part : parts) {
        const std::array<double, 3>& origin = std::get<2>(part);
        voxelize::affine to_world;
        for (std::size_t r = 0; r < 3; ++r) to_world.m[r][3] = origin[r];
        made.scene.instances.push_back({static_cast<std::uint32_t>(made.scene.primitives.size()), to_world});
        made.scene.primitives.push_back(primitive_of(part, materials.size()));
    }
    return made;
}

using transform_array = nb::ndarray<const double, nb::shape<-1, 3, 4>, nb::c_contig, nb::device::cpu>;

// The scene once for each transform, rows of a matrix to be multiplied by (x, y, z, 1). Meshes are kept once.
model_scene instances_of(const model_scene& s, const transform_array& transforms) {
    model_scene made{s.scene};
    made.scene.instances.clear();
    for (std::size_t n = 0; n < transforms.shape(0); ++n) {
        voxelize::affine placed;
        const double* const row = transforms.data() + 12 * n;
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 4; ++c) placed.m[r][c] = row[4 * r + c];
        if (!placed.is_finite()) throw nb::value_error(("transform " + std::to_string(n) + " is not finite").c_str());
        for (const voxelize::instance& shown : s.scene.instances)
            made.scene.instances.push_back({shown.primitive, placed.after(shown.to_world)});
    }
    return made;
}

// sRGB and alpha, 0 to 1, as the readers of formats with such colours take them.
nb::object linear_colors(const linear_array& encoded) {
    std::vector<glm::vec4> colors = list_of<glm::vec4>(encoded);
    for (glm::vec4& c : colors) {
        for (int a = 0; a < 3; ++a) c[a] = voxelize::assimp::linear_of(c[a]);
        c.a = c.a > 0.0F ? std::min(c.a, 1.0F) : 0.0F;
    }
    const std::size_t n = colors.size();
    std::vector<float> values(4 * n);
    if (n != 0) std::memcpy(values.data(), colors.data(), n * sizeof(glm::vec4));
    return to_numpy(std::move(values), {n, 4});
}

// ---- what a scene holds --------------------------------------------------------------------------------------------

const char* name_of(voxelize::alpha_mode mode) {
    return mode == voxelize::alpha_mode::opaque ? "opaque" : mode == voxelize::alpha_mode::mask ? "mask" : "blend";
}
const char* name_of(voxelize::wrap_mode mode) {
    return mode == voxelize::wrap_mode::repeat          ? "repeat"
           : mode == voxelize::wrap_mode::clamp_to_edge ? "clamp"
                                                        : "mirror";
}

nb::list materials_of(const model_scene& s) {
    nb::list all;
    for (const voxelize::material& m : s.scene.materials)
        all.append(nb::make_tuple(m.name,
                                  nb::make_tuple(m.base_color.r, m.base_color.g, m.base_color.b, m.base_color.a),
                                  m.texture, name_of(m.alpha), m.alpha_cutoff, m.double_sided));
    return all;
}

nb::list textures_of(const model_scene& s) {
    nb::list all;
    for (const voxelize::texture& t : s.scene.textures)
        all.append(nb::make_tuple(t.image, name_of(t.wrap_s), name_of(t.wrap_t),
                                  t.filter == voxelize::filter_mode::linear ? "linear" : "nearest"));
    return all;
}

nb::list pictures_of(const model_scene& s) {
    nb::list all;
    for (const voxelize::picture& p : s.scene.images)
        all.append(to_numpy(std::vector<std::uint8_t>(p.rgba), {p.height, p.width, 4}));
    return all;
}

} // namespace

void bind_scene(nb::module_& m) {
    nb::class_<model_scene> c(m, "Scene", "A model with materials, as the readers give it; see voxelpipe/_model.py.");
    c.def_static("load", &load, nb::arg("path"), nb::arg("lenient"))
        .def_static("is_read", &is_read, nb::arg("extension"))
        .def_static("files_of", &files_of, nb::arg("path"))
        .def_static("of", &scene_of, nb::arg("parts"), nb::arg("materials"), nb::arg("textures"), nb::arg("pictures"))
        .def("instances", &instances_of, nb::arg("transforms"))
        .def_static("linear_colors", &linear_colors, nb::arg("encoded"))
        .def_prop_ro("materials", &materials_of)
        .def_prop_ro("textures", &textures_of)
        .def_prop_ro("pictures", &pictures_of)
        .def_prop_ro("warnings", [](const model_scene& s) { return s.scene.warnings; });
    bind_scene_draw(c);
}

} // namespace voxelpipe::python
