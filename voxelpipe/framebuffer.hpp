// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Render targets and framebuffers: target<T, Blend, Layout> says what a voxel holds and how fragments are combined,
// framebuffer<Backend, Targets...> owns up to 8 targets, framebuffer_view refers to memory that someone else owns.

#include <voxelpipe/blend.hpp>
#include <voxelpipe/core/change_log.hpp>
#include <voxelpipe/core/layout.hpp>
#include <voxelpipe/host_target.hpp>
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

// T: bit, an integer, half, bfloat16, float, double, a glm vector of 2 to 4 of them, a packed format
// (formats/formats.hpp), or a trivially copyable struct with blend::replace or a user-defined blend. The fragment
// shader has one output per target, of type T (bool for bit); for blend::mean it may be the floats that T is packed
// from.
template <class T, class Blend, class Layout = layout::linear>
struct target {
    using map = core::storage_map<T, Layout>; // where a voxel lies in memory
    using value_type = typename map::value;
    // What memory holds: 32-bit words of bits, components of planar vectors.
    using element_type = typename map::element;
    using blend_type = Blend;                             // how fragments meet
    using layout_type = Layout;                           // the order of voxels in memory
    using traits = core::blend_traits<Blend, value_type>; // identity and order of the blend

    static_assert(!std::is_same_v<T, bool>, "voxelpipe: a target of bits is written target<voxelpipe::bit, ...>");
    static_assert(std::is_trivially_copyable_v<value_type>,
                  "voxelpipe: a target's value type must be trivially copyable");
    static constexpr bool is_own_blend = core::has_blend_member<Blend>; // true for a struct with combine()
    static_assert(core::explain_user_blend<Blend, value_type>());
    static_assert(
        is_own_blend || traits::available,
        "voxelpipe: this blend mode is not defined for this value type (bitwise blends and count need integers "
        "or bit, add_saturate integers or packed formats, add_unordered floating types, mean half, bfloat16, "
        "float or packed formats and the header formats/formats.hpp, a user struct its own blend)");
};

// The value of a voxel before its first fragment. clear: a clear value. load: what the memory holds. off: the target
// takes no part; its memory is neither read nor written and may be absent, so one compiled pipeline serves any subset
// of targets.
enum class load_operation : std::uint8_t { clear, load, off };

// Memory of one target, not owned. `elements` has map::elements(extent) elements.
template <class Target>
struct target_view {
    using map = typename Target::map; // where a voxel lies in memory
    using value_type = typename Target::value_type;
    using element_type = typename Target::element_type; // what memory holds

    element_type* elements = nullptr;                    // in the memory of the backend that draws
    glm::ivec3 extent{0};                                // voxels, as the grid's
    load_operation load = load_operation::clear;         // what a voxel starts from
    value_type clear_value = Target::traits::identity(); // for load_operation::clear

    // (x, y, z) must be in the extent, and the caller must be able to access the memory.
    [[nodiscard]] VOXELPIPE_HD value_type operator()(int x, int y, int z) const {
        VOXELPIPE_EXPECTS(has(x, y, z));
        return map::load(elements, extent, x, y, z);
    }
    // Writes a voxel. (x, y, z) must be in the extent, and the caller must be able to access the memory.
    VOXELPIPE_HD
    void store(int x, int y, int z, const value_type& v) const {
        VOXELPIPE_EXPECTS(has(x, y, z));
        map::store(elements, extent, x, y, z, v);
    }
    // True if there is memory and (x, y, z) is in the extent.
    [[nodiscard]] VOXELPIPE_HD bool has(int x, int y, int z) const {
        return elements != nullptr && x >= 0 && y >= 0 && z >= 0 && x < extent.x && y < extent.y && z < extent.z;
    }
};

// One to eight render targets of one extent, in memory that somebody else owns: what calls draw into.
template <class... Targets>
struct framebuffer_view {
    static_assert(sizeof...(Targets) >= 1, "voxelpipe: a framebuffer needs at least one render target");
    static_assert(sizeof...(Targets) <= 8, "voxelpipe: a framebuffer takes at most 8 render targets in one pass");
    static constexpr std::size_t num_targets = sizeof...(Targets); // render targets

    glm::ivec3 extent{0};                        // voxels, as the grid's
    core::pack<target_view<Targets>...> targets; // get<I>(targets) is target I
    // A view of memory that the caller owns, one pointer per target. The next call clears all of them; a null pointer
    // turns its target off.
    [[nodiscard]] static framebuffer_view on(glm::ivec3 extent, typename Targets::element_type*... elements) {
        const auto view_of = [&]<class Target>(std::type_identity<Target>, typename Target::element_type* p) {
            return target_view<Target>{p, extent, p == nullptr ? load_operation::off : load_operation::clear};
        };
        return {extent, core::make_pack(view_of(std::type_identity<Targets>{}, elements)...)};
    }

    // Log of what is drawn (framebuffer::track_changes): change_words(extent) words on the backend, zero before the
    // first call, written by calls only. Null: no log.
    std::uint32_t* changes = nullptr;
};

// Number of words of framebuffer_view::changes.
[[nodiscard]] inline std::size_t change_words(const glm::ivec3& extent) { return core::change_log::num_words(extent); }

// True if a target of this extent can be addressed.
template <class Target>
[[nodiscard]] constexpr bool fits_memory(glm::ivec3 extent) {
    if (extent.x <= 0 || extent.y <= 0 || extent.z <= 0) return true;
    const auto round_up = [](int n) { return (static_cast<uint128>(n) + 31) / 32 * 32; };
    const uint128 bytes =
        round_up(extent.x) * round_up(extent.y) * round_up(extent.z) * sizeof(typename Target::value_type);
    return bytes <= static_cast<uint128>(std::numeric_limits<std::ptrdiff_t>::max());
}

// Owns the memory of its targets on `Backend`. The constructor allocates and does not initialise: the first voxelize
// clears, unless told to load. Throws std::bad_alloc, or std::length_error if the size cannot be addressed.
template <class Backend, class... Targets>
class framebuffer {
public:
    using view_type = framebuffer_view<Targets...>; // what calls take

    // Targets that are not `enabled` start as load_operation::off and get no memory.
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

    [[nodiscard]] glm::ivec3 extent() const { return view_.extent; } // Voxels, as the grid's.
    [[nodiscard]] const view_type& view() const { return view_; }    // Refers to the framebuffer.
    // Refers to the framebuffer.
    operator const view_type&() const { return view_; } // NOLINT(*-explicit-*)

    // Repeated clears to the same value write only voxels near those drawn since the previous clear: for a surface in
    // 1024^3 floats some 0.2 GB instead of 4. Results are the same. It gains little, or costs a few percent, if most of
    // the grid is drawn into. Only voxelize and clear may write to the targets' memory; call forget_changes after any
    // other write. Takes 64 KB for 1024^3. It holds on cuda_backend for linear and planar targets of at least 32 MB and
    // at most 32 bytes a value, in calls that need no tiles; everything else is cleared as a whole. A call that clears
    // only some targets tracks those. Throws std::bad_alloc.
    void track_changes(Backend& backend) { forget_changes(backend); }
    // Declares that the targets may hold anything, as before the first call. Earlier views become invalid.
    void forget_changes(Backend& backend) {
        const std::vector<std::uint32_t> zeros(change_words(view_.extent));
        changes_ = std::make_unique<buffer<std::uint32_t>>(backend, array_view<const std::uint32_t>(zeros));
        view_.changes = changes_->data();
    }

    // One target of a const framebuffer: vp::get<I>(fb).
    template <std::size_t I>
    class const_reference {
    public:
        using target_type = typename core::pack_element<I, Targets...>::type; // the target's type
        // Refers to the framebuffer.
        explicit const_reference(const framebuffer& owner) : owner_(owner) {}

        // The target's memory, to be read.
        [[nodiscard]] const target_view<target_type>& view() const { return get<I>(owner_.view_.targets); }
        // Copies the raw elements, in the target's layout, and waits. Empty if the framebuffer was made without the
        // target.
        [[nodiscard]] std::vector<typename target_type::element_type> to_host(Backend& backend) const {
            return get<I>(owner_.storage_).to_host(backend);
        }
        // The same into memory of the caller's, which may be page-locked: a program that reads often needs no new
        // pages. Throws std::invalid_argument if `to` has not as many elements as the target.
        void to_host(Backend& backend, array_view<typename target_type::element_type> to) const {
            const auto& from = get<I>(owner_.storage_);
            if (to.size() != from.size())
                throw std::invalid_argument("voxelpipe: memory for another number of elements than the target has");
            // A row of a box has less than 2 GB.
            constexpr std::size_t most = (std::size_t{1} << 28) / sizeof(typename target_type::element_type) + 1;
            for (std::size_t first = 0; first < to.size(); first += most) {
                const std::size_t n = to.size() - first < most ? to.size() - first : most;
                from.read_box(backend, core::element_box{first, n, 1, 1, n, n}, to.data() + first);
            }
        }
        // The same, addressed by voxel.
        [[nodiscard]] host_target<target_type> to_host_target(Backend& backend) const {
            return {to_host(backend), owner_.view_.extent};
        }
        // The part [begin, begin + size), addressed by the voxels of the whole. Copies little more than that, and
        // waits. Throws std::out_of_range if the part is not within the extent.
        [[nodiscard]] host_region<target_type> to_host_region(Backend& backend, glm::ivec3 begin,
                                                              glm::ivec3 size) const {
            const glm::ivec3 extent = owner_.view_.extent;
            for (int a = 0; a < 3; ++a)
                if (begin[a] < 0 || size[a] < 0 || size[a] > extent[a] - begin[a])
                    throw std::out_of_range("voxelpipe: a region to read that is not within the framebuffer");
            const auto& from = get<I>(owner_.storage_);
            if (from.size() == 0 || size.x == 0 || size.y == 0 || size.z == 0) return {};
            host_region<target_type> part(extent, begin, size);
            part.fill(extent, [&](const core::element_box& box, auto* to) { from.read_box(backend, box, to); });
            return part;
        }

    private:
        const framebuffer& owner_;
    };

    // One target of the framebuffer: vp::get<I>(fb).
    template <std::size_t I>
    class reference : public const_reference<I> {
    public:
        using target_type = typename core::pack_element<I, Targets...>::type; // the target's type
        explicit reference(framebuffer& owner) : const_reference<I>(owner), owner_(owner) {}

        // The next voxelize starts every voxel with `value`, which blends like a first fragment's.
        void clear(const typename target_type::value_type& value) {
            auto& t = get<I>(owner_.view_.targets);
            t.load = load_operation::clear;
            t.clear_value = value;
        }
        // The next voxelize blends onto what the memory holds.
        void load() { get<I>(owner_.view_.targets).load = load_operation::load; }
        // The next voxelize ignores this target.
        void off() { get<I>(owner_.view_.targets).load = load_operation::off; }

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
template <std::size_t I, class Backend, class... Targets>
[[nodiscard]] auto get(const framebuffer<Backend, Targets...>& fb) {
    return typename framebuffer<Backend, Targets...>::template const_reference<I>(fb);
}

} // namespace voxelpipe
