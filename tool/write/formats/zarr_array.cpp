// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "zarr_array.hpp"

#include "deflate.hpp"
#include "dense_stream.hpp"

#include "model/targets.hpp"

#include <cstring>
#include <libdeflate.h>
#include <new>
#include <utility>
#ifdef VOXELIZE_HAS_ZSTD
#include <zstd.h>
#endif

namespace voxelize {
namespace {

namespace fs = std::filesystem;

// CRC-32C (Castagnoli), reflected; of a shard's index alone, which is short.
std::uint32_t crc32c(std::span<const std::byte> bytes) {
    std::uint32_t crc = ~0u;
    for (const std::byte b : bytes) {
        crc ^= std::to_integer<std::uint32_t>(b);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1u) != 0 ? 0x82f63b78u : 0u);
    }
    return ~crc;
}

std::vector<std::byte> gzip(std::span<const std::byte> bytes, int level) {
    const whole_compressor compressor(level);
    std::vector<std::byte> out(libdeflate_gzip_compress_bound(compressor.get(), bytes.size()));
    out.resize(libdeflate_gzip_compress(compressor.get(), bytes.data(), bytes.size(), out.data(), out.size()));
    return out;
}

#ifdef VOXELIZE_HAS_ZSTD
std::vector<std::byte> zstd(std::span<const std::byte> bytes, int level) {
    std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
    const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
    if (ZSTD_isError(size) != 0) throw std::bad_alloc{}; // the only way to fail, with that much room
    out.resize(size);
    return out;
}
#endif

std::vector<std::byte> packed_chunk(std::span<const std::byte> bytes, const write_options& options) {
#ifdef VOXELIZE_HAS_ZSTD
    if (options.zstd) return zstd(bytes, options.compression);
#endif
    return gzip(bytes, options.compression);
}

constexpr std::uint64_t no_chunk = ~std::uint64_t{0};

} // namespace

array_values::array_values(const channel& c, bool components_are_first)
    : type(c.type), components(c.components), empty(0), components_first(components_are_first && c.components > 1) {
    if (const std::optional<target> known = target_named(c.name);
        known && info_of(*known).type == type && info_of(*known).components == components)
        empty = info_of(*known).empty;
}

std::size_t array_values::voxel_bytes() const {
    return size_of(streamed_type(type, half_floats::keep)) * static_cast<std::size_t>(components);
}

void array_values::clear(std::span<std::byte> voxels) const {
    if (empty == 0) {
        std::fill(voxels.begin(), voxels.end(), std::byte{0});
        return;
    }
    for (std::size_t at = 0; at < voxels.size(); at += 4) std::memcpy(voxels.data() + at, &empty, 4);
}

bool array_values::are_empty(std::span<const std::byte> voxels) const {
    std::array<std::byte, 32> first{}; // no voxel has more bytes
    const std::size_t each = voxel_bytes();
    clear(std::span(first).first(each));
    return std::memcmp(voxels.data(), first.data(), each) == 0 &&
           std::memcmp(voxels.data(), voxels.data() + each, voxels.size() - each) == 0; // each is as the one before
}

array_file::array_file(const array_layout& layout, const array_values& values, fs::path folder,
                       const write_options& options)
    : layout_(layout), values_(values), folder_(std::move(folder)), options_(options),
      index_(2 * static_cast<std::size_t>(array_layout::product(layout.per_shard)), no_chunk) {}

std::vector<std::byte> array_file::pack(std::vector<std::byte> voxels) const {
    if (values_.are_empty(voxels)) return {};
    return options_.compression == 0 ? std::move(voxels) : packed_chunk(voxels, options_);
}

void array_file::add(std::int64_t shard, std::int64_t chunk, std::span<const std::byte> packed) {
    if (packed.empty()) return;
    if (!file_) {
        const zyx at = array_layout::position(shard, layout_.shards);
        fs::path path = folder_ / "c";
        if (values_.components_first) path /= "0";
        for (const std::int64_t n : at) path /= std::to_string(n);
        if (values_.components > 1 && !values_.components_first) path /= "0";
        fs::create_directories(path.parent_path());
        file_.emplace(path);
    }
    index_[2 * static_cast<std::size_t>(chunk)] = file_->tell();
    index_[2 * static_cast<std::size_t>(chunk) + 1] = packed.size();
    file_->write(packed);
}

void array_file::end_shard() {
    if (!file_) return;
    const auto bytes = std::as_bytes(std::span(index_));
    file_->write(bytes);
    file_->write_value(crc32c(bytes));
    file_->commit();
    file_.reset();
    std::fill(index_.begin(), index_.end(), no_chunk);
}

void array_file::finish() const {
    output_file json(folder_ / "zarr.json");
    json.write(description());
    json.commit();
}

std::string array_file::description() const {
    constexpr std::array<std::string_view, 10> types{"bool",  "uint8", "uint16",  "uint32",  "uint64",
                                                     "int32", "int64", "float16", "float32", "float64"};
    const bool is_float = values_.type == scalar::f16 || values_.type == scalar::f32 || values_.type == scalar::f64;
    std::string fill = values_.type == scalar::bit ? "false" : is_float ? "0.0" : "0";
    if (values_.empty != 0) fill = is_float ? "\"NaN\"" : std::to_string(static_cast<std::int32_t>(values_.empty));
    const bool several = values_.components > 1, first = values_.components_first;
    // With the components where the array has them.
    const auto list = [&](const std::string& numbers, const std::string& components) {
        std::string text = numbers;
        if (several) text = first ? components + ", " + text : text + ", " + components;
        return "[" + text + "]";
    };
    const auto sizes = [&](const zyx& n, const zyx& times) {
        std::string text;
        for (std::size_t a = 0; a < 3; ++a) text += (a == 0 ? "" : ", ") + std::to_string(n[a] * times[a]);
        return list(text, std::to_string(values_.components));
    };
    constexpr zyx once{1, 1, 1}, side{chunk_side, chunk_side, chunk_side};
    const std::string little = R"({"name": "bytes", "configuration": {"endian": "little"}})";
    std::string inner;
    if (first) inner = R"({"name": "transpose", "configuration": {"order": [1, 2, 3, 0]}}, )";
    inner += little;
    const std::string level = R"("configuration": {"level": )" + std::to_string(options_.compression);
    if (options_.compression != 0)
        inner += options_.zstd && has_zstd() ? R"(, {"name": "zstd", )" + level + ", \"checksum\": false}}"
                                             : R"(, {"name": "gzip", )" + level + "}}";
    return "{\n  \"zarr_format\": 3,\n  \"node_type\": \"array\",\n  \"shape\": " + sizes(layout_.extent, once) +
           ",\n  \"data_type\": \"" + std::string(types[static_cast<std::size_t>(values_.type)]) +
           "\",\n  \"chunk_grid\": {\"name\": \"regular\", \"configuration\": {\"chunk_shape\": " +
           sizes(layout_.per_shard, side) +
           "}},\n  \"chunk_key_encoding\": {\"name\": \"default\", \"configuration\": {\"separator\": \"/\"}},\n"
           "  \"fill_value\": " +
           fill + ",\n  \"codecs\": [{\"name\": \"sharding_indexed\", \"configuration\": {\n    \"chunk_shape\": " +
           sizes(side, once) + ",\n    \"codecs\": [" + inner + "],\n    \"index_codecs\": [" + little +
           ", {\"name\": \"crc32c\"}],\n    \"index_location\": \"end\"}}],\n  \"dimension_names\": " +
           list(R"("z", "y", "x")", "\"c\"") + ",\n  \"attributes\": {}\n}\n";
}

} // namespace voxelize
