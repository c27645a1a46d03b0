// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "file_system.hpp"

#include "model/model_error.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace voxelize::assimp {

namespace {

class memory_stream : public Assimp::IOStream {
public:
    // ends_line: a line's end follows the bytes.
    memory_stream(std::span<const std::byte> bytes, bool ends_line)
        : bytes_{bytes}, size_{bytes.size() + (ends_line ? 1 : 0)} {}

    std::size_t Read(void* buffer, std::size_t size, std::size_t count) override {
        if (size == 0) return 0;
        count = std::min(count, (size_ - at_) / size);
        const std::size_t end = at_ + count * size, last = std::min(end, bytes_.size());
        if (last > at_) std::memcpy(buffer, bytes_.data() + at_, last - at_);
        if (end > std::max(last, at_)) static_cast<char*>(buffer)[end - at_ - 1] = '\n';
        at_ = end;
        return count;
    }
    std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
    aiReturn Seek(std::size_t offset, aiOrigin origin) override {
        const std::size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : size_;
        const std::size_t target = base + offset; // may wrap: a negative offset
        if (target > size_) return aiReturn_FAILURE;
        at_ = target;
        return aiReturn_SUCCESS;
    }
    std::size_t Tell() const override { return at_; }
    std::size_t FileSize() const override { return size_; }
    void Flush() override {}

private:
    std::span<const std::byte> bytes_;
    std::size_t size_;
    std::size_t at_ = 0;
};

} // namespace

Assimp::IOStream* file_system::Open(const char* file, const char* mode) {
    if (mode != nullptr && std::strpbrk(mode, "wa+") != nullptr) return nullptr;
    const auto found = is_library(file) ? find_libraries(file) : find(file);
    if (!found) return nullptr;
    // assimp drops the last line of an OBJ of more than 16 MiB if it has no end.
    const bool lacks_end = !found->empty() && found->back() != std::byte{'\n'};
    return new memory_stream(*found, file == name_ && lower_extension(name_) == ".obj" && lacks_end);
}

std::optional<std::span<const std::byte>> file_system::find_libraries(const std::string& names) {
    const bool asks_for_stand_in =
        names == std::filesystem::path(name_).replace_extension("mtl").string() && !model_names(names);
    std::vector<std::byte> joined;
    std::size_t read = 0;
    for (const std::string& name :
         material_libraries(names, [&](const auto& each) { return find(each).has_value(); })) {
        const auto bytes = find(name);
        if (bytes) {
            ++read;
            joined.insert(joined.end(), bytes->begin(), bytes->end());
            joined.push_back(std::byte{'\n'});
        } else if (!asks_for_stand_in && std::find(missing_.begin(), missing_.end(), name) == missing_.end()) {
            missing_.push_back(name);
        }
    }
    if (read == 0) return std::nullopt;
    if (asks_for_stand_in) stand_in_ = names;
    add_materials(joined);
    return libraries_.emplace_back(std::move(joined));
}

bool file_system::model_names(const std::string& libraries) const {
    constexpr std::string_view blank = " \t\r", key = "mtllib";
    const std::string_view text{reinterpret_cast<const char*>(bytes_.data()), bytes_.size()};
    for (std::size_t at = text.find(key); at != std::string_view::npos; at = text.find(key, at + key.size())) {
        std::string_view rest = text.substr(at + key.size());
        rest = rest.substr(0, rest.find('\n'));
        rest.remove_prefix(std::min(rest.find_first_not_of(blank), rest.size()));
        if (rest.substr(0, rest.find_last_not_of(blank) + 1) == libraries) return true;
    }
    return false;
}

void file_system::add_materials(std::span<const std::byte> library) {
    constexpr std::string_view blank = " \t\r", key = "newmtl";
    std::string_view text{reinterpret_cast<const char*>(library.data()), library.size()};
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
        if (!line.starts_with(key)) continue;
        line.remove_prefix(key.size());
        line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
        materials_.emplace(line.substr(0, line.find_last_not_of(blank) + 1));
    }
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
