// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Render targets and framebuffers: target<T, Blend, Layout> says what a voxel holds and how fragments meet there,
// framebuffer<Backend, Targets...> owns up to 8 of them, framebuffer_view names memory that someone else owns.

#include <voxelpipe/blend.hpp>
#include <voxelpipe/core/change_log.hpp>
#include <voxelpipe/core/layout.hpp>
#include <voxelpipe/status.hpp>

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe {

// T: bit, an integer, half, float, double, a glm vector of 2 to 4 of them, or a trivially copyable struct with
// blend::replace or a blend of your own. One fragment shader output per target, of type T (bool for bit).
template <class T, class Blend, class Layout = layout::linear>
struct target {
    using map = core::storage_map<T, Layout>;
    using value_type = typename map::value;
    using element_type = typename map::element;
    using blend_type = Blend;
    using layout_type = Layout;
    using traits = core::blend_traits<Blend, value_type>;

    static_assert(!std::is_same_v<T, bool>, "voxelpipe: a target of bits is written target<voxelpipe::bit, ...>");
    static_assert(std::is_trivially_copyable_v<value_type>,
                  "voxelpipe: a target's value type must be trivially copyable");
    static_assert(
        traits::available,
        "voxelpipe: this blend mode is not defined for this value type (bitwise blends and count need integers "
        "or bit, add_saturate integers, add_unordered floating types, a user struct its own blend)");
};

// What a voxel holds before the first fragment: a value, or what the memory already has. off: the target takes no part
// (its memory is neither read nor written and may be absent), so that one compiled pipeline serves any subset of
// targets.
enum class load_operation : std::uint8_t { clear, load, off };

// Memory of one target, not owned. `elements` has map::elements(extent) elements.
template <class Target>
struct target_view {
    using map = typename Target::map;
    using value_type = typename Target::value_type;
    using element_type = typename Target::element_type;

    element_type* elements = nullptr;
    glm::ivec3 extent{0};
    load_operation load = load_operation::clear;
    value_type clear_value = Target::traits::identity();

    [[nodiscard]] VOXELPIPE_HD value_type operator()(int x, int y, int z) const {
        return map::load(elements, extent, x, y, z);
    }
    VOXELPIPE_HD
    void store(int x, int y, int z, const value_type& v) const { map::store(elements, extent, x, y, z, v); }
};

template <class... Targets>
struct framebuffer_view {
    static_assert(sizeof...(Targets) >= 1, "voxelpipe: a framebuffer needs at least one render target");
    static_assert(sizeof...(Targets) <= 8, "voxelpipe: a framebuffer takes at most 8 render targets in one pass");
    static constexpr std::size_t num_targets = sizeof...(Targets);

    glm::ivec3 extent{0};
    core::pack<target_view<Targets>...> targets;
    // Where what is drawn is kept account of (framebuffer::track_changes): change_words(extent) words on the backend,
    // zeros before the first call, not written to by anybody but the calls. Null: nowhere.
    std::uint32_t* changes = nullptr;
};

// Words that framebuffer_view::changes has.
[[nodiscard]] inline std::size_t change_words(const glm::ivec3& extent) { return core::change_log::num_words(extent); }

// A copy of a target in host memory, addressed by voxel whatever the layout.
template <class Target>
struct host_target {
    using map = typename Target::map;
    std::vector<typename Target::element_type> elements;
    glm::ivec3 extent{0};
    [[nodiscard]] typename Target::value_type operator()(int x, int y, int z) const {
        return map::load(elements.data(), extent, x, y, z);
    }
};

// Whether a target of this extent can be addressed at all.
template <class Target>
[[nodiscard]] constexpr bool fits_memory(glm::ivec3 extent) {
    if (extent.x <= 0 || extent.y <= 0 || extent.z <= 0) return true;
    const auto round_up = [](int n) { return (static_cast<uint128>(n) + 31) / 32 * 32; };
    const uint128 bytes =
        round_up(extent.x) * round_up(extent.y) * round_up(extent.z) * sizeof(typename Target::value_type);
    return bytes <= static_cast<uint128>(std::numeric_limits<std::ptrdiff_t>::max());
}

// Owns the memory of its targets on `Backend`. The constructor allocates (throws std::bad_alloc, or std::length_error
// where the size cannot be addressed) and does not initialise: the first voxelize clears, unless told to load.
template <class Backend, class... Targets>
class framebuffer {
public:
    using view_type = framebuffer_view<Targets...>;

    // `enabled`: targets that are not start as load_operation::off and get no memory.
    framebuffer(Backend& backend, glm::ivec3 extent,
                std::bitset<sizeof...(Targets)> enabled = ~std::bitset<sizeof...(Targets)>{})
        : view_{extent, {}}, storage_(make_storage(backend, extent, enabled, std::index_sequence_for<Targets...>{})) {
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            auto& t = get<I>(view_.targets);
            t.extent = extent;
            t.elements = get<I>(storage_).data();
            if (!enabled[I]) t.load = load_operation::off;
        });
    }

    [[nodiscard]] glm::ivec3 extent() const { return view_.extent; }
    [[nodiscard]] const view_type& view() const { return view_; }
    operator const view_type&() const { return view_; } // NOLINT(*-explicit-*)

    // From now on calls keep account of where they draw, and one that clears a target to the value of the clear before
    // writes only where something has been drawn since: of floats in 1024^3 some 0.2 GB instead of 4 for a surface.
    // Where most of the grid is drawn into it gains little, or costs a few percent. The results are the same. In
    // exchange the targets' memory is for voxelize alone to write to: who has written to it by other means says so by
    // forget_changes. Takes 64 KB for 1024^3. On cuda_backend it holds for targets of values in rows (layout::linear,
    // layout::planar), of 32 MB or more and up to 32 bytes a value, and for calls that need no tiles; other targets,
    // and what other calls have drawn, are cleared as a whole, and so is all on cpu_backend. A call that clears some
    // targets and not others tracks those that it clears. Throws std::bad_alloc.
    void track_changes(Backend& backend) { forget_changes(backend); }
    // Nothing is known of what the targets hold, as before the first call. Views of before must not be used any more.
    void forget_changes(Backend& backend) {
        const std::vector<std::uint32_t> zeros(change_words(view_.extent));
        changes_ = std::make_unique<buffer<std::uint32_t>>(backend, array_view<const std::uint32_t>(zeros));
        view_.changes = changes_->data();
    }

    // One target of the framebuffer: vp::get<I>(fb).
    template <std::size_t I>
    class reference {
    public:
        using target_type = typename core::pack_element<I, Targets...>::type;
        explicit reference(framebuffer& owner) : owner_(owner) {}

        // Before the next voxelize: every voxel is `value`, which blends like a first fragment's.
        void clear(const typename target_type::value_type& value) {
            auto& t = get<I>(owner_.view_.targets);
            t.load = load_operation::clear;
            t.clear_value = value;
        }
        // Blend onto what the memory holds.
        void load() { get<I>(owner_.view_.targets).load = load_operation::load; }
        // Take no part in the next voxelize.
        void off() { get<I>(owner_.view_.targets).load = load_operation::off; }

        [[nodiscard]] const target_view<target_type>& view() const { return get<I>(owner_.view_.targets); }
        // Raw elements in the target's layout; copies, then waits.
        [[nodiscard]] std::vector<typename target_type::element_type> to_host(Backend& backend) const {
            return get<I>(owner_.storage_).to_host(backend);
        }
        // The same, addressed by voxel.
        [[nodiscard]] host_target<target_type> to_host_target(Backend& backend) const {
            return {to_host(backend), owner_.view_.extent};
        }

    private:
        framebuffer& owner_;
    };

private:
    template <class T>
    using buffer = typename Backend::template buffer<T>;
    using storage = core::pack<buffer<typename Targets::element_type>...>;

    template <std::size_t... I>
    static storage make_storage(Backend& backend, glm::ivec3 extent, std::bitset<sizeof...(Targets)> enabled,
                                std::index_sequence<I...>) {
        const bool valid = extent.x > 0 && extent.y > 0 && extent.z > 0;
        if (valid && !(fits_memory<Targets>(extent) && ...))
            throw std::length_error("voxelpipe::framebuffer: extent has more bytes than can be addressed");
        // A bad extent owns nothing; voxelize reports it.
        return core::make_pack(buffer<typename Targets::element_type>(
            backend, valid && enabled[I] ? Targets::map::elements(extent) : 0)...);
    }

    view_type view_;
    storage storage_;
    std::unique_ptr<buffer<std::uint32_t>> changes_;
};

template <std::size_t I, class Backend, class... Targets>
[[nodiscard]] auto get(framebuffer<Backend, Targets...>& fb) {
    return typename framebuffer<Backend, Targets...>::template reference<I>(fb);
}

} // namespace voxelpipe
