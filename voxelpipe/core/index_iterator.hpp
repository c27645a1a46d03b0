// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A random-access iterator for ranges that compute their elements by index.

#include <voxelpipe/config.hpp>

#include <compare>
#include <cstddef>
#include <iterator>
#include <type_traits>

namespace voxelpipe::core {

// Yields element(i) of a copy of `element`, which usually refers to an object that must outlive the iterator.
template <class Element>
class index_iterator {
public:
    using value_type = std::invoke_result_t<const Element&, std::size_t>;
    using difference_type = std::ptrdiff_t;
    using iterator_concept = std::random_access_iterator_tag;
    using iterator_category = std::input_iterator_tag; // elements are not references

    index_iterator() = default;
    index_iterator(const Element& element, std::size_t i) : element_(element), i_(i) {}

    value_type operator*() const { return element_(i_); }
    value_type operator[](difference_type n) const { return *(*this + n); }
    index_iterator& operator+=(difference_type n) {
        i_ = static_cast<std::size_t>(static_cast<difference_type>(i_) + n);
        return *this;
    }
    index_iterator& operator-=(difference_type n) { return *this += -n; }
    index_iterator& operator++() { return *this += 1; }
    index_iterator& operator--() { return *this += -1; }
    index_iterator operator++(int) {
        const index_iterator before = *this;
        ++*this;
        return before;
    }
    index_iterator operator--(int) {
        const index_iterator before = *this;
        --*this;
        return before;
    }
    friend index_iterator operator+(index_iterator a, difference_type n) { return a += n; }
    friend index_iterator operator+(difference_type n, index_iterator a) { return a += n; }
    friend index_iterator operator-(index_iterator a, difference_type n) { return a -= n; }
    friend difference_type operator-(const index_iterator& a, const index_iterator& b) {
        return static_cast<difference_type>(a.i_) - static_cast<difference_type>(b.i_);
    }
    friend bool operator==(const index_iterator& a, const index_iterator& b) { return a.i_ == b.i_; }
    friend std::strong_ordering operator<=>(const index_iterator& a, const index_iterator& b) { return a.i_ <=> b.i_; }

private:
    Element element_{};
    std::size_t i_ = 0;
};

} // namespace voxelpipe::core
