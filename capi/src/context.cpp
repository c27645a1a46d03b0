// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "backend_calls.hpp"

#include <voxelpipe/config.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <system_error>

#define VOXELPIPE_TEXT_OF(x) #x
#define VOXELPIPE_TEXT(x) VOXELPIPE_TEXT_OF(x)

namespace voxelpipe::capi {
namespace {

// Memory of its own, so that there is a message where there is no memory.
thread_local std::array<char, 512> last_message{};

vp_code fail(vp_code code, const char* text) noexcept {
    const std::size_t n = std::min(std::strlen(text), last_message.size() - 1);
    std::memcpy(last_message.data(), text, n);
    last_message[n] = '\0';
    return code;
}

vp_code code_of(status_code code) {
    switch (code) {
    case status_code::ok:
        return VP_OK;
    case status_code::index_out_of_range:
        return VP_ERROR_BAD_INDEX;
    case status_code::bad_extent:
    case status_code::bad_crop:
    case status_code::extent_too_large:
    case status_code::bad_origin:
    case status_code::bad_voxel_size:
        return VP_ERROR_BAD_GRID;
    case status_code::bad_solid_options:
    case status_code::bad_distance_options:
    case status_code::bad_cell_options:
    case status_code::crop_without_whole:
        return VP_ERROR_BAD_OPTION;
    case status_code::size_overflow:
    case status_code::too_many_triangles:
    case status_code::winding_too_large:
        return VP_ERROR_TOO_LARGE;
    case status_code::out_of_memory:
        return VP_ERROR_OUT_OF_MEMORY;
    case status_code::device_error:
        return VP_ERROR_DEVICE;
    default:
        return VP_ERROR_INTERNAL;
    }
}

backend_calls calls_on_cuda(unsigned threads) {
#if defined(VOXELPIPE_CAPI_CUDA)
    return cuda_calls(threads);
#else
    (void)threads;
    throw failure{VP_ERROR_NO_BACKEND, "this library was built without VP_BACKEND_CUDA"};
#endif
}

} // namespace

vp_code guarded_call(void (*body)(void*), void* state) noexcept {
    try {
        last_message[0] = '\0';
        body(state);
        return VP_OK;
    } catch (const failure& f) {
        return fail(f.code, f.text.c_str());
    } catch (const std::bad_alloc&) {
        return fail(VP_ERROR_OUT_OF_MEMORY, "out of memory");
    } catch (const std::length_error&) {
        return fail(VP_ERROR_OUT_OF_MEMORY, "out of memory: more bytes than can be addressed");
    } catch (const std::system_error& e) { // a thread that cannot be started
        return fail(VP_ERROR_OUT_OF_MEMORY, e.what());
    } catch (const std::exception& e) {
        return fail(VP_ERROR_INTERNAL, e.what());
    } catch (...) {
        return fail(VP_ERROR_INTERNAL, "unknown fault");
    }
}

void check_struct_size(std::uint32_t size, std::size_t expected, const char* what) {
    if (size == expected) return;
    throw failure{VP_ERROR_VERSION, std::string(what) + ": struct_size is " + std::to_string(size) +
                                        ", and in this version of the library " + std::to_string(expected)};
}

void check_enum(std::int32_t value, std::int32_t last, const char* what) {
    if (value >= 0 && value <= last) return;
    throw failure{VP_ERROR_BAD_OPTION,
                  std::string(what) + " is " + std::to_string(value) + ", not from 0 to " + std::to_string(last)};
}

void finish(const status& s, vp_counters* counters) {
    if (!s.ok()) throw failure{code_of(s.code), s.message()};
    if (counters == nullptr) return;
    *counters = vp_counters{
        .struct_size = sizeof(vp_counters),
        .reserved = 0,
        .triangles = s.counts.triangles_in,
        .triangles_dropped = s.counts.triangles_dropped(),
        .triangles_zero_area = s.counts.triangles_zero_area,
        .triangles_outside = s.counts.triangles_outside,
        .triangles_drawn = s.counts.triangles_drawn,
        .fragments = s.counts.fragments,
        .voxels = s.counts.voxels,
        .open_rows = s.solid.open_rows + s.cells.open_rows, // one of the two is another call's
        .crossings = s.solid.crossings,
        .max_winding = s.solid.max_winding,
        .hole_edges = s.solid.hole_edges,
        .holes = s.solid.holes,
        .cones = s.solid.cones,
        .band_samples = s.distance.band_samples,
        .bad_points = s.distance.bad_points,
        .cut_voxels = s.cells.cut_voxels,
        .below_zero = s.cells.below_zero,
        .above_one = s.cells.above_one,
        .open_edges = s.cells.open_edges,
        .volume = s.cells.volume(),
    };
}

voxelize_options surface_options_of(const vp_surface_options* options) {
    const vp_surface_options o = options_of(options);
    check_enum(o.coverage, VP_COVERAGE_DIAGONAL, "coverage");
    constexpr coverage coverages[] = {coverage::conservative, coverage::thin, coverage::crosshair, coverage::diagonal};
    return {coverages[o.coverage]};
}

solid_options solid_options_of(const vp_solid_options& o) {
    check_enum(o.fill, VP_FILL_POSITIVE, "fill");
    check_enum(o.bodies, VP_BODIES_EACH, "bodies");
    check_enum(o.extent, VP_EXTENT_INNER, "extent");
    check_enum(o.repair, VP_REPAIR_WINDING, "repair");
    check_enum(o.closing, solid_options::max_closing, "closing");
    constexpr fill_rule rules[] = {fill_rule::nonzero, fill_rule::even_odd, fill_rule::positive};
    constexpr solid_extent extents[] = {solid_extent::centre, solid_extent::outer, solid_extent::inner};
    constexpr repair repairs[] = {repair::none, repair::close_holes, repair::exterior, repair::vote, repair::winding};
    solid_options options;
    options.rule = rules[o.fill];
    options.bodies = o.bodies == VP_BODIES_EACH ? bodies::draw : bodies::call;
    options.extent = extents[o.extent];
    options.repair = repairs[o.repair];
    options.closing = o.closing;
    if (o.max_hole_edges != 0) options.max_hole_edges = o.max_hole_edges;
    return options;
}

} // namespace voxelpipe::capi

using namespace voxelpipe::capi;

extern "C" {

uint32_t vp_abi_version(void) { return VP_ABI_VERSION; }

const char* vp_version(void) {
    return VOXELPIPE_TEXT(VOXELPIPE_VERSION_MAJOR) "." VOXELPIPE_TEXT(VOXELPIPE_VERSION_MINOR) "." VOXELPIPE_TEXT(
        VOXELPIPE_VERSION_PATCH);
}

const char* vp_code_name(vp_code code) {
    constexpr const char* names[] = {
        "VP_OK",
        "VP_ERROR_NULL_HANDLE",
        "VP_ERROR_WRONG_HANDLE",
        "VP_ERROR_NULL_POINTER",
        "VP_ERROR_VERSION",
        "VP_ERROR_BAD_INDEX",
        "VP_ERROR_BAD_ARRAY",
        "VP_ERROR_BAD_GRID",
        "VP_ERROR_BAD_OPTION",
        "VP_ERROR_TOO_LARGE",
        "VP_ERROR_OUT_OF_MEMORY",
        "VP_ERROR_NO_BACKEND",
        "VP_ERROR_INTERNAL",
        "VP_ERROR_DEVICE",
    };
    static_assert(std::size(names) == VP_ERROR_DEVICE + 1);
    return code >= 0 && code <= VP_ERROR_DEVICE ? names[code] : "unknown code";
}

const char* vp_last_message(void) { return last_message.data(); }

vp_code vp_context_create(uint32_t abi_version, int32_t backend, uint32_t threads, vp_context** context) {
    return guarded([&] {
        check_pointer(context, "context");
        if (abi_version != VP_ABI_VERSION)
            throw failure{VP_ERROR_VERSION, "the program was compiled for version " + std::to_string(abi_version) +
                                                " of the C interface, and this library has version " +
                                                std::to_string(VP_ABI_VERSION)};
        check_enum(backend, VP_BACKEND_CUDA, "backend");
        if (threads > 4096) throw failure{VP_ERROR_BAD_OPTION, "threads is above 4096"};
        auto made = std::make_unique<vp_context>();
        made->threads = threads;
        made->on = backend == VP_BACKEND_CUDA ? calls_on_cuda(threads) : cpu_calls(threads);
        *context = made.release();
    });
}

void vp_context_destroy(vp_context* context) { destroy(context); }

} // extern "C"
