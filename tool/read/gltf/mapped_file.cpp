// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "mapped_file.hpp"

#include "resources.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace voxelize::gltf {

mapped_file::mapped_file(const std::filesystem::path& file, std::uint64_t max_bytes) {
    size_ = checked_file_size(file, max_bytes);
    if (size_ == 0) return;
    const auto fail = [] { throw gltf_error("cannot be read: " + std::generic_category().message(errno)); };
    const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) fail();
    data_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
    const int reason = errno;
    close(descriptor); // the mapping stays
    errno = reason;
    if (data_ == MAP_FAILED) fail();
}

mapped_file::~mapped_file() {
    if (data_ != nullptr) munmap(data_, size_);
}

} // namespace voxelize::gltf
