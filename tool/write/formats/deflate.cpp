// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "deflate.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <cstring>
#include <libdeflate.h>
#include <new>
#include <zlib.h>

namespace voxelize {
namespace {

std::uint32_t crc_of(std::span<const std::byte> bytes) { return libdeflate_crc32(0, bytes.data(), bytes.size()); }

// Raw deflate without a last block, by zlib: libdeflate cannot leave a stream open.
void deflate_open(std::span<const std::byte> piece, int level, std::vector<std::byte>& out) {
    z_stream stream{};
    constexpr int raw_window = -15;
    if (deflateInit2(&stream, level, Z_DEFLATED, raw_window, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc{};
    out.resize(deflateBound(&stream, static_cast<uLong>(piece.size())) + 16);
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(piece.data()));
    stream.avail_in = static_cast<uInt>(piece.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    deflate(&stream, Z_SYNC_FLUSH); // all of it: there is room
    out.resize(out.size() - stream.avail_out);
    out.shrink_to_fit(); // pieces wait to be written
    deflateEnd(&stream);
}

// A zlib stream. On voxels zlib's fastest levels take half the time of libdeflate's, which search more.
void deflate_whole(std::span<const std::byte> piece, int level, std::vector<std::byte>& out) {
    uLongf size = compressBound(static_cast<uLong>(piece.size()));
    out.resize(size);
    if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(piece.data()),
                  static_cast<uLong>(piece.size()), level) != Z_OK)
        throw std::bad_alloc{};
    out.resize(size);
    out.shrink_to_fit();
}

bool repeats(std::span<const std::byte> piece, std::size_t period) {
    return piece.size() > 2 * period && std::memcmp(piece.data(), piece.data() + period, piece.size() - period) == 0;
}

} // namespace

void whole_compressor::release::operator()(libdeflate_compressor* compressor) const noexcept {
    libdeflate_free_compressor(compressor);
}

whole_compressor::whole_compressor(int level) : held_(libdeflate_alloc_compressor(level)) {
    if (!held_) throw std::bad_alloc{};
}

compressed_piece piece_compressor::compress_now(std::span<const std::byte> piece) const {
    compressed_piece result;
    result.source_size = piece.size();
    result.crc = crc_of(piece);
    if (form_ == form::zlib)
        deflate_whole(piece, level_, result.bytes);
    else
        deflate_open(piece, level_, result.bytes);
    return result;
}

std::shared_ptr<const compressed_piece> piece_compressor::compress(std::span<const std::byte> piece,
                                                                   std::size_t period) {
    if (!repeats(piece, period)) return std::make_shared<const compressed_piece>(compress_now(piece));
    std::string key(reinterpret_cast<const char*>(piece.data()), period);
    key += ' ' + std::to_string(piece.size());
    {
        const std::lock_guard lock(mutex_);
        if (const auto found = repeated_.find(key); found != repeated_.end()) return found->second;
    }
    auto made = std::make_shared<const compressed_piece>(compress_now(piece));
    const std::lock_guard lock(mutex_);
    constexpr std::size_t most = 64; // values; there are few that fill whole pieces
    if (repeated_.size() < most) repeated_.emplace(std::move(key), made);
    return made;
}

void running_crc::add(const compressed_piece& piece) {
    crc = static_cast<std::uint32_t>(crc32_combine(crc, piece.crc, static_cast<z_off_t>(piece.source_size)));
    size += piece.source_size;
}

void compress_channel(const volume& v, const channel& c, half_floats halves, std::span<const std::byte> head,
                      std::size_t piece_bytes, int threads, piece_compressor& compressor,
                      const std::function<void(const compressed_piece&)>& use) {
    const std::uint64_t total = streamed_bytes(v, c, halves);
    const std::size_t period = size_of(streamed_type(c.type, halves)) * static_cast<std::size_t>(c.components);
    const std::size_t first = head.empty() ? 0 : 1;
    const auto count = static_cast<std::size_t>((total + piece_bytes - 1) / piece_bytes);
    ordered_for(
        first + count, thread_count(threads),
        [&](std::size_t n) {
            if (n < first) return compressor.compress(head, head.size());
            const std::uint64_t begin = std::uint64_t{n - first} * piece_bytes;
            const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(piece_bytes, total - begin));
            std::vector<std::byte> room;
            return compressor.compress(streamed_piece(v, c, halves, begin, size, room), period);
        },
        [&](std::size_t, const std::shared_ptr<const compressed_piece>& piece) { use(*piece); });
}

} // namespace voxelize
