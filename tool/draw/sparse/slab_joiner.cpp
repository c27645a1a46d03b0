// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "slab_joiner.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace voxelize {

slab_joiner::slab_joiner(std::size_t num_parts, const std::filesystem::path& folder) {
    if (num_parts > 1) file_.emplace(folder);
}

void slab_joiner::add(sparse_volume&& part) {
    constexpr std::size_t block = std::size_t{1} << 20;
    std::vector<window>& windows = values_.emplace_back();
    for (channel& c : part.channels) {
        if (!file_) break;
        const std::span<const std::byte> bytes(c.data.data(), c.data.size());
        for (std::size_t at = 0; at < bytes.size(); at += block)
            file_->append(bytes.subspan(at, std::min(block, bytes.size() - at)));
        windows.push_back({size_, size_ + bytes.size(), 0, {}});
        size_ += bytes.size();
        c.data = channel_bytes();
    }
    parts_.push_back(std::move(part));
}

sparse_volume slab_joiner::finish() {
    if (!file_) return join_slabs(std::move(parts_));
    const std::vector<sparse_volume>& parts = parts_;
    return join_slabs(std::move(parts_),
                      [&](std::size_t part, std::size_t c, std::uint64_t first, std::uint64_t count, std::byte* to) {
                          const channel& like = parts[part].channels[c];
                          const std::size_t size = size_of(like.type) * static_cast<std::size_t>(like.components);
                          read(values_[part][c], first * size, {to, static_cast<std::size_t>(count) * size});
                      });
}

// Values ascend, so what follows is read with them.
void slab_joiner::read(window& from, std::uint64_t offset, std::span<std::byte> to) {
    constexpr std::uint64_t ahead = std::uint64_t{16} << 10;
    const std::uint64_t at = from.begin + offset;
    if (at < from.first || at + to.size() > from.first + from.bytes.size()) {
        from.bytes.resize(static_cast<std::size_t>(std::max<std::uint64_t>(to.size(), std::min(ahead, from.end - at))));
        from.first = at;
        file_->read(at, from.bytes);
    }
    std::memcpy(to.data(), from.bytes.data() + (at - from.first), to.size());
}

} // namespace voxelize
