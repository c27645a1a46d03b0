// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rows of a solid into render targets. A row belongs to one thread and its bodies come in draw order, so every
// blend is a plain fold; blends that accumulate in their own format keep a row of accumulators. Where all bodies give
// the same values, voxels are counted and folded at the end of the row, words of bits at once.

#include <cpu_ref/framebuffer_pass.hpp>
#include <cpu_ref/solid/solid_rows.hpp>
#include <voxelpipe/core/same_bits.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace voxelpipe::cpu {

// Calls visit(x, winding) for the voxels of a body's row.
template <class Visit>
VOXELPIPE_INLINE void for_each_voxel(const row_of_body& r, Visit&& visit) {
    const winding_span* span = r.spans;
    for (std::size_t i = r.first_word; i <= r.last_word; ++i) {
        for (std::uint32_t word = r.mask[i]; word != 0; word &= word - 1) {
            const int x = static_cast<int>(i) * 32 + std::countr_zero(word);
            while (span->end <= x) ++span;
            visit(x, span->winding);
        }
    }
}

template <class Draw, class... Targets>
class shading_sink final : public row_sink {
public:
    shading_sink(std::span<const Draw> draws, const grid& g, const framebuffer_view<Targets...>& fb)
        : draws_(draws), grid_(g), fb_(fb), touched_((static_cast<std::size_t>(g.extent.x) + 31) / 32) {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target_type = typename core::pack_element<I, Targets...>::type;
            if constexpr (!works_in_place<target_type>)
                if (get<I>(fb.targets).load != load_operation::off)
                    get<I>(sums_) = std::make_unique_for_overwrite<typename target_type::traits::accumulator[]>(
                        static_cast<std::size_t>(g.extent.x));
        });
    }

    void add(const row_of_body& r) override {
        const auto& shader = draws_[r.draw].fragment_shader;
        solid_fragment f{};
        f.voxel = grid_.offset + glm::ivec3(0, r.y, r.z);
        f.draw = r.draw;
        for_each_voxel(r, [&](int x, std::int64_t winding) {
            f.voxel.x = grid_.offset.x + x;
            f.winding = winding;
            const auto out = shader(f);
            if (!out.keep) {
                ++counts_.fragments_discarded;
                return;
            }
            ++counts_.fragments;
            std::uint32_t& word = touched_[static_cast<std::size_t>(x) / 32];
            const bool first = ((word >> (x % 32)) & 1u) == 0;
            word |= 1u << (x % 32);
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using target_type = typename core::pack_element<I, Targets...>::type;
                const auto& t = get<I>(fb_.targets);
                if (t.load == load_operation::off) return;
                if constexpr (works_in_place<target_type>) {
                    blend_in_place(t, x, r.y, r.z, get<I>(out.values));
                } else {
                    auto& sum = get<I>(sums_)[static_cast<std::size_t>(x)];
                    if (first)
                        sum = target_type::traits::begin(t.load == load_operation::clear ? t.clear_value
                                                                                         : t(x, r.y, r.z));
                    target_type::traits::apply(sum, get<I>(out.values));
                }
            });
        });
    }

    void end_row(int y, int z) override {
        for (std::size_t i = 0; i < touched_.size(); ++i) {
            std::uint32_t word = touched_[i];
            if (word == 0) continue;
            touched_[i] = 0;
            counts_.voxels += static_cast<unsigned>(std::popcount(word));
            if constexpr (!all_in_place<Targets...>) {
                for (; word != 0; word &= word - 1) {
                    const int x = static_cast<int>(i) * 32 + std::countr_zero(word);
                    core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                        using target_type = typename core::pack_element<I, Targets...>::type;
                        if constexpr (!works_in_place<target_type>) {
                            const auto& t = get<I>(fb_.targets);
                            if (t.load != load_operation::off)
                                t.store(x, y, z, target_type::traits::end(get<I>(sums_)[static_cast<std::size_t>(x)]));
                        }
                    });
                }
            }
        }
    }

    [[nodiscard]] const counters& counts() const { return counts_; }

private:
    template <class Target>
    using accumulators = std::unique_ptr<typename Target::traits::accumulator[]>;

    std::span<const Draw> draws_;
    const grid& grid_;
    const framebuffer_view<Targets...>& fb_;
    std::vector<std::uint32_t> touched_;        // a bit a voxel: has got a fragment of this row
    core::pack<accumulators<Targets>...> sums_; // a row each, for targets that do not work in place
    counters counts_{};
};

// The values of a constant shader as its targets fold them, and the folders.
template <class Values, class... Targets>
struct folded_values;
template <class... Values, class... Targets>
struct folded_values<core::pack<Values...>, Targets...> {
    using type = core::pack<folded_value<Targets, Values>...>;
    using folders = core::pack<constant_folder<Targets, folded_value<Targets, Values>>...>;
};

template <class Values, class... Targets>
class constant_sink final : public row_sink {
public:
    // `repeats`: a voxel may have several fragments, and some blend's result depends on how many.
    constant_sink(const Values& values, const grid& g, const framebuffer_view<Targets...>& fb, bool repeats)
        : values_(target_values(values, std::index_sequence_for<Targets...>{})), fb_(fb),
          touched_((static_cast<std::size_t>(g.extent.x) + 31) / 32), repeats_(repeats ? touched_.size() * 32 : 0),
          folders_(make_folders(std::index_sequence_for<Targets...>{})) {}

    void add(const row_of_body& r) override {
        for (std::size_t i = r.first_word; i <= r.last_word; ++i) {
            std::uint32_t word = r.mask[i];
            touched_[i] |= word;
            counts_.fragments += static_cast<unsigned>(std::popcount(word));
            if (!repeats_.empty())
                for (; word != 0; word &= word - 1) ++repeats_[i * 32 + static_cast<unsigned>(std::countr_zero(word))];
        }
        first_ = std::min(first_, r.first_word);
        last_ = std::max(last_, r.last_word);
    }

    void end_row(int y, int z) override {
        for (std::size_t i = first_; i <= last_ && i < touched_.size(); ++i) {
            const std::uint32_t word = touched_[i];
            if (word == 0) continue;
            touched_[i] = 0;
            counts_.voxels += static_cast<unsigned>(std::popcount(word));
            std::uint32_t* const repeats = repeats_.empty() ? nullptr : repeats_.data() + i * 32;
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                if (get<I>(fb_.targets).load != load_operation::off)
                    get<I>(folders_).apply(static_cast<int>(i) * 32, y, z, word, repeats);
            });
            if (repeats != nullptr) std::fill(repeats, repeats + 32, 0u);
        }
        first_ = touched_.size();
        last_ = 0;
    }

    [[nodiscard]] const counters& counts() const { return counts_; }

private:
    using folded = folded_values<Values, Targets...>;

    // A count target ignores the value, whatever its type.
    template <class Target, class Value>
    static folded_value<Target, Value> target_value(const Value& value) {
        if constexpr (std::is_same_v<typename Target::blend_type, blend::count>)
            return {};
        else
            return value;
    }
    template <std::size_t... I>
    static auto target_values(const Values& values, std::index_sequence<I...>) {
        return typename folded::type(core::make_pack(target_value<Targets>(get<I>(values))...));
    }
    template <std::size_t... I>
    auto make_folders(std::index_sequence<I...>) const {
        return typename folded::folders(
            core::make_pack(constant_folder<Targets, std::remove_cvref_t<decltype(get<I>(values_))>>(
                get<I>(fb_.targets), get<I>(values_))...));
    }

    typename folded::type values_;
    const framebuffer_view<Targets...>& fb_;
    std::vector<std::uint32_t> touched_;
    std::vector<std::uint32_t> repeats_; // fragments of each voxel of the row; empty where nobody needs them
    typename folded::folders folders_;
    std::size_t first_ = touched_.size(), last_ = 0; // words that may be touched
    counters counts_{};
};

// Adds up what the threads of a sweep have found.
template <class Crossing>
void add_counts(const solid_sweep<Crossing>& sweep, const std::vector<std::unique_ptr<row_scratch>>& scratch,
                solid_counters& counts) {
    for (const auto& s : scratch) {
        counts.open_rows += s->counts.open_rows;
        counts.max_winding = std::max(counts.max_winding, s->counts.max_winding);
    }
    counts.crossings += sweep.num_crossings();
}

// Sweeps all beams; `sinks` has one for each thread that may take part.
template <class Crossing, class Sink>
void sweep_all(const execution& how, const solid_sweep<Crossing>& sweep,
               const std::vector<std::unique_ptr<Sink>>& sinks,
               const std::vector<std::unique_ptr<row_scratch>>& scratch, status& result) {
    {
        const stopwatch watch(how.times, &stage_times::fine_raster);
        progress_meter meter(how, sweep.num_beams());
        parallel_for(how.threads, sweep.num_beams(), [&](unsigned worker, std::size_t b) {
            sweep.sweep(b, *scratch[worker], *sinks[worker]);
            meter.advance();
        });
    }
    add_counts(sweep, scratch, result.solid);
}

// True if all draws that give fragments give the same values.
template <class Draw>
[[nodiscard]] bool has_same_values(std::span<const Draw> draws, bodies body) {
    return body == bodies::call || core::have_same_values(draws);
}

template <class Draw>
using solid_shader_of = decltype(std::declval<const Draw&>().fragment_shader);

// True if the sweep has to find winding numbers for this shader.
template <class Draw>
inline constexpr bool shader_reads_winding = !core::is_constant<solid_shader_of<Draw>>;

template <class Crossing, class Draw, class... Targets>
[[nodiscard]] status draw_solid(const execution& how, const solid_sweep<Crossing>& sweep, std::span<const Draw> draws,
                                const grid& g, const solid_options& options, const framebuffer_view<Targets...>& fb,
                                status result) {
    how.enter(stage::fine_raster);
    const auto workers = std::max<std::size_t>(1, std::min<std::size_t>(how.threads, sweep.num_beams()));
    // All memory is there before the first voxel is written.
    std::vector<std::unique_ptr<row_scratch>> scratch;
    for (std::size_t w = 0; w < workers; ++w) scratch.push_back(sweep.make_scratch());
    const auto run = [&](const auto& make_sink) {
        std::vector<decltype(make_sink())> sinks;
        for (std::size_t w = 0; w < workers; ++w) sinks.push_back(make_sink());
        if (fb.changes != nullptr) core::change_log::forget(fb.changes); // all is cleared, and nothing is marked
        clear_targets(how, fb);
        sweep_all(how, sweep, sinks, scratch, result);
        for (const auto& s : sinks) {
            result.counts.fragments += s->counts().fragments;
            result.counts.fragments_discarded += s->counts().fragments_discarded;
            result.counts.voxels += s->counts().voxels;
        }
    };
    bool drawn = false;
    if constexpr (core::is_constant<solid_shader_of<Draw>>) {
        if (has_same_values(draws, options.bodies)) {
            bool repeats = false;
            core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
                using target_type = typename core::pack_element<I, Targets...>::type;
                if (!target_folds_once<target_type> && get<I>(fb.targets).load != load_operation::off) repeats = true;
            });
            repeats = repeats && options.bodies == bodies::draw;
            using sink = constant_sink<std::remove_cvref_t<decltype(draws[0].fragment_shader.values)>, Targets...>;
            run([&] { return std::make_unique<sink>(draws[0].fragment_shader.values, g, fb, repeats); });
            drawn = true;
        }
    }
    if (!drawn) run([&] { return std::make_unique<shading_sink<Draw, Targets...>>(draws, g, fb); });
    if (!options.count_voxels) result.counts.voxels = 0;
    return result;
}

} // namespace voxelpipe::cpu
