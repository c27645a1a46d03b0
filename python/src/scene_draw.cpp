// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include "grid_state.hpp"
#include "sparse.hpp"

#include "draw/sparse/sparse_parts.hpp"
#include "model/placement.hpp"

#include <nanobind/stl/optional.h>

#include <bit>
#include <limits>
#include <optional>

namespace voxelpipe::python {
namespace {

// ---- a scene as one mesh -------------------------------------------------------------------------------------------

// Calls visit(instance, its primitive) in the order in which they are drawn.
template <class Visit>
void for_each_instance(const voxelize::scene& s, const Visit& visit) {
    for (const voxelize::instance& shown : s.instances) visit(shown, s.primitives[shown.primitive]);
}

void check_count(std::uint64_t n, const char* what) {
    if (n > UINT32_MAX)
        throw nb::value_error(("the model has " + std::to_string(n) + ' ' + what + ", the most is 2^32 - 1").c_str());
}

// Positions of all instances in the world, in double: (v, 3).
nb::object vertices_of(const model_scene& m) {
    std::vector<double> result;
    result.reserve(3 * m.scene.vertex_count());
    for_each_instance(m.scene, [&](const voxelize::instance& shown, const voxelize::primitive& part) {
        for (const glm::vec3& p : part.positions) {
            const glm::dvec3 world = shown.to_world(glm::dvec3(p));
            result.insert(result.end(), {world.x, world.y, world.z});
        }
    });
    const std::size_t n = result.size() / 3;
    return to_numpy(std::move(result), {n, 3});
}

// Positions as the tool draws them in a grid, the grid relative to the same point, and that point.
nb::tuple positions_in(const model_scene& m, const grid& g) {
    const glm::dvec3 reference = voxelize::reference_point(g);
    std::vector<float> result;
    result.reserve(3 * m.scene.vertex_count());
    for_each_instance(m.scene, [&](const voxelize::instance& shown, const voxelize::primitive& part) {
        const voxelize::placed_vertex_shader place(shown.to_world, reference);
        for (const glm::vec3& p : part.positions) {
            const glm::vec3 placed = place(p);
            result.insert(result.end(), {placed.x, placed.y, placed.z});
        }
    });
    grid relative = g;
    relative.origin -= reference;
    const std::size_t n = result.size() / 3;
    return nb::make_tuple(to_numpy(std::move(result), {n, 3}), relative,
                          nb::make_tuple(reference.x, reference.y, reference.z));
}

// Indices of triangles, as the tool winds them, or of lines, into vertices_of().
template <class Element>
nb::object elements_of(const model_scene& m, std::vector<Element> voxelize::primitive::*elements) {
    constexpr std::size_t corners = sizeof(Element) / sizeof(std::uint32_t);
    check_count(m.scene.vertex_count(), "vertices");
    std::vector<std::uint32_t> result;
    std::uint32_t first = 0;
    for_each_instance(m.scene, [&](const voxelize::instance& shown, const voxelize::primitive& part) {
        const bool turns = corners == 3 && shown.to_world.mirrors();
        for (const Element& e : part.*elements)
            for (std::size_t k = 0; k < corners; ++k)
                result.push_back(first + e[static_cast<glm::length_t>(turns && k != 0 ? corners - k : k)]);
        first += static_cast<std::uint32_t>(part.positions.size());
    });
    const std::size_t n = result.size() / corners;
    return to_numpy(std::move(result), {n, corners});
}

// A value of each vertex; `missing` where a part has none, None where no part has.
template <class Value>
nb::object values_of_vertices(const model_scene& m, std::vector<Value> voxelize::primitive::*values, float missing) {
    constexpr std::size_t components = sizeof(Value) / sizeof(float);
    bool has_any = false;
    std::vector<float> result;
    for_each_instance(m.scene, [&](const voxelize::instance&, const voxelize::primitive& part) {
        const std::vector<Value>& own = part.*values;
        has_any = has_any || !own.empty();
        const std::size_t at = result.size();
        result.resize(at + components * part.positions.size(), missing);
        if (!own.empty()) std::memcpy(result.data() + at, own.data(), own.size() * sizeof(Value));
    });
    const std::size_t n = result.size() / components;
    return has_any ? to_numpy(std::move(result), {n, components}) : nb::none();
}

// Name, material, first vertex, first triangle, number of triangles of each instance.
nb::list parts_of(const model_scene& m) {
    nb::list all;
    std::uint64_t vertex = 0, triangle = 0;
    for_each_instance(m.scene, [&](const voxelize::instance&, const voxelize::primitive& part) {
        all.append(nb::make_tuple(part.name, part.material, vertex, triangle, part.triangles.size()));
        vertex += part.positions.size();
        triangle += part.triangles.size();
    });
    return all;
}

// Whether more decides what is covered than triangles: lines, points, or a material that cuts off.
bool is_more_than_triangles(const model_scene& m) {
    bool more = m.scene.line_count() != 0;
    for_each_instance(m.scene, [&](const voxelize::instance&, const voxelize::primitive& part) {
        more = more || m.scene.materials[part.material].alpha == voxelize::alpha_mode::mask;
    });
    return more;
}

// The grid that the tool makes for one of the three.
grid fit_scene(const model_scene& m, std::optional<int> resolution, const std::optional<triple_of_int>& shape,
               const std::optional<triple_of_double>& voxel_size, int padding) {
    voxelize::grid_request wanted;
    wanted.resolution = resolution;
    if (shape) wanted.box = extent_of(*shape);
    if (voxel_size) wanted.voxel_size = to_vector(*voxel_size);
    wanted.padding = padding;
    const voxelize::bounding_box bounds = voxelize::bounds_of(m.scene);
    if (bounds.empty) throw nb::value_error("the model has no corner at a finite position");
    try {
        return checked(voxelize::place_grid(wanted, bounds));
    } catch (const voxelize::grid_error& error) {
        throw nb::value_error(error.what());
    }
}

// ---- its surface ---------------------------------------------------------------------------------------------------

nb::dlpack::dtype type_of(voxelize::scalar type) {
    switch (type) {
    case voxelize::scalar::u8:
        return nb::dtype<std::uint8_t>();
    case voxelize::scalar::u32:
        return nb::dtype<std::uint32_t>();
    case voxelize::scalar::i32:
        return nb::dtype<std::int32_t>();
    default:
        return nb::dtype<float>();
    }
}

// (n,) or (n, components).
nb::object array_of(voxelize::channel&& c, std::size_t n) {
    auto* const kept = new voxelize::channel_bytes(std::move(c.data));
    nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<voxelize::channel_bytes*>(p); });
    const std::size_t shape[2] = {n, static_cast<std::size_t>(c.components)};
    return nb::cast(
        nb::ndarray<nb::numpy>(kept->data(), c.components == 1 ? 1 : 2, shape, owner, nullptr, type_of(c.type)));
}

// What a voxel holds where nothing is.
nb::object empty_value(voxelize::target id) {
    const voxelize::target_info& info = voxelize::info_of(id);
    if (info.type == voxelize::scalar::f32) return nb::cast(std::bit_cast<float>(info.empty));
    return nb::cast(static_cast<std::int32_t>(info.empty));
}

nb::dict counts_of(const voxelize::voxelize_stats& stats, std::uint64_t voxels) {
    nb::dict d;
    d["triangles"] = stats.triangles;
    d["triangles_dropped"] = stats.triangles_dropped;
    d["triangles_zero_area"] = stats.triangles_flat;
    d["triangles_drawn"] = stats.triangles_drawn;
    d["lines"] = stats.lines;
    d["fragments"] = stats.fragments;
    d["fragments_discarded"] = stats.fragments_discarded;
    d["voxels"] = voxels;
    return d;
}

// The voxels that the surface covers, in Morton order; for each target (values, value of an empty voxel); the counters;
// the warnings. Colours, materials and alpha are the tool's.
nb::tuple draw_scene(const model_scene& m, const grid& g, const std::string& rule,
                     const std::vector<std::string>& targets, unsigned threads) {
    voxelize::voxelize_request request;
    request.grid = g;
    request.coverage = coverage_named(rule);
    request.backend = voxelize::backend_choice::cpu;
    request.threads = static_cast<int>(threads);
    request.targets.clear();
    for (const std::string& name : targets) {
        const std::optional<voxelize::target> id = voxelize::target_named(name);
        if (!id || *id == voxelize::target::distance || *id == voxelize::target::nearest || voxelize::is_of_cells(*id))
            throw nb::value_error(("no value of a model's surface is called '" + name + "'").c_str());
        request.targets.push_back(*id);
    }
    if (request.targets.empty()) request.targets.push_back(voxelize::target::occupancy);
    voxelize::voxelize_stats stats;
    voxelize::sparse_volume drawn;
    std::vector<std::int32_t> coordinates;
    std::string shortage;
    {
        const nb::gil_scoped_release released;
        try {
            voxelize::scene model = m.scene; // the pipeline takes its arrays
            cpu_backend backend{static_cast<unsigned>(voxelize::thread_count(request.threads))};
            voxelize::sparse_pipeline<cpu_backend> pipeline{backend, model, request, stats};
            drawn = pipeline.surface(g.uncropped());
            coordinates = coordinates_of(drawn.table());
            for (std::size_t i = 0; i < coordinates.size(); ++i)
                coordinates[i] -= g.offset[static_cast<glm::length_t>(i % 3)];
        } catch (const voxelize::memory_error& error) {
            shortage = error.what();
        }
    }
    if (!shortage.empty()) {
        PyErr_SetString(PyExc_MemoryError, shortage.c_str());
        throw nb::python_error();
    }
    const std::size_t n = coordinates.size() / 3;
    nb::list values;
    for (std::size_t i = 0; i < targets.size(); ++i) {
        if (request.targets[i] == voxelize::target::occupancy)
            values.append(nb::make_tuple(nb::none(), false));
        else
            values.append(nb::make_tuple(array_of(std::move(drawn.channels[i]), n), empty_value(request.targets[i])));
    }
    return nb::make_tuple(to_numpy(std::move(coordinates), {n, 3}), values, counts_of(stats, n), stats.warnings);
}

nb::list target_names() {
    nb::list all;
    for (const voxelize::target_info& t : voxelize::target_table) all.append(nb::str(t.name.data(), t.name.size()));
    return all;
}

} // namespace

void bind_scene_draw(nb::class_<model_scene>& c) {
    c.def_prop_ro("vertices", &vertices_of)
        .def("positions", &positions_in, nb::arg("grid"))
        .def_prop_ro("triangles", [](const model_scene& m) { return elements_of(m, &voxelize::primitive::triangles); })
        .def_prop_ro("lines", [](const model_scene& m) { return elements_of(m, &voxelize::primitive::lines); })
        .def_prop_ro("colors",
                     [](const model_scene& m) { return values_of_vertices(m, &voxelize::primitive::colors, 1.0F); })
        .def_prop_ro("texcoords",
                     [](const model_scene& m) { return values_of_vertices(m, &voxelize::primitive::texcoords, 0.0F); })
        .def_prop_ro("parts", &parts_of)
        .def_prop_ro("is_more_than_triangles", &is_more_than_triangles)
        .def("fit", &fit_scene, nb::arg("resolution").none(), nb::arg("shape").none(), nb::arg("voxel_size").none(),
             nb::arg("padding"))
        .def("draw", &draw_scene, nb::arg("grid"), nb::arg("coverage"), nb::arg("targets"), nb::arg("threads"))
        .def_static("target_names", &target_names);
}

} // namespace voxelpipe::python
