// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace thrust {
template <class T>
class counting_iterator {
public:
    explicit counting_iterator(T first) : first_(first) {}
    template <class N>
    [[nodiscard]] T operator[](N i) const {
        return first_ + static_cast<T>(i);
    }

private:
    T first_;
};
} // namespace thrust
