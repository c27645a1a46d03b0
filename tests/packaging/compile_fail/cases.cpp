// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Programs that must not compile, and the message that the compiler must print for each: a regular expression behind
// the case's #if, which must match the first line with `error:`. WRONG(...) is the mistake and RIGHT(...) its
// correction. With CASE_name a case is compiled alone with its mistake; with ALL every case is compiled corrected,
// which must work, so that only the mistake makes each fail. Comments below the #if:
//   max-errors: N            the largest number of such lines (default 1): one mistake, one readable message
//   flags: FLAG...           compiler flags that are the mistake; with ALL the case is compiled without them

#include <voxelpipe/voxelpipe.hpp>

#include <cpu_ref/backend.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#if defined(ALL)
#define WRONG(...)
#define RIGHT(...) __VA_ARGS__
#else
#define ALL 0
#define WRONG(...) __VA_ARGS__
#define RIGHT(...)
#endif

namespace vp = voxelpipe;

inline constexpr std::array<glm::vec3, 3> positions{{{0.0f, 0.0f, 0.0f}, {4.0f, 0.0f, 1.0f}, {0.0f, 4.0f, 2.0f}}};
inline constexpr std::array<glm::uvec3, 1> triangles{{{0u, 1u, 2u}}};
inline constexpr std::array<float, 3> heat{1.0f, 2.0f, 3.0f};
inline const vp::mesh_view<> one_triangle{positions, triangles};
constexpr vp::passthrough pass{};
constexpr auto ones = [](const vp::fragment<>&) { return vp::outputs(1u); }; // a fragment shader for one counter
using counter = vp::target<std::uint32_t, vp::blend::add>;
using fragment = vp::fragment<>;
using vertex = vp::vertex<>;

inline vp::grid small_grid() {
    vp::grid g;
    g.extent = {8, 8, 8};
    return g;
}

// The correct part of the cases: one triangle, drawn by the given shaders into the given targets.
template <class... Targets, class VertexShader, class FragmentShader>
bool draw_into(const VertexShader& vertex_shader, const FragmentShader& fragment_shader) {
    vp::cpu_backend backend;
    vp::framebuffer<vp::cpu_backend, Targets...> framebuffer{backend, {8, 8, 8}};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize(backend, mesh, small_grid(), vertex_shader, fragment_shader, framebuffer).ok();
}
template <class Payload, class FragmentShader>
bool collect(const FragmentShader& fragment_shader) {
    vp::cpu_backend backend;
    vp::abuffer<vp::cpu_backend, Payload> lists{backend};
    const vp::mesh_view<> mesh{positions, triangles};
    return vp::voxelize(backend, mesh, small_grid(), pass, fragment_shader, lists).ok();
}

// Not templates: programs as a user writes them.
#define DRAW(OUTPUT, MESH, CALL, ...)                                                                                  \
    inline bool run() {                                                                                                \
        vp::cpu_backend backend;                                                                                       \
        OUTPUT out{backend __VA_OPT__(, ) __VA_ARGS__};                                                                \
        const MESH;                                                                                                    \
        return CALL.ok();                                                                                              \
    }
#define PROGRAM(PROGRAM_, SHADER)                                                                                      \
    DRAW(framebuffer_of<counter>, vp::mesh_view<> mesh = one_triangle,                                                 \
         vp::voxelize(backend, mesh, small_grid(), pass, PROGRAM_, SHADER, out), glm::ivec3(8))
#define SOLID(OUTPUT, SHADER, ...)                                                                                     \
    DRAW(OUTPUT, vp::mesh_view<> mesh = one_triangle,                                                                  \
         vp::voxelize_solid(backend, mesh, small_grid(), pass, SHADER, out), __VA_ARGS__)
#define OWN_BLEND                                                                                                      \
    using own = vp::target<surface, nearest>;                                                                          \
    DRAW(framebuffer_of<own>, vp::mesh mesh(backend, positions, triangles),                                            \
         vp::voxelize(backend, mesh, small_grid(), pass, vp::constant(surface{1.0f}), out), glm::ivec3(8))
#define ORDER static constexpr bool order_free = true;
#define IDENTITY                                                                                                       \
    surface identity() const { return {9}; }
#define COMBINE                                                                                                        \
    surface combine(surface a, surface b) const { return a.distance < b.distance ? a : b; }
template <class... Targets>
using framebuffer_of = vp::framebuffer<vp::cpu_backend, Targets...>;
struct surface {
    float distance;
};

// clang-format off

// ---- vertex and fragment shaders ------------------------------------------------------------------------------------

#if CASE_attribute_index || ALL // index past the end
namespace attribute_index {
struct shader {
    glm::vec3 operator()(const vp::vertex<float>& v) const {
        static_cast<void>(vp::get<WRONG(1) RIGHT(0)>(v));
        return v.position;
    }
};
DRAW(framebuffer_of<counter>, vp::mesh mesh(backend, positions, triangles, heat),
     vp::voxelize(backend, mesh, small_grid(), shader{}, ones, out), glm::ivec3(8))
}
#endif
#if CASE_attribute_owns_memory || ALL // must be trivially copyable
// max-errors: 2 (the backend that would store them says the same)
namespace attribute_owns_memory {
const std::vector<WRONG(std::string) RIGHT(float)> labels(3);
DRAW(vp::abuffer<vp::cpu_backend>, vp::mesh mesh(backend, positions, triangles, labels),
     vp::voxelize(backend, mesh, small_grid(), pass, ones, out))
}
#endif
#if CASE_vertex_missing_attribute || ALL // vertex shader cannot be called with
bool vertex_missing_attribute() {
    return draw_into<counter>([](const vp::vertex<WRONG(float)>& v) { return v.position WRONG(* vp::get<0>(v)); }, ones);
}
#endif
#if CASE_vertex_not_const || ALL // vertex shader cannot be called with
bool vertex_not_const() {
    return draw_into<counter>([by = 1.0f](const vertex& v) WRONG(mutable) { return by * v.position; }, ones);
}
#endif
#if CASE_vertex_owns_memory || ALL // vertex shader must be trivially copyable
bool vertex_owns_memory() {
    return draw_into<counter>([name = WRONG(std::string()) RIGHT("")](const vertex& v) { return (void)name, v.position; }, ones);
}
#endif
#if CASE_vertex_result || ALL // vertex shader must return glm::vec3 or vertex_output
bool vertex_result() {
    return draw_into<counter>([](const vertex& v) { return WRONG(glm::vec4(v.position, 1.0f)) RIGHT(v.position); }, ones);
}
#endif
#if CASE_fragment_arity || ALL // must return one value per render target
bool fragment_arity() {
    return draw_into<vp::target<float, vp::blend::max>, counter>(
        pass, [](const fragment& f) { return vp::outputs(f.normal.z RIGHT(, 1u)); });
}
#endif
#if CASE_fragment_bare_value || ALL // fragment shader must return vp::outputs
bool fragment_bare_value() {
    return draw_into<counter>(pass, [](const fragment&) { return WRONG(1u) RIGHT(vp::outputs(1u)); });
}
#endif
#if CASE_fragment_not_const || ALL // fragment shader cannot be called with
bool fragment_not_const() {
    return draw_into<counter>(pass, [by = 1u](const fragment&) WRONG(mutable) { return vp::outputs(by); });
}
#endif
#if CASE_fragment_other_varyings || ALL // fragment shader cannot be called with
bool fragment_other_varyings() {
    return draw_into<counter>(pass, [](const vp::fragment<WRONG(surface)>&) { return vp::outputs(1u); });
}
#endif
#if CASE_fragment_owns_memory || ALL // fragment shader must be trivially copyable
bool fragment_owns_memory() {
    const WRONG(std::vector<unsigned>) RIGHT(vp::array_view<const unsigned>) table{};
    return draw_into<counter>(pass, [table](const fragment& f) { return vp::outputs(table.size() > f.triangle ? 2u : 1u); });
}
#endif
#if CASE_fragment_type || ALL // output has another type than its render target
bool fragment_type() {
    return draw_into<counter>(pass, [](const fragment&) { return vp::outputs(WRONG(1) RIGHT(1u)); });
}
#endif
#if CASE_fragment_void || ALL // write vp::output<T...> instead of auto
// A shader for the device only, as a host compiler sees it: nvcc leaves out the body.
bool fragment_void() {
    return draw_into<counter>(pass, [](const fragment&) WRONG({}) RIGHT({ return vp::output<unsigned>{}; }));
}
#endif

// ---- varyings -------------------------------------------------------------------------------------------------------

#if CASE_varyings_class || ALL // varyings must be an aggregate of
namespace varyings_class {
struct varying { WRONG(varying() {}) float u; }; // a constructor makes it no aggregate
bool run() {
    return draw_into<counter>([](const vertex& v) { return vp::vertex_output{v.position, varying{}}; },
                              [](const vp::fragment<varying>&) { return vp::outputs(1u); });
}
}
#endif
#if CASE_varyings_count || ALL // varyings may have at most 12 members
namespace varyings_count {
struct many { float a, b, c, d, e, f, g, h, i, j, k, l WRONG(, m); };
bool run() {
    return draw_into<counter>([](const vertex& v) { return vp::vertex_output<many>{v.position, {}}; },
                              [](const vp::fragment<many>&) { return vp::outputs(1u); });
}
}
#endif
#if CASE_varyings_member || ALL // varyings must be an aggregate of
namespace varyings_member {
struct varying { glm::vec2 uv; WRONG(const char*) RIGHT(float) material; }; // there is no value between two pointers
bool run() {
    return draw_into<counter>([](const vertex& v) { return vp::vertex_output{v.position, varying{}}; },
                              [](const vp::fragment<varying>&) { return vp::outputs(1u); });
}
}
#endif

// ---- targets and blends ---------------------------------------------------------------------------------------------

#if CASE_no_target || ALL // needs at least one render target
bool no_target() { return draw_into<RIGHT(counter)>(pass, vp::constant(RIGHT(1u))); }
#endif
#if CASE_nine_targets || ALL // at most 8 render targets
bool nine_targets() {
    return draw_into<WRONG(counter,) counter, counter, counter, counter, counter, counter, counter, counter>(
        pass, [](const fragment&) { return vp::outputs(WRONG(1u,) 1u, 1u, 1u, 1u, 1u, 1u, 1u, 1u); });
}
#endif
#if CASE_target_bool || ALL // a target of bits is written target<voxelpipe::bit
bool target_bool() { return draw_into<vp::target<WRONG(bool) RIGHT(vp::bit), vp::blend::bit_or>>(pass, vp::constant(true)); }
#endif
#if CASE_target_struct_owns_memory || ALL // value type must be trivially copyable
namespace target_struct_owns_memory {
struct sample { WRONG(std::shared_ptr<int>) RIGHT(const int*) owner; };
bool run() {
    return draw_into<vp::target<sample, vp::blend::replace>>(pass, [](const fragment&) { return vp::outputs(sample{}); });
}
}
#endif
#if CASE_blend_bit_or_float || ALL // blend mode is not defined for this value type
using of_bit_or = WRONG(float) RIGHT(std::uint32_t);
bool blend_bit_or_float() { return draw_into<vp::target<of_bit_or, vp::blend::bit_or>>(pass, vp::constant(of_bit_or(1))); }
#endif
#if CASE_blend_count_float || ALL // blend mode is not defined for this value type
using of_count = WRONG(float) RIGHT(std::uint16_t);
bool blend_count_float() { return draw_into<vp::target<of_count, vp::blend::count>>(pass, vp::constant(of_count(1))); }
#endif
#if CASE_blend_saturate_float || ALL // blend mode is not defined for this value type
using of_saturate = WRONG(float) RIGHT(std::uint8_t);
bool blend_saturate_float() {
    return draw_into<vp::target<of_saturate, vp::blend::add_saturate>>(pass, vp::constant(of_saturate(1)));
}
#endif
#if CASE_blend_unordered_integer || ALL // blend mode is not defined for this value type
using of_unordered = WRONG(int) RIGHT(float);
bool blend_unordered_integer() {
    return draw_into<vp::target<of_unordered, vp::blend::add_unordered>>(pass, vp::constant(of_unordered(1)));
}
#endif
#if CASE_blend_struct_without_blend || ALL // blend mode is not defined for this value type
namespace blend_struct_without_blend {
struct nearest { ORDER IDENTITY COMBINE };
bool run() { return draw_into<vp::target<surface, WRONG(vp::blend::max) RIGHT(nearest)>>(pass, vp::constant(surface{1.0f})); }
}
#endif
#if CASE_own_blend_combine_not_const || ALL // needs .T combine.T, T. const
namespace own_blend_combine_not_const {
struct nearest { ORDER IDENTITY WRONG(surface combine(surface a, surface) { return a; }) RIGHT(COMBINE) };
OWN_BLEND
}
#endif
#if CASE_own_blend_combine_result || ALL // combine.. of a blend of your own must return
namespace own_blend_combine_result {
struct nearest { ORDER IDENTITY WRONG(bool combine(surface, surface) const { return true; }) RIGHT(COMBINE) };
OWN_BLEND
}
#endif
#if CASE_own_blend_identity_result || ALL // identity.. of a blend of your own must return
namespace own_blend_identity_result {
struct nearest { ORDER WRONG(float identity() const { return 9; }) RIGHT(IDENTITY) COMBINE };
OWN_BLEND
}
#endif
#if CASE_own_blend_with_state || ALL // must not have data members
namespace own_blend_with_state {
struct nearest { ORDER IDENTITY COMBINE WRONG(float scale = 2;) };
OWN_BLEND
}
#endif
#if CASE_own_blend_without_identity || ALL // needs .T identity.. const
namespace own_blend_without_identity {
struct nearest { ORDER RIGHT(IDENTITY) COMBINE };
OWN_BLEND
}
#endif
#if CASE_own_blend_without_order || ALL // needs .static constexpr bool order_free
namespace own_blend_without_order {
struct nearest { RIGHT(ORDER) IDENTITY COMBINE };
OWN_BLEND
}
#endif

// ---- A-buffers and solids -------------------------------------------------------------------------------------------

#if CASE_payload_arity || ALL // for an A-buffer must return one value
bool payload_arity() {
    return collect<float>([](const fragment& f) { return vp::outputs(f.barycentric.x WRONG(, f.barycentric.y)); });
}
#endif
#if CASE_payload_bool || ALL // an A-buffer's payload cannot be bool
bool payload_bool() {
    vp::cpu_backend backend;
    const vp::abuffer<vp::cpu_backend, WRONG(bool) RIGHT(std::uint8_t)> lists{backend};
    return lists.num_voxels() == 0;
}
#endif
#if CASE_payload_owns_memory || ALL // payload must be trivially copyable
using payload = WRONG(std::string) RIGHT(float);
bool payload_owns_memory() { return collect<payload>([](const fragment&) { return vp::outputs(payload{}); }); }
#endif
#if CASE_payload_type || ALL // output has another type than the A-buffer's payload
bool payload_type() {
    return collect<float>([](const fragment& f) { return vp::outputs(WRONG(double{f.normal.x}) RIGHT(f.normal.x)); });
}
#endif
#if CASE_solid_payload_type || ALL // another type than the A-buffer's payload
namespace solid_payload_type {
constexpr auto shader = [](const vp::solid_fragment& f) { return vp::outputs(f.WRONG(winding) RIGHT(draw)); };
using lists = vp::abuffer<vp::cpu_backend, std::uint32_t>;
SOLID(lists, shader)
}
#endif
#if CASE_solid_shader_fragment || ALL // the solid's shader cannot be called with const solid_fragment&
namespace solid_shader_fragment {
constexpr auto shader = [](const WRONG(fragment) RIGHT(vp::solid_fragment)& f) { return vp::outputs(f.draw); };
SOLID(framebuffer_of<counter>, shader, glm::ivec3(8))
}
#endif

// ---- programs -------------------------------------------------------------------------------------------------------

#if CASE_geometry_result || ALL // a geometry program must return vp::triangles<N, Varyings>, N at most 256
namespace geometry_result {
struct program { vp::triangles<WRONG(257) RIGHT(256)> operator()(const vp::triangle<>&) const { return {}; } };
PROGRAM(vp::geometry{program{}}, ones)
}
#endif
#if CASE_program_other_varyings || ALL // does it take the varyings that the program makes
namespace program_other_varyings {
struct program { vp::triangles<1, surface> operator()(const vp::triangle<>&) const { return {}; } };
constexpr auto shader = [](const vp::fragment<WRONG(vp::no_varyings) RIGHT(surface)>&) { return vp::outputs(1u); };
PROGRAM(vp::geometry{program{}}, shader)
}
#endif
#if CASE_tessellation_edge_level || ALL // a tessellation program must have int edge_level\(const vertex&, const vertex&\) const
namespace tessellation_edge_level {
struct program {
    static constexpr int max_level = 4;
    int edge_level(const vp::vertex_output<>& RIGHT(, const vp::vertex_output<>&)) const { return 2; }
    glm::vec3 operator()(const vp::patch_point<vp::no_varyings>& p) const { return p.position(); }
};
PROGRAM(vp::tessellate{program{}}, ones)
}
#endif
#if CASE_tessellation_max_level || ALL // max_level must be 1 to 1024
namespace tessellation_max_level {
struct program {
    static constexpr int max_level = WRONG(2000) RIGHT(1024);
    int edge_level(const vp::vertex_output<>&, const vp::vertex_output<>&) const { return 2; }
    glm::vec3 operator()(const vp::patch_point<vp::no_varyings>& p) const { return p.position(); }
};
PROGRAM(vp::tessellate{program{}}, ones)
}
#endif

// ---- grids and flags ------------------------------------------------------------------------------------------------

#if CASE_fit_device_memory || ALL // these positions may be in device memory
vp::grid fit_device_memory(vp::cpu_backend& backend, const vp::mesh<vp::cpu_backend>& mesh) {
    static_cast<void>(backend);
    return vp::fit(WRONG(mesh.view().positions) RIGHT(vp::bounds(backend, mesh.view().positions)), {8, 8, 8});
}
#endif
#if CASE_cxx17 || ALL // VoxelPipe needs C\+\+20
// max-errors: 2
// flags: -std=c++17
#endif
#if CASE_fast_math || ALL // compile without -ffast-math
// flags: -ffast-math
#endif
#if CASE_occupied_struct || ALL // a struct needs an operator==
namespace occupied_struct {
struct value {
    int number;
    RIGHT(bool operator==(const value&) const = default;)
};
int count() {
    vp::cpu_backend backend;
    const vp::framebuffer<vp::cpu_backend, vp::target<value, vp::blend::replace>> values{backend, {8, 8, 8}};
    int occupied = 0;
    vp::for_each_occupied(vp::get<0>(values).to_host_target(backend), [&](const glm::ivec3&, const value&) { ++occupied; });
    return occupied;
}
}
#endif
