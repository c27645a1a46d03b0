// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Compression on all threads. Data are cut into pieces that do not look back at each other, so that they can be
// compressed at the same time and one after the other still are one deflate stream; what a file holds does not depend
// on the number of threads. Pieces of one repeated value, of which voxels have many, are compressed once.

#include "dense_stream.hpp"
#include "output_file.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

struct libdeflate_compressor;

namespace voxelize {

// A compressor of libdeflate, for what is compressed at once.
class whole_compressor {
public:
    // LEVEL: 0 to 12. Throws std::bad_alloc.
    explicit whole_compressor(int level);
    [[nodiscard]] libdeflate_compressor* get() const { return held_.get(); }

private:
    struct release {
        void operator()(libdeflate_compressor* compressor) const noexcept;
    };
    std::unique_ptr<libdeflate_compressor, release> held_;
};

// One piece, compressed.
struct compressed_piece {
    std::vector<std::byte> bytes;
    std::uint32_t crc = 0;       // CRC-32 of what was compressed
    std::size_t source_size = 0; // bytes that were compressed
};

// Compresses pieces at a level of 1 to 9; may be used by several threads at once.
class piece_compressor {
public:
    enum class form {
        stream_part, // raw deflate, ended at a byte by an empty stored block: part of a stream, which deflate_end ends
        zlib         // a whole zlib stream
    };

    piece_compressor(form f, int level) : form_(f), level_(level) {}

    // `period`: bytes of the value that is repeated where nothing else is; only a hint.
    [[nodiscard]] std::shared_ptr<const compressed_piece> compress(std::span<const std::byte> piece,
                                                                   std::size_t period);

private:
    [[nodiscard]] compressed_piece compress_now(std::span<const std::byte> piece) const;

    form form_;
    int level_;
    std::mutex mutex_;
    std::map<std::string, std::shared_ptr<const compressed_piece>> repeated_; // by the value and the piece's size
};

// The last two bytes of a stream of stream_part pieces: an empty final block.
inline constexpr std::array<std::byte, 2> deflate_end{std::byte{0x03}, std::byte{0x00}};

// CRC-32 and length of a whole from those of its pieces.
struct running_crc {
    std::uint32_t crc = 0;
    std::uint64_t size = 0;
    void add(const compressed_piece& piece);
};

// Bytes that a thread compresses at once in streams whose readers never see the pieces (.npz, .nrrd, .nii.gz).
inline constexpr std::size_t compressed_piece_bytes = std::size_t{256} << 10;

// Compresses a channel's stream, after `head`, on `threads` threads and hands the pieces over in order, from the
// calling thread. Without `head` all pieces but the last come from `piece_bytes` bytes.
void compress_channel(const volume& v, const channel& c, half_floats halves, std::span<const std::byte> head,
                      std::size_t piece_bytes, int threads, piece_compressor& compressor,
                      const std::function<void(const compressed_piece&)>& use);

} // namespace voxelize
