// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "zarr.hpp"

#include "dense_stream.hpp"
#include "progress.hpp"
#include "text.hpp"

#include "../parallel.hpp"
#include "../targets.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <libdeflate.h>
#include <memory>
#include <new>
#include <optional>
#include <system_error>
#ifdef VOXELIZE_HAS_ZSTD
#include <zstd.h>
#endif

namespace voxelize {
namespace {

namespace fs = std::filesystem;
using zyx = std::array<std::int64_t, 3>; // numbers along z, y, x

constexpr std::int64_t chunk_side = 64, most_chunks = 4; // voxels of a chunk, chunks of a shard, along each axis

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
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(level), libdeflate_free_compressor);
    if (!compressor) throw std::bad_alloc{};
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

// How a channel is cut: chunks, in shards of the same number of them along each axis.
struct array_layout {
    zyx extent, shards, per_shard;

    explicit array_layout(const volume& v) {
        for (std::size_t a = 0; a < 3; ++a) {
            extent[a] = v.extent[2 - a];
            const std::int64_t chunks = (extent[a] + chunk_side - 1) / chunk_side;
            per_shard[a] = std::min(chunks, most_chunks);
            shards[a] = (chunks + per_shard[a] - 1) / per_shard[a];
        }
    }
    [[nodiscard]] static std::int64_t product(const zyx& n) { return n[0] * n[1] * n[2]; }
    [[nodiscard]] static zyx position(std::int64_t i, const zyx& n) {
        return {i / (n[1] * n[2]), i / n[2] % n[1], i % n[2]};
    }
    // The first voxel of a chunk: `chunk` counts within `shard`.
    [[nodiscard]] zyx corner(std::int64_t shard, std::int64_t chunk) const {
        const zyx s = position(shard, shards), c = position(chunk, per_shard);
        zyx at{};
        for (std::size_t a = 0; a < 3; ++a) at[a] = (s[a] * per_shard[a] + c[a]) * chunk_side;
        return at;
    }
    [[nodiscard]] bool has(const zyx& corner) const {
        return corner[0] < extent[0] && corner[1] < extent[1] && corner[2] < extent[2];
    }
};

// One channel on its way into its folder.
class array_writer {
public:
    array_writer(const volume& v, const channel& c, const fs::path& folder, const write_options& options)
        : v_(v), c_(c), folder_(folder), options_(options), layout_(v),
          value_bytes_(size_of(streamed_type(c.type, half_floats::keep)) * static_cast<std::size_t>(c.components)) {
        if (const std::optional<target> known = target_named(c.name);
            known && info_of(*known).type == c.type && info_of(*known).components == c.components)
            empty_ = info_of(*known).empty;
        // An empty voxel: the same bits in each component, none of which is wider than 32 where they are not 0.
        empty_value_.resize(value_bytes_);
        if (empty_ != 0)
            for (std::size_t at = 0; at < value_bytes_; at += 4) std::memcpy(empty_value_.data() + at, &empty_, 4);
    }

    [[nodiscard]] std::int64_t num_chunks() const {
        return array_layout::product(layout_.shards) * array_layout::product(layout_.per_shard);
    }
    // Calls advance() after each chunk.
    template <class Advance>
    void write(int threads, const Advance& advance) {
        const std::int64_t each = array_layout::product(layout_.per_shard);
        ordered_for(
            static_cast<std::size_t>(num_chunks()), threads,
            [&](std::size_t n) {
                return chunk_bytes(
                    layout_.corner(static_cast<std::int64_t>(n) / each, static_cast<std::int64_t>(n) % each));
            },
            [&](std::size_t n, const std::vector<std::byte>& bytes) {
                add(static_cast<std::int64_t>(n) / each, bytes);
                if ((static_cast<std::int64_t>(n) + 1) % each == 0) end_shard();
                advance();
            });
        output_file json(folder_ / "zarr.json");
        json.write(description());
        json.commit();
    }

private:
    // A chunk as its shard holds it; nothing if all of its voxels are empty. Beyond the array it is filled up.
    [[nodiscard]] std::vector<std::byte> chunk_bytes(const zyx& corner) const {
        if (!layout_.has(corner)) return {};
        const auto side = static_cast<std::size_t>(chunk_side);
        std::vector<std::byte> raw(side * side * side * value_bytes_), room;
        if (empty_ != 0)
            for (std::size_t at = 0; at < raw.size(); at += value_bytes_)
                std::memcpy(raw.data() + at, empty_value_.data(), value_bytes_);
        const std::vector<std::byte> empty_row(raw.begin(),
                                               raw.begin() + static_cast<std::ptrdiff_t>(side * value_bytes_));
        const auto count = [&](std::size_t a) { return std::min(chunk_side, layout_.extent[a] - corner[a]); };
        const auto row_bytes = static_cast<std::size_t>(count(2)) * value_bytes_;
        bool is_empty = true;
        for (std::int64_t z = 0; z < count(0); ++z)
            for (std::int64_t y = 0; y < count(1); ++y) {
                const auto voxel = static_cast<std::uint64_t>(v_.index(corner[2], corner[1] + y, corner[0] + z));
                const auto row = streamed_piece(v_, c_, half_floats::keep, voxel * value_bytes_, row_bytes, room);
                is_empty = is_empty && std::memcmp(row.data(), empty_row.data(), row_bytes) == 0;
                std::memcpy(raw.data() + static_cast<std::size_t>(z * chunk_side + y) * side * value_bytes_, row.data(),
                            row_bytes);
            }
        if (is_empty) return {};
        return options_.compression == 0 ? raw : packed_chunk(raw, options_);
    }

    void add(std::int64_t shard, const std::vector<std::byte>& bytes) {
        constexpr std::uint64_t none = ~std::uint64_t{0};
        if (bytes.empty()) {
            index_.insert(index_.end(), {none, none});
            return;
        }
        if (!file_) {
            const zyx at = array_layout::position(shard, layout_.shards);
            fs::path path = folder_ / "c" / std::to_string(at[0]) / std::to_string(at[1]) / std::to_string(at[2]);
            if (c_.components > 1) path /= "0";
            fs::create_directories(path.parent_path());
            file_.emplace(path);
        }
        index_.insert(index_.end(), {file_->tell(), bytes.size()});
        file_->write(bytes);
    }
    void end_shard() {
        if (file_) {
            const auto bytes = std::as_bytes(std::span(index_));
            file_->write(bytes);
            file_->write_value(crc32c(bytes));
            file_->commit();
            file_.reset();
        }
        index_.clear();
    }

    [[nodiscard]] std::string description() const {
        constexpr std::array<std::string_view, 10> types{"bool",  "uint8", "uint16",  "uint32",  "uint64",
                                                         "int32", "int64", "float16", "float32", "float64"};
        const bool is_float = c_.type == scalar::f16 || c_.type == scalar::f32 || c_.type == scalar::f64;
        std::string fill = c_.type == scalar::bit ? "false" : is_float ? "0.0" : "0";
        if (empty_ != 0) fill = is_float ? "\"NaN\"" : std::to_string(static_cast<std::int32_t>(empty_));
        const auto list = [&](const zyx& n, const zyx& times) {
            std::string text = "[";
            for (std::size_t a = 0; a < 3; ++a) text += (a == 0 ? "" : ", ") + std::to_string(n[a] * times[a]);
            if (c_.components > 1) text += ", " + std::to_string(c_.components);
            return text + "]";
        };
        constexpr zyx once{1, 1, 1}, side{chunk_side, chunk_side, chunk_side};
        const std::string little = R"({"name": "bytes", "configuration": {"endian": "little"}})";
        std::string inner = little;
        const std::string level = R"("configuration": {"level": )" + std::to_string(options_.compression);
        if (options_.compression != 0)
            inner += options_.zstd && has_zstd() ? R"(, {"name": "zstd", )" + level + ", \"checksum\": false}}"
                                                 : R"(, {"name": "gzip", )" + level + "}}";
        return "{\n  \"zarr_format\": 3,\n  \"node_type\": \"array\",\n  \"shape\": " + list(layout_.extent, once) +
               ",\n  \"data_type\": \"" + std::string(types[static_cast<std::size_t>(c_.type)]) +
               "\",\n  \"chunk_grid\": {\"name\": \"regular\", \"configuration\": {\"chunk_shape\": " +
               list(layout_.per_shard, side) +
               "}},\n  \"chunk_key_encoding\": {\"name\": \"default\", \"configuration\": {\"separator\": \"/\"}},\n"
               "  \"fill_value\": " +
               fill + ",\n  \"codecs\": [{\"name\": \"sharding_indexed\", \"configuration\": {\n    \"chunk_shape\": " +
               list(side, once) + ",\n    \"codecs\": [" + inner + "],\n    \"index_codecs\": [" + little +
               ", {\"name\": \"crc32c\"}],\n    \"index_location\": \"end\"}}],\n  \"dimension_names\": "
               "[\"z\", \"y\", \"x\"" +
               (c_.components > 1 ? ", \"c\"" : "") + "],\n  \"attributes\": {}\n}\n";
    }

    const volume& v_;
    const channel& c_;
    fs::path folder_;
    const write_options& options_;
    array_layout layout_;
    std::size_t value_bytes_;
    std::uint32_t empty_ = 0;
    std::vector<std::byte> empty_value_;
    std::optional<output_file> file_;  // of the current shard, once it has a chunk
    std::vector<std::uint64_t> index_; // of the current shard
};

// A new folder beside the target, removed unless it takes the target's place.
class output_folder {
public:
    explicit output_folder(const fs::path& target) : target_(target) {
        std::error_code error;
        if (fs::exists(target, error) && !fs::exists(target / "zarr.json", error))
            throw write_error(target, "it exists and is no Zarr group");
        for (int n = 0; n < 1000; ++n) {
            part_ = beside(".part", n);
            if (fs::create_directory(part_, error)) return;
            if (error) throw write_error(target, "make a folder: " + error.message());
        }
        throw write_error(target, "make a folder: there are 1000 parts of it");
    }
    output_folder(const output_folder&) = delete;
    output_folder& operator=(const output_folder&) = delete;
    ~output_folder() {
        std::error_code ignored;
        if (!part_.empty()) fs::remove_all(part_, ignored);
    }
    [[nodiscard]] const fs::path& path() const { return part_; }
    void commit() {
        std::error_code error;
        fs::path old;
        if (fs::exists(target_, error)) {
            for (int n = 0; old.empty() || fs::exists(old, error); ++n) old = beside(".old", n);
            fs::rename(target_, old, error);
            if (error) throw write_error(target_, "rename: " + error.message());
        }
        fs::rename(part_, target_, error);
        if (error) throw write_error(target_, "rename: " + error.message());
        part_.clear();
        if (!old.empty()) fs::remove_all(old, error);
    }

private:
    [[nodiscard]] fs::path beside(const char* what, int n) const {
        return target_.parent_path() / (target_.filename().string() + what + std::to_string(n));
    }
    fs::path target_, part_;
};

std::string group_description(const volume& v) {
    const auto list = [](const auto& values) {
        std::string text;
        for (const auto value : values) text += (text.empty() ? "" : ", ") + number(static_cast<double>(value));
        return '[' + text + ']';
    };
    return "{\n  \"zarr_format\": 3,\n  \"node_type\": \"group\",\n  \"attributes\": {\"voxelpipe\": {\"origin\": " +
           list(v.origin) + ", \"voxel_size\": " + list(v.voxel_size) + "}}\n}\n";
}

} // namespace

bool has_zstd() {
#ifdef VOXELIZE_HAS_ZSTD
    return true;
#else
    return false;
#endif
}

std::vector<fs::path> write_zarr(const volume& v, const fs::path& path, const write_options& options) {
    fs::path target = path;
    if (target.filename().empty()) target = target.parent_path(); // "out.zarr/"
    std::error_code ignored;
    if (fs::is_symlink(target, ignored)) target = fs::weakly_canonical(target, ignored); // kept, as by other writers
    output_folder folder(target);
    try {
        std::vector<std::unique_ptr<array_writer>> arrays;
        std::uint64_t chunks = 0;
        for (const channel& c : v.channels) {
            fs::create_directory(folder.path() / c.name);
            arrays.push_back(std::make_unique<array_writer>(v, c, folder.path() / c.name, options));
            chunks += static_cast<std::uint64_t>(arrays.back()->num_chunks());
        }
        progress_meter meter(options.progress, chunks);
        for (const auto& array : arrays) array->write(thread_count(options.threads), [&] { meter.advance(1); });
        output_file json(folder.path() / "zarr.json");
        json.write(group_description(v));
        json.commit();
    } catch (const fs::filesystem_error& error) {
        throw write_error(target, error.code().message());
    }
    folder.commit();
    return {target};
}

} // namespace voxelize
