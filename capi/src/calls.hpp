// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Shared by the functions of the C API: what handles point to, how failures become codes and messages, and the checks
// of what the caller hands over.

#include <voxelpipe.h>

#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstdint>
#include <string>
#include <vector>

// What handles point to; vp_context is in backend_calls.hpp. `kind` tells one kind of handle from another.
struct vp_mesh {
    static constexpr std::uint64_t its_kind = 0x7670'6d65'7368'2020; // "vpmesh  "
    std::uint64_t kind = its_kind;
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    std::vector<std::uint64_t> parts; // first triangles
    std::uint64_t index_bound = 0;    // greater than every index

    [[nodiscard]] voxelpipe::mesh_view<> view() const {
        return {voxelpipe::array_view<const glm::vec3>(positions.data(), positions.size()),
                voxelpipe::array_view<const glm::uvec3>(triangles.data(), triangles.size()),
                {},
                {triangles.data(), triangles.size(), index_bound}};
    }
};
struct vp_list {
    static constexpr std::uint64_t its_kind = 0x7670'6c69'7374'2020; // "vplist  "
    std::uint64_t kind = its_kind;
    std::uint32_t columns = 0;
    std::vector<std::int32_t> coordinates; // x, y, z of each voxel
    std::vector<float> values;             // columns of each voxel
};
struct vp_links {
    static constexpr std::uint64_t its_kind = 0x7670'6c69'6e6b'7320; // "vplinks "
    std::uint64_t kind = its_kind;
    std::uint32_t neighbours = 18;
    std::vector<glm::ivec3> voxels;
    std::vector<float> q;                        // `neighbours` of each voxel, as these:
    std::vector<std::uint32_t> triangles, parts; // voxelpipe::no_crossing without
};

namespace voxelpipe::capi {

// What a call throws where it cannot go on.
struct failure {
    vp_code code;
    std::string text;
};

// Runs a call's body; nothing that it throws gets out.
vp_code guarded_call(void (*body)(void*), void* state) noexcept;
template <class Body>
vp_code guarded(Body&& body) noexcept {
    return guarded_call([](void* state) { (*static_cast<std::remove_reference_t<Body>*>(state))(); }, &body);
}

// `what` names the argument in messages.
template <class Handle>
Handle& checked_handle(Handle* handle, const char* what) {
    if (handle == nullptr) throw failure{VP_ERROR_NULL_HANDLE, std::string(what) + " is a null handle"};
    if (handle->kind != std::remove_const_t<Handle>::its_kind)
        throw failure{VP_ERROR_WRONG_HANDLE, std::string(what) + " is a handle of another kind"};
    return *handle;
}
inline void check_pointer(const void* pointer, const char* what) {
    if (pointer == nullptr) throw failure{VP_ERROR_NULL_POINTER, std::string(what) + " is null"};
}
void check_struct_size(std::uint32_t size, std::size_t expected, const char* what);
template <class Struct>
const Struct& checked_struct(const Struct* s, const char* what) {
    check_pointer(s, what);
    check_struct_size(s->struct_size, sizeof(Struct), what);
    return *s;
}
// Options, or their defaults for null.
template <class Struct>
Struct options_of(const Struct* options) {
    if (options == nullptr) {
        Struct defaults{};
        defaults.struct_size = sizeof(Struct);
        return defaults;
    }
    return checked_struct(options, "options");
}
inline void check_counters(const vp_counters* counters) {
    if (counters != nullptr) check_struct_size(counters->struct_size, sizeof(vp_counters), "counters");
}
// Throws for a value that is not from 0 to `last`.
void check_enum(std::int32_t value, std::int32_t last, const char* what);

// Throws what the status of a failed call means. Fills the counters, where there are some, of a call that succeeded.
void finish(const status& s, vp_counters* counters);

[[nodiscard]] grid grid_of(const vp_grid* g);
[[nodiscard]] voxelize_options surface_options_of(const vp_surface_options* options);
[[nodiscard]] solid_options solid_options_of(const vp_solid_options& options);

// Deletes what a handle points to, unless it is null or of another kind.
template <class Handle>
void destroy(Handle* handle) noexcept {
    if (handle != nullptr && handle->kind == Handle::its_kind) delete handle;
}

} // namespace voxelpipe::capi
