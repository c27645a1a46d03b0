// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// cpu_backend: the pipeline on CPU threads, in plain C++20. Its results define those of every other backend, bit by
// bit, and do not depend on the number of threads.

#include <cpu_ref/abuffer_pass.hpp>
#include <cpu_ref/framebuffer_pass.hpp>
#include <voxelpipe/core/threads.hpp>
#include <voxelpipe/stage_times.hpp>
#include <voxelpipe/voxelize.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <numeric>
#include <thread>
#include <utility>
#include <vector>

namespace voxelpipe {

// Threads may use one backend at the same time, each with its own framebuffer or A-buffer, if `times` is null.
// `progress` then gets reports of all calls.
class cpu_backend {
public:
    static constexpr bool runs_on_host = true;      // its calls may be given memory of the host as it is
    static constexpr bool takes_solid_slabs = true; // its solid calls take solid_options::slab

    // Host memory, uninitialised, aligned to 64 bytes. The constructor throws std::bad_alloc.
    template <class T>
    class buffer {
    public:
        buffer(cpu_backend&, std::uint64_t count) : data_(allocate(count)), count_(core::length_of(count)) {}
        buffer(cpu_backend&, array_view<const T> source) : data_(allocate(source.size())), count_(source.size()) {
            std::copy(source.begin(), source.end(), data_.get());
        }

        // Written out to be host functions, where nvcc compiles them: implicit ones would be both __host__ and
        // __device__.
        buffer(buffer&& other) noexcept : data_(std::move(other.data_)), count_(std::exchange(other.count_, 0)) {}
        buffer& operator=(buffer&& other) noexcept {
            data_ = std::move(other.data_);
            count_ = std::exchange(other.count_, 0);
            return *this;
        }
        ~buffer() {} // NOLINT(*-equals-default)

        [[nodiscard]] T* data() { return data_.get(); }
        [[nodiscard]] const T* data() const { return data_.get(); }
        [[nodiscard]] std::size_t size() const { return count_; }
        [[nodiscard]] backend_view<const T> view() const { return {data_.get(), count_}; } // Refers to the buffer.
        // A copy of all elements.
        [[nodiscard]] std::vector<T> to_host(cpu_backend&) const {
            return std::vector<T>(data_.get(), data_.get() + count_); // braces would list two bools
        }
        // Copies a box of elements. `to` has room for box.count() of them.
        void read_box(cpu_backend&, const core::element_box& box, T* to) const {
            for (std::size_t z = 0; z < box.slices; ++z)
                for (std::size_t y = 0; y < box.rows; ++y, to += box.row)
                    std::copy_n(data_.get() + box.first + z * box.slice_pitch + y * box.row_pitch, box.row, to);
        }

    private:
        static constexpr std::align_val_t alignment{64};
        struct release {
            void operator()(T* p) const { ::operator delete(p, alignment); }
        };
        static T* allocate(std::uint64_t count) {
            static_assert(std::is_trivially_copyable_v<T>,
                          "voxelpipe: what a backend stores must be trivially copyable");
            if (count == 0) return nullptr;
            if (count > std::numeric_limits<std::size_t>::max() / 2 / sizeof(T)) throw std::bad_alloc();
            return static_cast<T*>(::operator new(core::length_of(count) * sizeof(T), alignment));
        }
        std::unique_ptr<T[], release> data_;
        std::size_t count_;
    };

    cpu_backend() = default;
    explicit cpu_backend(unsigned num_threads) : threads(num_threads) {} // num_threads as `threads`.

    unsigned threads = 0;         // 0: as many as the machine has
    stage_times* times = nullptr; // if not null, the time of each stage is added here
    std::function<void(std::uint64_t done, std::uint64_t total)> progress; // called from any thread, one call at a time

    // Copies an array of this backend's memory. Used by bounds().
    template <class T>
    [[nodiscard]] std::vector<std::remove_const_t<T>> read(backend_view<T> from) const {
        return {from.begin(), from.end()};
    }

    // Used by check_indices.
    [[nodiscard]] std::uint32_t max_index(array_view<const glm::uvec3> triangles) const {
        return core::max_index(triangles);
    }

    // Used by voxelize, with validated arguments. Exceptions of a user's shader or progress function pass through.
    template <class Draws, class Output, class Coverage = core::known_coverage<>>
    [[nodiscard]] status run(const Draws& draws, const grid& g, Output& out, const voxelize_options& options,
                             std::uint64_t triangles_in, Coverage = {}) {
        if (!cpu::are_numbered(draws)) return core::failure(status_code::bad_subset);
        return guarded(triangles_in, [&](const cpu::execution& how) {
            auto s = cpu::make_scene(how, draws, g);
            s.arms = core::arms_of(options.rule);
            return Coverage::dispatch(options.rule, [&]<coverage Rule>() { return pass<Rule>(how, s, out, options); });
        });
    }

    // Used by vp::clear, and by voxelize without triangles, with validated arguments.
    template <class... Targets>
    [[nodiscard]] status clear(const framebuffer_view<Targets...>& fb) {
        const cpu::execution how = execution(nullptr);
        const cpu::stopwatch watch(times, &stage_times::clear);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            const auto& t = get<I>(fb.targets);
            if (t.load == load_operation::clear) cpu::clear_target(how, t);
        });
        return {};
    }

    // ---- used by modules (solid/, sparse/, programs/) ---------------------------------------------------------------

    // Calls f(i) for i below `count`, in any order.
    template <class F>
    void for_each(std::uint64_t count, const F& f) const {
        constexpr std::uint64_t block = 1024;
        cpu::parallel_for(execution(nullptr).threads, (count + block - 1) / block, [&](unsigned, std::size_t b) {
            const std::uint64_t last = std::min<std::uint64_t>(count, (b + 1) * block);
            for (std::uint64_t i = b * block; i < last; ++i) f(i);
        });
    }
    // What calls of f(i, add) gave to add(item), for i below `count`, in the order of i. Threads keep items until their
    // number is known.
    template <class Item, class F>
    [[nodiscard]] cpu::collected_items<Item> collect(std::uint64_t count, const F& f) const {
        return {execution(nullptr).threads, count, f};
    }
    // Calls f(number, item) for all of them, and frees them on the way.
    template <class Item, class F>
    void take(cpu::collected_items<Item>&& items, const F& f) const {
        items.take(execution(nullptr).threads, f);
    }
    // offsets[i] becomes the sum of the counts before i. The last count must be 0; returns the total.
    std::uint64_t sum(const buffer<std::uint32_t>& counts, buffer<std::uint64_t>& offsets) const {
        std::exclusive_scan(counts.data(), counts.data() + counts.size(), offsets.data(), std::uint64_t{0});
        return offsets.data()[offsets.size() - 1];
    }
    // Sorts pairs by the lowest `bits` bits of the key, stably.
    void sort_by_key(buffer<std::uint64_t>& keys, buffer<std::uint32_t>& values, int bits) const {
        struct pair {
            std::uint64_t key;
            std::uint32_t value;
        };
        const unsigned workers = execution(nullptr).threads;
        cpu::raw_array<pair> pairs(keys.size());
        for_each(keys.size(), [&](std::uint64_t i) { pairs[i] = {keys.data()[i], values.data()[i]}; });
        cpu::radix_sort(workers, pairs, bits);
        for_each(keys.size(), [&](std::uint64_t i) {
            keys.data()[i] = pairs[i].key;
            values.data()[i] = pairs[i].value;
        });
    }
    // Runs work(), which returns a status. Failed allocations become one.
    template <class Work>
    [[nodiscard]] status guard(const Work& work) {
        return guarded(0, [&](const cpu::execution&) { return work(); });
    }
    // Runs work(execution). Turns failed allocations into a status.
    template <class Work>
    [[nodiscard]] status guarded(std::uint64_t triangles_in, const Work& work) {
        stage at = stage::validate;
        const auto out_of_memory = [&] {
            status failed = core::failure(status_code::out_of_memory, at);
            failed.counts.triangles_in = triangles_in;
            return failed;
        };
        try {
            return work(execution(&at));
        } catch (const std::bad_alloc&) {
            return out_of_memory();
        } catch (const std::length_error&) { // a vector longer than max_size()
            return out_of_memory();
        }
    }

    // How calls of this backend run. at: if not null, where the stage that runs is written.
    [[nodiscard]] cpu::execution execution(stage* at = nullptr) const {
        return {threads != 0 ? threads : std::max(1u, std::thread::hardware_concurrency()), times, &progress, at};
    }

private:
    // True if tile numbers fit 32 bits, which keeps the tile pairs small. A grid with more tiles has 2^47 voxels: more
    // than any framebuffer holds, but an A-buffer may span them.
    static bool has_small_keys(const grid& g) {
        return core::tile_grid(g.extent, cpu::log2_tile_size).count() <= std::uint64_t{1} << 32;
    }
    template <coverage Rule, class Scene, class... Targets>
    status pass(const cpu::execution& how, const Scene& s, const framebuffer_view<Targets...>& fb,
                const voxelize_options& options) {
        if (!has_small_keys(s.where)) return core::failure(status_code::size_overflow);
        return cpu::draw_framebuffer<Rule, std::uint32_t>(how, s, fb, options.count_voxels);
    }
    template <coverage Rule, class Scene, class Payload>
    status pass(const cpu::execution& how, const Scene& s, abuffer<cpu_backend, Payload>& lists,
                const voxelize_options&) {
        return has_small_keys(s.where) ? cpu::draw_abuffer<Rule, std::uint32_t>(how, *this, s, lists)
                                       : cpu::draw_abuffer<Rule, std::uint64_t>(how, *this, s, lists);
    }
};

} // namespace voxelpipe
