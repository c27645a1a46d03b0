// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "file_system.hpp"

#include "model/model_error.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace voxelize::assimp {

namespace {

class memory_stream : public Assimp::IOStream {
public:
    explicit memory_stream(std::span<const std::byte> bytes) : bytes_{bytes} {}

    std::size_t Read(void* buffer, std::size_t size, std::size_t count) override {
        if (size == 0) return 0;
        count = std::min(count, (bytes_.size() - at_) / size);
        if (count != 0) std::memcpy(buffer, bytes_.data() + at_, count * size);
        at_ += count * size;
        return count;
    }
    std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
    aiReturn Seek(std::size_t offset, aiOrigin origin) override {
        const std::size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
        const std::size_t target = base + offset; // may wrap: a negative offset
        if (target > bytes_.size()) return aiReturn_FAILURE;
        at_ = target;
        return aiReturn_SUCCESS;
    }
    std::size_t Tell() const override { return at_; }
    std::size_t FileSize() const override { return bytes_.size(); }
    void Flush() override {}

private:
    std::span<const std::byte> bytes_;
    std::size_t at_ = 0;
};

} // namespace

Assimp::IOStream* file_system::Open(const char* file, const char* mode) {
    if (mode != nullptr && std::strpbrk(mode, "wa+") != nullptr) return nullptr;
    const auto found = find(file);
    if (!found) return nullptr;
    return new memory_stream(*found);
}

std::optional<std::span<const std::byte>> file_system::find(const std::string& file) const {
    if (file == name_) return bytes_;
    const std::optional<std::filesystem::path> path = local_file(file);
    if (!path) return std::nullopt;
    const auto known = others_.find(*path);
    if (known != others_.end()) return known->second;
    try {
        if (read_file_) return others_.emplace(*path, read_file_(*path, UINT64_MAX)).first->second;
    } catch (const model_error&) {
    }
    others_.emplace(*path, std::nullopt);
    return std::nullopt;
}

} // namespace voxelize::assimp
