// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Fuzzing the API: bytes become a grid, a crop of it, a mesh and a coverage rule. The library's A-buffer and
// framebuffer must hold the oracle's voxels, and bad input must be refused with the right code. This is a libFuzzer
// target. Built with VOXELPIPE_FUZZ_REPLAY by any compiler, it is a program that runs the given files and folders, and
// fails if they are empty. Without arguments it runs pseudo-random inputs (VOXELPIPE_FUZZ_INPUTS of them, 15000 if
// unset).

#include "library.hpp"
#include "solid_oracle.hpp"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace {

namespace vp = voxelpipe;

[[noreturn]] void fail(const std::string& what) {
    std::fprintf(stderr, "fuzz_api: %s\n", what.c_str());
    std::abort();
}

void require(bool condition, const char* what) {
    if (!condition) fail(what);
}

// Reads numbers from the input; zeros after its end.
class reader {
public:
    reader(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

    template <class T>
    T raw() {
        T value{};
        const std::size_t n = std::min(sizeof(T), left_);
        std::memcpy(&value, data_, n);
        data_ += n;
        left_ -= n;
        return value;
    }
    int below(int count) { return raw<std::uint16_t>() % count; }
    bool empty() const { return left_ == 0; }

private:
    const std::uint8_t* data_;
    std::size_t left_;
};

struct input {
    oracle::grid g{};
    oracle::part p{};
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    vp::coverage rule = vp::coverage::conservative;
    unsigned threads = 1;
};

double voxel_size(reader& in) {
    switch (in.below(5)) {
    case 0:
        return 1.0;
    case 1:
        return std::ldexp(1.0, in.below(41) - 20);
    case 2:
        return 0.001 * (1 + in.below(5000));
    case 3:
        return std::fabs(static_cast<double>(in.raw<float>()));
    default:
        return in.raw<double>();
    }
}

double origin(reader& in) {
    switch (in.below(4)) {
    case 0:
        return 0.0;
    case 1:
        return in.raw<std::int16_t>() * 0.25;
    case 2:
        return static_cast<double>(in.raw<float>());
    default:
        return in.raw<double>();
    }
}

// A double too large for a float becomes an infinity; the cast alone would be undefined.
float to_float(double x) {
    constexpr double largest = static_cast<double>(std::numeric_limits<float>::max());
    if (std::isnan(x)) return std::numeric_limits<float>::quiet_NaN();
    if (std::fabs(x) > largest)
        return x > 0 ? std::numeric_limits<float>::infinity() : -std::numeric_limits<float>::infinity();
    return static_cast<float>(x);
}

// Mostly near the part, on and off the lattice; sometimes any float.
float coordinate(reader& in, const input& of, int axis) {
    const double size = of.g.voxel_size[axis];
    const double corner = of.g.origin[axis] + of.p.begin[axis] * size;
    switch (in.raw<std::uint8_t>() % 6) {
    case 0:
        return to_float(corner + in.raw<std::int8_t>() * size); // voxel faces
    case 1:
        return to_float(corner + in.raw<std::int8_t>() * 0.5 * size); // and centres
    case 2:
        return to_float(corner + in.raw<std::int16_t>() * 0x1p-9 * size); // within 64 voxels
    case 3:
        return to_float(corner + in.raw<std::int32_t>() * 0x1p-16 * size);
    case 4:
        return to_float(corner + in.raw<std::int32_t>() * 0x1p-6 * size); // far
    default:
        return in.raw<float>();
    }
}

input parse(const std::uint8_t* data, std::size_t size) {
    reader in(data, size);
    input r;
    r.rule = in.below(2) == 0 ? vp::coverage::conservative : vp::coverage::thin;
    r.threads = static_cast<unsigned>(1 + in.below(3));
    const int kind = in.below(4);
    const bool same_size = in.below(2) == 0;
    const double shared_size = voxel_size(in);
    for (int axis = 0; axis < 3; ++axis) {
        r.g.voxel_size[axis] = same_size ? shared_size : voxel_size(in);
        r.g.origin[axis] = origin(in);
        if (kind == 0) { // a part of a large grid
            r.g.extent[axis] = 1 + static_cast<int>(in.raw<std::uint32_t>() % (1u << 20));
            r.p.begin[axis] = static_cast<int>(in.raw<std::uint32_t>() % static_cast<std::uint32_t>(r.g.extent[axis]));
            r.p.size[axis] = 1 + in.below(std::min(16, r.g.extent[axis] - r.p.begin[axis]));
        } else {
            r.g.extent[axis] = 1 + in.below(kind == 1 ? 40 : 12);
            r.p.size[axis] = r.g.extent[axis];
        }
    }
    const int vertices = 1 + in.below(24);
    for (int n = 0; n < vertices; ++n)
        r.positions.emplace_back(coordinate(in, r, 0), coordinate(in, r, 1), coordinate(in, r, 2));
    while (!in.empty() && r.triangles.size() < 16) {
        // One index in 256 may be out of range.
        const auto index = [&] {
            const auto byte = in.raw<std::uint8_t>();
            return byte == 255 ? in.raw<std::uint32_t>() : byte % static_cast<std::uint32_t>(vertices);
        };
        const std::uint32_t a = index(), b = index(), c = index();
        r.triangles.emplace_back(a, b, c);
    }
    return r;
}

// The status codes that this input allows, including ok if it may be drawn.
bool may_be(vp::status_code code, const input& in) {
    bool bad_index = false, bad_origin = false, bad_size = false, odd_size = false;
    for (const glm::uvec3& t : in.triangles)
        for (int n = 0; n < 3; ++n) bad_index = bad_index || t[n] >= in.positions.size();
    for (int axis = 0; axis < 3; ++axis) {
        const double size = in.g.voxel_size[axis];
        bad_origin = bad_origin || !std::isfinite(in.g.origin[axis]);
        bad_size = bad_size || !(size > 0.0) || !std::isfinite(size);
        odd_size = odd_size || size < 1e-290 || size > 1e290; // too extreme to divide by; it may be refused
    }
    const bool bad = bad_index || bad_origin || bad_size;
    switch (code) {
    case vp::status_code::ok:
        return !bad;
    case vp::status_code::index_out_of_range:
        return bad_index;
    case vp::status_code::bad_origin:
        return bad_origin;
    case vp::status_code::bad_voxel_size:
        return bad_size || odd_size;
    default:
        return false;
    }
}

void check(const input& in) {
    vp::cpu_backend be(in.threads);
    const vp::grid g = oracle::as_library(in.g, in.p);
    const vp::mesh_view<> mesh{in.positions, in.triangles};
    vp::abuffer<vp::cpu_backend> lists{be};
    const vp::status s = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(true), lists, in.rule);
    require(may_be(s.code, in), "a status that this input does not call for");

    using count = vp::target<std::uint16_t, vp::blend::count>;
    vp::framebuffer<vp::cpu_backend, count> fb{be, g.extent};
    auto view = fb.view();
    constexpr std::uint16_t untouched = 0xbeef;
    const std::size_t cells = static_cast<std::size_t>(g.extent.x) * static_cast<std::size_t>(g.extent.y) *
                              static_cast<std::size_t>(g.extent.z);
    std::fill_n(vp::get<0>(view.targets).elements, cells, untouched);
    const vp::status drawn = vp::voxelize(be, mesh, g, vp::passthrough{}, vp::constant(std::uint16_t{1}), fb, in.rule);
    require(drawn.code == s.code, "framebuffer and A-buffer differ in status");
    const auto counts = vp::get<0>(fb).to_host(be);
    if (!s.ok()) {
        require(lists.num_voxels() == 0 && lists.num_fragments() == 0, "a failed call left lists");
        require(std::all_of(counts.begin(), counts.end(), [&](std::uint16_t n) { return n == untouched; }),
                "a failed call wrote to the framebuffer");
        return;
    }

    require(drawn.counts == s.counts, "framebuffer and A-buffer differ in counts");
    const auto found = oracle::voxels_by_triangle(lists.to_host(be), in.triangles.size(), in.p);
    std::vector<std::uint16_t> expected(cells, 0);
    std::uint64_t dropped = 0, fragments = 0;
    for (std::size_t n = 0; n < in.triangles.size(); ++n) {
        oracle::world_triangle w{};
        for (int v = 0; v < 3; ++v)
            for (int axis = 0; axis < 3; ++axis) w.v[v][axis] = in.positions[in.triangles[n][v]][axis];
        const oracle::snapped_triangle t = oracle::snap(in.g, w.v);
        dropped += t.dropped;
        const auto voxels = oracle::expected_voxels(in.g, t, in.rule, in.p);
        if (found[n] != voxels)
            fail((in.rule == vp::coverage::thin ? "thin " : "conservative ") + oracle::describe(in.g, w));
        fragments += voxels.size();
        for (const oracle::voxel& v : voxels) {
            const int x = v.i - in.p.begin[0], y = v.j - in.p.begin[1], z = v.k - in.p.begin[2];
            ++expected[static_cast<std::size_t>((z * g.extent.y + y) * g.extent.x + x)];
        }
    }
    require(counts == expected, "the framebuffer's counts");
    require(s.counts.triangles_dropped() == dropped, "dropped triangles");
    require(s.counts.fragments == fragments, "fragments");
}

// The input as a solid: some of its voxels by the oracle's rays towards the low end of their rows, and cones that leave
// no row open.
void check_solid(const input& in) {
    vp::cpu_backend be(in.threads);
    const vp::grid g = oracle::as_library(in.g, in.p);
    const vp::mesh_view<> mesh{in.positions, in.triangles};
    using bits = vp::target<vp::bit, vp::blend::bit_or>;
    vp::framebuffer<vp::cpu_backend, bits> fb{be, g.extent};
    const auto draw = [&](const vp::solid_options& options) {
        const vp::status s = vp::voxelize_solid(be, mesh, g, vp::passthrough{}, vp::constant(true), fb, options);
        require(may_be(s.code, in), "a solid's status that this input does not call for");
        return s;
    };
    const auto rule = static_cast<vp::fill_rule>(in.triangles.size() % 3);
    if (!draw({.repair = vp::repair::close_holes}).ok()) return;
    require(draw({.rule = rule, .repair = vp::repair::close_holes}).solid.open_rows == 0, "an open row behind cones");
    const vp::status s = draw({.rule = rule});
    require(s.ok(), "the same input fails");

    std::vector<oracle::snapped_triangle> snapped;
    for (const glm::uvec3& t : in.triangles) {
        oracle::world_triangle w{};
        for (int v = 0; v < 3; ++v)
            for (int axis = 0; axis < 3; ++axis) w.v[v][axis] = in.positions[t[v]][axis];
        snapped.push_back(oracle::snap(in.g, w.v));
    }
    const oracle::winding_oracle oracle(oracle::fraction_bits(in.g), snapped, {-1, 0, 0});
    const auto host = vp::get<0>(fb).to_host_target(be);
    const int cells = g.extent.x * g.extent.y * g.extent.z, step = cells / 48 + 1;
    for (int i = 0; i < cells; i += step) {
        const int x = i % g.extent.x, y = i / g.extent.x % g.extent.y, z = i / g.extent.x / g.extent.y;
        const std::int64_t winding = oracle.winding({x + in.p.begin[0], y + in.p.begin[1], z + in.p.begin[2]});
        const bool inside = rule == vp::fill_rule::even_odd  ? winding % 2 != 0
                            : rule == vp::fill_rule::nonzero ? winding != 0
                                                             : winding > 0;
        require(host(x, y, z) == inside, "a voxel of a solid");
        if (rule != vp::fill_rule::even_odd)
            require(static_cast<std::uint64_t>(winding < 0 ? -winding : winding) <= s.solid.max_winding, "max_winding");
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const input in = parse(data, size);
    check(in);
    check_solid(in);
    return 0;
}

#ifdef VOXELPIPE_FUZZ_REPLAY
#include <filesystem>
#include <fstream>
#include <iterator>

namespace {

// Returns the number of files.
std::size_t replay(const std::filesystem::path& path) {
    if (std::filesystem::is_directory(path)) {
        std::size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator(path)) count += replay(entry.path());
        return count;
    }
    std::ifstream file(path, std::ios::binary);
    if (!file) fail("cannot read " + path.string());
    const std::vector<char> bytes(std::istreambuf_iterator<char>(file), {});
    std::printf("%s, %zu bytes\n", path.string().c_str(), bytes.size());
    std::fflush(stdout); // so that the name is printed before a crash
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    return 1;
}

// Many zeros and small numbers among random bytes, which hit ties and corners without a fuzzer's feedback.
void random_inputs(std::uint64_t count) {
    oracle::splitmix64 random(20110801);
    std::uint64_t drawn = 0;
    for (std::uint64_t n = 0; n < count; ++n) {
        std::vector<std::uint8_t> bytes(40 + random.below(400));
        const std::uint64_t simple = random.below(4);
        for (std::uint8_t& b : bytes) {
            const std::uint64_t r = random.next();
            b = static_cast<std::uint8_t>(r % 4 < simple ? (r >> 8) % 4 : r >> 8);
        }
        const input in = parse(bytes.data(), bytes.size());
        drawn += may_be(vp::status_code::ok, in);
        check(in);
        check_solid(in);
    }
    std::printf("%llu random inputs, %llu of them fit to be drawn\n", static_cast<unsigned long long>(count),
                static_cast<unsigned long long>(drawn));
    require(drawn >= count / 4, "too few inputs were fit to be drawn");
}

} // namespace

int main(int argc, char** argv) {
    if (argc > 1) {
        std::size_t count = 0;
        for (int n = 1; n < argc; ++n) count += replay(argv[n]);
        std::printf("replayed %zu files\n", count);
        return count != 0 ? EXIT_SUCCESS : EXIT_FAILURE;
    }
    const char* const inputs = std::getenv("VOXELPIPE_FUZZ_INPUTS");
    random_inputs(inputs != nullptr ? std::strtoull(inputs, nullptr, 10) : 15000);
    return 0;
}
#endif
