// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "scratch_bytes.hpp"

#include "model_error.hpp"

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <system_error>
#include <utility>

namespace voxelize {

template <class Work>
auto scratch_bytes::named(const Work& work) const {
    try {
        return work();
    } catch (const std::system_error& error) {
        throw write_error(folder_, std::string("temporary files for ") + what_ + ": " + error.code().message());
    }
}

scratch_bytes::scratch_bytes(std::filesystem::path folder, const char* what)
    : folder_(std::move(folder)), what_(what),
      file_(named([this] { return voxelpipe::slabs::scratch_file(folder_.string()); })) {}

void scratch_bytes::append(std::span<const std::byte> bytes) {
    constexpr std::size_t block = std::size_t{1} << 20;
    pending_.insert(pending_.end(), bytes.begin(), bytes.end());
    if (pending_.size() >= block) flush();
}

void scratch_bytes::read(std::uint64_t offset, std::span<char> bytes) {
    flush();
    named([&] { file_.read(offset, std::as_writable_bytes(bytes)); });
}

void scratch_bytes::replace(std::uint64_t offset, std::span<const std::byte> bytes) {
    flush();
    (void)file_.extend(0); // each write has room of its own
    const std::array<std::span<const std::byte>, 1> parts{bytes};
    file_.write(offset, parts);
    named([&] { file_.check(); });
}

void scratch_bytes::flush() {
    if (pending_.empty()) return;
    const std::array<std::span<const std::byte>, 1> parts{pending_};
    file_.write(file_.extend(pending_.size()), parts);
    named([&] { file_.check(); });
    pending_.clear();
}

} // namespace voxelize
