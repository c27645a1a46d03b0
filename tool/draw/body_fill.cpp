// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "body_fill.hpp"

#include "model/finite.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "solid_options.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <map>
#include <new>
#include <utility>

namespace voxelize {

namespace {

// The framebuffer of a body's voxels, of the type that sparse_pipeline compiles anyway: its second target stays off.
using body_bits = vp::sparse_framebuffer<vp::cpu_backend, vp::target<vp::bit, vp::blend::bit_or>,
                                         vp::target<std::uint32_t, vp::blend::count>>;

// The rule by which one body accepts a voxel.
vp::solid_options acceptance_of(const solid_request& request) {
    solid_request own = request;
    if (request.vote || request.rule == solid_rule::exterior) own.rule = solid_rule::nonzero;
    own.close_holes = lids_of_bodies(request);
    own.vote = false;
    own.closing = 0;
    own.slab = nullptr;
    own.cones = nullptr;
    own.extent = solid_extent::centre;
    vp::solid_options options = solid_options_of(own);
    options.bodies = vp::bodies::draw;
    options.count_voxels = false;
    return options;
}

// The instances that have triangles.
std::vector<const instance*> shown_in(const scene& model) {
    std::vector<const instance*> shown;
    for (const instance& i : model.instances)
        if (!model.primitives[i.primitive].triangles.empty()) shown.push_back(&i);
    return shown;
}

bool is_before(std::uint64_t a, std::uint32_t group_of_a, std::uint64_t b, std::uint32_t group_of_b) {
    return a != b ? a < b : group_of_a < group_of_b;
}

} // namespace

std::uint64_t lids_of_bodies(const solid_request& request) {
    if (request.close_holes != 0) return request.close_holes;
    return request.is_repaired() ? UINT64_MAX : 0;
}

bool leaves_voxels(const solid_request& solid, blend_alpha alpha, std::span<const material> materials) {
    return solid.is_repaired() || std::any_of(materials.begin(), materials.end(), [&](const material& m) {
               return alpha_of(m, alpha) == alpha_mode::mask;
           });
}

bool needs_mean(const voxelize_request& request, std::span<const material> materials) {
    if (!request.solid || !request.wants_colors()) return false;
    return request.solid->fill == solid_fill::mean ||
           (request.solid->fill == solid_fill::body && leaves_voxels(*request.solid, request.alpha, materials));
}

bool fills_bodies(const voxelize_request& request) {
    return request.solid && request.solid->fill == solid_fill::body &&
           (request.wants_colors() || request.wants(target::material));
}

const instance* instance_of_parts(const scene& model, const voxelize_request& request) {
    if (!fills_bodies(request) || request.solid->bodies != nullptr || !request.wants_colors()) return nullptr;
    const std::vector<const instance*> shown = shown_in(model);
    if (shown.size() != 1) return nullptr;
    const primitive& only = model.primitives[shown.front()->primitive];
    return only.colors.empty() && only.texcoords.empty() ? nullptr : shown.front();
}

// ---- the map --------------------------------------------------------------------------------------------------------

void body_map::add(const sparse_volume& voxels, std::uint32_t value) {
    const auto group = static_cast<std::uint32_t>(groups_.size());
    groups_.push_back(value);
    const auto cells_of = [&](int level) -> std::vector<cell>& {
        if (levels_.size() <= static_cast<std::size_t>(level)) levels_.resize(static_cast<std::size_t>(level) + 1);
        return levels_[static_cast<std::size_t>(level)];
    };
    for (std::size_t b = 0; b < voxels.keys.size(); ++b) {
        if (voxels.masks[b].count() == brick_voxels)
            cells_of(0).push_back({voxels.keys[b], group});
        else
            partials_.push_back({voxels.keys[b], group, voxels.masks[b]});
    }
    for (const voxelpipe::brick_tile& tile : voxels.tiles) cells_of(tile.level()).push_back({tile.first(), group});
}

void body_map::sort() {
    for (std::vector<cell>& cells : levels_) {
        std::sort(cells.begin(), cells.end(),
                  [](const cell& a, const cell& b) { return is_before(a.key, a.group, b.key, b.group); });
        cells.erase(
            std::unique(cells.begin(), cells.end(), [](const cell& a, const cell& b) { return a.key == b.key; }),
            cells.end());
    }
    std::sort(partials_.begin(), partials_.end(),
              [](const partial& a, const partial& b) { return is_before(a.key, a.group, b.key, b.group); });
}

std::uint32_t body_map::group_over(std::uint64_t key, int level) const {
    std::uint32_t first = none;
    for (std::size_t l = static_cast<std::size_t>(level); l < levels_.size(); ++l) {
        const std::uint64_t of_cube = key >> (3 * l) << (3 * l);
        const auto at = std::lower_bound(levels_[l].begin(), levels_[l].end(), of_cube,
                                         [](const cell& c, std::uint64_t k) { return c.key < k; });
        if (at != levels_[l].end() && at->key == of_cube) first = std::min(first, at->group);
    }
    return first;
}

std::optional<std::uint32_t> body_map::of_brick(std::uint64_t key, labels& each) const {
    if (is_everywhere_) return 0;
    const std::uint32_t over = group_over(key, 0);
    auto at = std::lower_bound(partials_.begin(), partials_.end(), key,
                               [](const partial& p, std::uint64_t k) { return p.key < k; });
    if (at == partials_.end() || at->key != key || at->group > over) return value_of(over);
    each.fill(value_of(over));
    voxelpipe::brick_mask taken;
    for (; at != partials_.end() && at->key == key && at->group < over; ++at)
        for (unsigned bit = 0; bit < brick_voxels; ++bit)
            if (at->mask.has(bit) && !taken.has(bit)) {
                each[bit] = value_of(at->group);
                taken.words[bit >> 6] |= std::uint64_t{1} << (bit & 63U);
            }
    if (std::all_of(each.begin(), each.end(), [&](std::uint32_t n) { return n == each.front(); })) return each.front();
    return std::nullopt;
}

std::optional<std::uint32_t> body_map::of_cube(std::uint64_t first, int level) const {
    const std::uint32_t over = group_over(first, level);
    const std::uint64_t end = first + (std::uint64_t{1} << (3 * level));
    const auto has_earlier = [&](const auto& cells) { // within the cube
        auto at = std::lower_bound(cells.begin(), cells.end(), first,
                                   [](const auto& c, std::uint64_t k) { return c.key < k; });
        for (; at != cells.end() && at->key < end; ++at)
            if (at->group < over) return true;
        return false;
    };
    bool differs = has_earlier(partials_);
    for (std::size_t l = 0; l < std::min(levels_.size(), static_cast<std::size_t>(level)) && !differs; ++l)
        differs = has_earlier(levels_[l]);
    if (differs) return std::nullopt;
    return value_of(over);
}

// Appends the tile, or what it is cut into, and the numbers of the bodies of the tiles that it appends.
void body_map::cut(voxelpipe::brick_tile tile, const same_values& same, sparse_volume& to,
                   std::vector<std::uint32_t>& numbers) const {
    labels each;
    if (const std::optional<std::uint32_t> number =
            tile.level() == 0 ? of_brick(tile.first(), each) : of_cube(tile.first(), tile.level())) {
        to.tiles.push_back(tile);
        numbers.push_back(*number);
        return;
    }
    if (tile.level() == 0) {
        voxelpipe::brick_mask full;
        std::fill(std::begin(full.words), std::end(full.words), ~std::uint64_t{0});
        to.keys.push_back(tile.first());
        to.masks.push_back(full);
        return;
    }
    const std::size_t before = to.tiles.size(), bricks = to.keys.size();
    const std::uint64_t side = std::uint64_t{1} << (3 * (tile.level() - 1));
    for (std::uint64_t i = 0; i < 8; ++i)
        cut(voxelpipe::brick_tile::of(tile.first() + i * side, tile.level() - 1), same, to, numbers);
    // Eight parts of one body are whole after all.
    const bool is_whole =
        to.keys.size() == bricks && to.tiles.size() == before + 8 &&
        std::all_of(numbers.end() - 8, numbers.end(), [&](std::uint32_t n) { return same(n, numbers.back()); });
    if (!is_whole) return;
    to.tiles.resize(before);
    numbers.resize(before + 1);
    to.tiles.push_back(tile);
}

sparse_volume body_map::with_whole_tiles(const sparse_volume& v, const same_values& same) const {
    sparse_volume made;
    made.shape = v.shape;
    std::vector<std::uint32_t> numbers;
    voxelpipe::for_each_brick_and_tile(
        v.table(),
        [&](std::uint64_t b) {
            made.keys.push_back(v.keys[b]);
            made.masks.push_back(v.masks[b]);
        },
        [&](std::uint64_t t) { cut(v.tiles[t], same, made, numbers); });
    std::uint64_t rank = 0;
    for (const voxelpipe::brick_mask& mask : made.masks) {
        made.offsets.push_back(rank);
        rank += mask.count();
    }
    if (!made.keys.empty()) made.offsets.push_back(rank);
    return made;
}

// ---- the bodies -----------------------------------------------------------------------------------------------------

model_bodies::model_bodies(const scene& model, const voxelize_request& request) : request_(request) {
    leaves_voxels_ = leaves_voxels(*request.solid, request.alpha, model.materials);
    std::vector<body> of_draws;
    if (request.solid->bodies != nullptr) {
        of_draws = request.solid->bodies->bodies;
    } else {
        const std::vector<const instance*> shown = shown_in(model);
        std::vector<body_color> colors(model.primitives.size());
        if (request.wants_colors()) colors = colors_of(model, request);
        for (const instance* i : shown)
            of_draws.push_back(
                {colors[i->primitive], static_cast<std::int32_t>(model.primitives[i->primitive].material)});
        if (const instance* const whole = instance_of_parts(model, request)) {
            const primitive& only = model.primitives[whole->primitive];
            std::vector<primitive> parts = connected_parts(only);
            std::vector<body> of_parts;
            for (const body_color& color : colors_of(parts, model, request))
                of_parts.push_back({color, static_cast<std::int32_t>(only.material)});
            if (!of_parts.empty() && of_parts != std::vector(of_parts.size(), of_parts.front())) {
                of_draws = std::move(of_parts);
                parts_ = std::move(parts);
                places_.reserve(parts_.size());
                mirrored_triangles_.reserve(parts_.size());
                const affine& to_world = whole->to_world;
                for (const primitive& p : parts_)
                    add_draw(p, {to_world, reference_point(request.grid)}, to_world.mirrors());
            } else if (!of_parts.empty()) { // otherwise no triangle can be drawn
                of_draws = {of_parts.front()};
            }
        }
    }
    std::map<std::pair<body_color, std::int32_t>, std::uint32_t> known;
    for (body& b : of_draws) { // what nobody asks for makes no difference
        if (!request.wants_colors()) b.color = {};
        if (!request.wants(target::material)) b.material = -1;
        const auto [at, is_new] = known.try_emplace({b.color, b.material}, static_cast<std::uint32_t>(values_.size()));
        numbers_.push_back(at->second);
        if (is_new) values_.push_back(b);
    }
}

void model_bodies::add_draw(const primitive& of, const placed_vertex_shader& place, bool mirrors) {
    const std::vector<glm::uvec3>* triangles = &of.triangles;
    if (mirrors) {
        std::vector<glm::uvec3>& turned = mirrored_triangles_.emplace_back(of.triangles);
        for (glm::uvec3& corners : turned) std::swap(corners.y, corners.z);
        triangles = &turned;
    }
    places_.push_back(place);
    vp::mesh_view<> mesh{{of.positions.data(), of.positions.size()}, {triangles->data(), triangles->size()}};
    mesh.checked = {triangles->data(), triangles->size(), of.positions.size()}; // the scene's indices are in range
    mesh.copies.count = 1;
    draws_.push_back({mesh, {&places_.back()}, vp::constant(true, 1U)});
}

void model_bodies::take_draws(std::span<const draw> draws) {
    if (parts_.empty()) draws_.assign(draws.begin(), draws.end());
    measure();
}

void model_bodies::make_draws(const scene& model) {
    if (parts_.empty()) {
        places_.reserve(model.instances.size());
        mirrored_triangles_.reserve(model.instances.size());
        for (const instance& shown : model.instances) {
            const primitive& of = model.primitives[shown.primitive];
            if (of.triangles.empty()) continue;
            add_draw(of, {shown.to_world, reference_point(request_.grid)}, shown.to_world.mirrors());
        }
    }
    measure();
}

void model_bodies::measure() {
    boxes_.resize(draws_.size());
    parallel_for(draws_.size(), thread_count(request_.threads), [this](std::size_t d) {
        const draw& of = draws_[d];
        vp::vertex<> v{};
        for (const glm::vec3& position : of.mesh.positions) {
            v.position = position;
            const glm::vec3 p = of.vertex_shader(v);
            if (!is_finite(p)) continue; // its triangles are not drawn
            boxes_[d].low = glm::min(boxes_[d].low, glm::dvec3(p));
            boxes_[d].high = glm::max(boxes_[d].high, glm::dvec3(p));
        }
    });
}

std::vector<model_bodies::run> model_bodies::runs_in(const voxelpipe::grid& part) const {
    // Rows and triangles that one thread draws before others could help.
    constexpr std::uint64_t small = 1 << 16;
    const known_bodies* const known = request_.solid->bodies;
    const bool has_cones = known != nullptr && !known->cones.empty(); // which may reach out of a part of a body
    std::vector<run> runs;
    for (std::size_t first = 0, end = 0; first < draws_.size(); first = end) {
        box around;
        std::uint64_t work = 0;
        for (; end < draws_.size() && numbers_[end] == numbers_[first]; ++end) {
            around.low = glm::min(around.low, boxes_[end].low);
            around.high = glm::max(around.high, boxes_[end].high);
            work += draws_[end].mesh.triangles.size();
        }
        run made{first, end, part, false};
        // A row along x that meets no triangle has no voxel of the body, and none of any row lies before its
        // triangles. Behind them there may be some, where they do not close the body.
        for (int axis = 0; axis < 3 && !has_cones; ++axis) {
            constexpr double margin = 1; // more than what snapping moves a vertex by
            const double most = part.extent[axis];
            const auto voxel = [&](const glm::dvec3& p) { return part.to_voxels(p)[axis]; };
            const int low = static_cast<int>(std::clamp(std::floor(voxel(around.low)) - margin, 0.0, most));
            const int high = axis == 0
                                 ? part.extent.x
                                 : static_cast<int>(std::clamp(std::ceil(voxel(around.high)) + margin, 0.0, most));
            made.part.offset[axis] += low;
            made.part.extent[axis] = high - low;
        }
        const glm::ivec3& n = made.part.extent;
        if (n.x <= 0 || n.y <= 0 || n.z <= 0) continue;
        made.part.whole = part.whole_extent();
        made.is_small = work + static_cast<std::uint64_t>(n.y) * static_cast<std::uint64_t>(n.z) <= small;
        runs.push_back(made);
    }
    return runs;
}

sparse_volume model_bodies::find(const run& bodies, int threads) const {
    vp::cpu_backend backend{static_cast<unsigned>(threads)};
    vp::solid_options how = acceptance_of(*request_.solid);
    const known_bodies* const known = request_.solid->bodies;
    if (known != nullptr && !known->cones.empty()) how.cones = known->cones.data() + bodies.first;
    std::bitset<2> enabled;
    enabled[0] = true;
    body_bits framebuffer(backend, bodies.part.extent, enabled);
    const vp::status status = vp::voxelize_solid(
        backend, std::span(draws_).subspan(bodies.first, bodies.end - bodies.first), bodies.part, framebuffer, how);
    if (status.code == vp::status_code::out_of_memory) throw std::bad_alloc{};
    status.or_throw();
    const auto& from = framebuffer.contents();
    sparse_volume voxels;
    voxels.keys.assign(from.keys.data(), from.keys.data() + from.keys.size());
    voxels.masks.assign(from.masks.data(), from.masks.data() + from.masks.size());
    voxels.tiles.assign(from.tiles.data(), from.tiles.data() + from.tiles.size());
    return voxels;
}

body_map model_bodies::find_in(const voxelpipe::grid& part) const {
    body_map made;
    made.values_ = values_;
    made.leaves_voxels_ = leaves_voxels_;
    made.is_everywhere_ = is_everywhere();
    if (made.is_everywhere_) return made;
    const int threads = thread_count(request_.threads);
    const std::vector<run> runs = runs_in(part);
    const auto add = [&](const run& bodies, const sparse_volume& voxels) { made.add(voxels, numbers_[bodies.first]); };
    for (std::size_t first = 0, end = 0; first < runs.size(); first = end) {
        if (!runs[first].is_small) {
            add(runs[first], find(runs[first], threads));
            ++end;
            continue;
        }
        while (end < runs.size() && runs[end].is_small) ++end;
        ordered_for(
            end - first, threads, [&](std::size_t n) { return find(runs[first + n], 1); },
            [&](std::size_t n, const sparse_volume& voxels) { add(runs[first + n], voxels); });
    }
    made.sort();
    return made;
}

} // namespace voxelize
