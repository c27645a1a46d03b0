// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "slab_passes.hpp"

#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "sparse_outside.hpp"
#include "sparse_solid.hpp"
#include "write/formats/output_file.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>

namespace voxelize {

namespace slabs = voxelpipe::slabs;

namespace {

constexpr const char* name_of(slab_pass pass) {
    constexpr const char* names[] = {"walls", "columns", "means"};
    return names[static_cast<std::size_t>(pass)];
}

void append(std::vector<std::byte>& to, const auto& values) {
    const auto bytes = std::as_bytes(std::span{values});
    to.insert(to.end(), bytes.begin(), bytes.end());
}
template <class T>
std::vector<T> take_front(std::span<const std::byte>& from, std::size_t count) {
    std::vector<T> values(count);
    std::memcpy(values.data(), from.data(), count * sizeof(T));
    from = from.subspan(count * sizeof(T));
    return values;
}

} // namespace

slab_passes::slab_passes(const voxelize_request& request, bool with_means, std::span<const slabs::layer_range> all,
                         std::span<const std::size_t> drawn, double room, std::filesystem::path folder,
                         const pass_files* kept)
    : request_(request), slabs_(all.begin(), all.end()), room_(room), folder_(std::move(folder)), kept_(kept),
      floods_(request.solid && request.solid->rule == solid_rule::exterior), sees_(request.wants(target::color_outer)),
      fills_(with_means) {
    if (floods_) {
        is_whole_ = !std::all_of(drawn.begin(), drawn.end(), [&](std::size_t slab) { return has_borders(slab); });
        if (is_whole_) left_.push_back(slab_pass::walls);
    }
    if (sees_) {
        left_.push_back(slab_pass::columns);
        seen_.low = glm::ivec3(request.padding);
        seen_.extent = request.grid.extent - 2 * request.padding;
        const std::size_t columns = static_cast<std::size_t>(seen_.extent.x) * static_cast<std::size_t>(seen_.extent.y);
        memory::require(static_cast<double>(columns * sizeof(column_ends)), "the columns of --target color-outer");
        seen_.along[2].resize(columns);
    }
    if (fills_) left_.push_back(slab_pass::means);
    for (std::vector<bool>& known : known_) known.resize(slabs_.size());
    if (floods_ && is_whole_) begin_flood({0, request.grid.extent.z});
    for (const slab_pass pass : left_)
        for (std::size_t s = 0; s < slabs_.size(); ++s) known_[static_cast<std::size_t>(pass)][s] = take(pass, s);
}

int slab_passes::left_of(std::size_t slab) const {
    return static_cast<int>(std::count_if(
        left_.begin(), left_.end(), [&](slab_pass pass) { return !known_[static_cast<std::size_t>(pass)][slab]; }));
}

void slab_passes::run(const std::function<void(slab_pass, std::size_t)>& draw, voxelize_stats& stats) {
    if (kept_ != nullptr && (floods_ || sees_ || fills_)) stats.pass_slabs = 0;
    for (const slab_pass pass : left_) {
        const auto begin = std::chrono::steady_clock::now();
        for (std::size_t n = 0; n < slabs_.size(); ++n) {
            const std::size_t slab = (n + (kept_ != nullptr ? kept_->first() : 0)) % slabs_.size();
            if (known_[static_cast<std::size_t>(pass)][slab]) continue;
            if (take(pass, slab)) continue; // another process has found it
            found_.clear();
            draw(pass, slab);
            keep(name_of(pass), slab, found_);
            if (stats.pass_slabs) ++*stats.pass_slabs;
        }
        if (pass == slab_pass::walls) {
            flood_->flood();
            keep_borders();
        }
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
        stats.milliseconds.emplace_back(pass == slab_pass::walls ? "flood" : name_of(pass), time.count());
    }
}

sparse_volume slab_passes::draw(slab_pass pass, sparse_drawer& model, voxelize_request part) {
    if (pass == slab_pass::walls) return model.walls(part);
    if (pass == slab_pass::columns) return model.occupied(part);
    give_colors(part);
    return model.surface(part);
}

void slab_passes::add(slab_pass pass, const sparse_volume& drawn) {
    if (pass != slab_pass::means) {
        add_bricks(pass, drawn);
        if (kept_ == nullptr) return;
        append(found_, std::array{std::uint64_t{drawn.keys.size()}});
        append(found_, drawn.keys);
        append(found_, drawn.masks);
        return;
    }
    std::array<color_mean::sums, target_count> sums{};
    for (const channel& c : drawn.channels)
        if (const target id = *target_named(c.name); is_color(id))
            add_colors(sums[static_cast<std::size_t>(id)], mean_, c);
    for (std::size_t t = 0; t < sums.size(); ++t)
        for (std::size_t a = 0; a < sums[t].size(); ++a) sums_[t][a] += sums[t][a];
    append(found_, sums);
}

void slab_passes::add_bricks(slab_pass pass, const sparse_volume& bricks) {
    if (pass == slab_pass::walls)
        flood_->add_walls(bricks.table());
    else
        add_columns(bricks, seen_);
}

std::optional<slab_passes::bytes> slab_passes::kept(const std::string& what, std::size_t slab) const {
    if (kept_ == nullptr) return std::nullopt;
    return kept_->read(what + '.' + std::to_string(slab));
}

void slab_passes::keep(const std::string& what, std::size_t slab, std::span<const std::byte> found) const {
    if (kept_ != nullptr) kept_->write(what + '.' + std::to_string(slab), found);
}

bool slab_passes::take(slab_pass pass, std::size_t slab) {
    const std::optional<bytes> found = kept(name_of(pass), slab);
    if (!found) return false;
    std::span<const std::byte> rest(*found);
    while (!rest.empty()) {
        if (pass == slab_pass::means) {
            const auto sums = take_front<color_mean::sums>(rest, sums_.size());
            for (std::size_t t = 0; t < sums.size(); ++t)
                for (std::size_t a = 0; a < sums[t].size(); ++a) sums_[t][a] += sums[t][a];
            continue;
        }
        sparse_volume bricks;
        bricks.shape = volume_of(request_.grid);
        const auto count = static_cast<std::size_t>(take_front<std::uint64_t>(rest, 1).front());
        bricks.keys = take_front<std::uint64_t>(rest, count);
        bricks.masks = take_front<voxelpipe::brick_mask>(rest, count);
        bricks.offsets.resize(count + 1); // no values
        add_bricks(pass, bricks);
    }
    return true;
}

void slab_passes::give_colors(voxelize_request& part) {
    if (sees_) part.columns = seen_.along[2].data();
    if (!fills_) return;
    for (std::size_t i = 0; i < means_.size(); ++i) means_[i] = mean_.mean_of(sums_[i]);
    part.solid->means = &means_;
}

void slab_passes::give_to(voxelize_request& part) {
    give_colors(part);
    if (!floods_) return;
    if (!is_whole_) {
        const int layer = part.grid.offset.z - request_.grid.offset.z;
        std::size_t slab = 0;
        while (slabs_[slab].end <= layer) ++slab;
        if (slab != flooded_) flood_slab(slab);
    }
    part.solid->slab = flood_->of(part.grid, {}).slab;
}

slabs::layer_range slab_passes::flooded_for(std::size_t slab) const {
    const int closing = request_.solid->closing;
    return {std::max(0, slabs_[slab].begin - closing), std::min(request_.grid.extent.z, slabs_[slab].end + closing)};
}

std::pair<std::size_t, std::size_t> slab_passes::walls_for(std::size_t slab) const {
    const auto [begin, end] = flooded_for(slab);
    const int closing = request_.solid->closing;
    std::size_t first = slab, last = slab;
    while (first > 0 && slabs_[first].begin > begin - closing) --first;
    while (last + 1 < slabs_.size() && slabs_[last].end < end + closing) ++last;
    return {first, last};
}

void slab_passes::begin_flood(const slabs::layer_range& layers) {
    const glm::ivec3 extent = request_.grid.extent, part{extent.x, extent.y, layers.size()};
    memory::require(slabs::slab_exterior::least_bytes(part, request_.solid->closing), "the flood of --solid exterior");
    flood_.reset();
    flood_.emplace(request_.grid.crop({0, 0, layers.begin}, part), voxelpipe::repair::exterior,
                   static_cast<std::uint64_t>(room_ / 8), folder_.string(),
                   static_cast<unsigned>(thread_count(request_.threads)));
    voxelpipe::solid_options how;
    how.closing = request_.solid->closing;
    (void)flood_->begin(how);
}

void slab_passes::keep_borders() {
    if (kept_ == nullptr) return;
    const glm::ivec3 extent = request_.grid.extent;
    const int closing = request_.solid->closing;
    for (std::size_t s = 0; s < slabs_.size(); ++s) {
        if (kept("borders", s)) continue;
        const slabs::layer_range own = slabs::slab_exterior::layers_of(extent, closing, flooded_for(s));
        found_.clear();
        for (const int z : {own.begin - 1, own.end})
            flood_->exterior()->visit_outside({z, z + 1}, [&](int, const std::uint64_t* bits) {
                append(found_, std::span(bits, slabs::slab_exterior::layer_words(extent, closing)));
            });
        keep("borders", s, found_);
    }
}

bool slab_passes::has_borders(std::size_t slab) const {
    const auto [first, last] = walls_for(slab);
    for (std::size_t s = first; s <= last; ++s)
        if (!kept(name_of(slab_pass::walls), s)) return false;
    return kept("borders", slab).has_value();
}

void slab_passes::flood_slab(std::size_t slab) {
    const slabs::layer_range layers = flooded_for(slab);
    begin_flood(layers);
    const auto [first, last] = walls_for(slab);
    for (std::size_t s = first; s <= last; ++s)
        if (!take(slab_pass::walls, s)) lose();
    const std::optional<bytes> borders = kept("borders", slab);
    if (!borders) lose();
    const std::size_t words = slabs::slab_exterior::layer_words(request_.grid.extent, request_.solid->closing);
    std::span<const std::byte> rest(*borders);
    if (layers.begin > 0) (void)flood_->exterior()->take_reached(0, take_front<std::uint64_t>(rest, words));
    if (layers.end < request_.grid.extent.z)
        (void)flood_->exterior()->take_reached(1, take_front<std::uint64_t>(rest, words));
    flood_->flood();
    flooded_ = slab;
}

void slab_passes::lose() const {
    throw write_error(kept_->folder(), "what passes over its slabs have found is gone; run the command again");
}

} // namespace voxelize
