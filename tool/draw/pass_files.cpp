// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "pass_files.hpp"

#include "write/formats/output_file.hpp"

#include <zlib.h>

#include <cstdint>
#include <fstream>
#include <system_error>

namespace voxelize {
namespace {

// Precedes the bytes.
struct head {
    std::uint64_t format = 1; // of what passes keep
    std::uint64_t bytes = 0, checksum = 0;
};

std::uint64_t checksum_of(std::span<const std::byte> bytes) {
    return crc32_z(crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
}

} // namespace

std::optional<std::vector<std::byte>> pass_files::read(const std::string& name) const {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path_of(name), error);
    head written{};
    if (error || size < sizeof(written)) return std::nullopt;
    std::ifstream file(path_of(name), std::ios::binary);
    file.read(reinterpret_cast<char*>(&written), sizeof(written));
    if (!file || written.format != head{}.format || written.bytes != size - sizeof(written)) return std::nullopt;
    std::vector<std::byte> bytes(static_cast<std::size_t>(written.bytes));
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!file || written.checksum != checksum_of(bytes)) return std::nullopt;
    return bytes;
}

void pass_files::write(const std::string& name, std::span<const std::byte> bytes) const {
    const head written{.bytes = bytes.size(), .checksum = checksum_of(bytes)};
    output_file file(path_of(name));
    file.write(std::as_bytes(std::span{&written, 1}));
    file.write(bytes);
    file.commit();
}

} // namespace voxelize
