// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "scratch_bytes.hpp"

#include "formats/output_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>

namespace voxelize {

scratch_bytes::scratch_bytes(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::string name = folder_.string() + "/voxelize-XXXXXX";
    file_ = ::mkstemp(name.data());
    if (file_ < 0) fail(errno);
    reader_.emplace(name);
    (void)::unlink(name.c_str());
}

scratch_bytes::~scratch_bytes() {
    if (file_ >= 0) ::close(file_);
}

void scratch_bytes::append(std::span<const std::byte> bytes) {
    constexpr std::size_t block = std::size_t{1} << 20;
    pending_.insert(pending_.end(), bytes.begin(), bytes.end());
    if (pending_.size() >= block) flush();
}

model_bytes& scratch_bytes::reader() {
    if (!pending_.empty()) flush();
    return *reader_;
}

void scratch_bytes::flush() {
    std::span<const std::byte> rest = pending_;
    while (!rest.empty()) {
        const ssize_t n = ::write(file_, rest.data(), rest.size());
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) fail(n < 0 ? errno : EIO);
        rest = rest.subspan(static_cast<std::size_t>(n));
    }
    pending_.clear();
}

void scratch_bytes::fail(int error) const {
    throw write_error(folder_, "temporary files for the model: " + std::generic_category().message(error));
}

} // namespace voxelize
