// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Triangles on their way to slabs. A record is a triangle by itself: positions and varyings as the vertex shader gave
// them, and its number in the whole mesh. A bin is a list of records that only grows; beyond a budget its records go to
// a temporary file, on threads of their own, while more records come.

#include <voxelpipe/slabs/temporary_file.hpp>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <iterator>
#include <memory>
#include <mutex>
#include <new>
#include <span>
#include <string>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// A temporary file without a name: it is gone when the object is, or the process. Its bytes are written by any threads,
// in any order; readers wait for those that are on their way. Members throw std::system_error, such as for a full disk.
class scratch_file {
public:
    // A new, empty file in a folder that is there.
    explicit scratch_file(const std::string& folder) : file_(folder) {}

    // Room for bytes at the end, for one write(); returns where. By one thread at a time.
    [[nodiscard]] std::uint64_t extend(std::uint64_t bytes) {
        coming_.fetch_add(1);
        return std::exchange(size_, size_ + bytes);
    }
    // Fills room that extend() gave, with the bytes of arrays. By any thread; never throws, readers do.
    template <class Parts>
    void write(std::uint64_t offset, const Parts& parts) noexcept {
        for (const auto& part : parts) {
            auto bytes = std::as_bytes(std::span<const typename Parts::value_type::value_type>(part));
            while (!bytes.empty()) {
                const std::int64_t n = file_.write_some(bytes.data(), bytes.size(), offset);
                if (n < 0 && errno == EINTR) continue;
                if (n <= 0) error_ = n < 0 && errno != 0 ? errno : EIO;
                if (n <= 0) break;
                offset += static_cast<std::uint64_t>(n);
                bytes = bytes.subspan(static_cast<std::size_t>(n));
            }
        }
        coming_.fetch_sub(1);
        coming_.notify_all();
    }
    // Fills `bytes` from the file's bytes at `offset` on; room for all of them has been made.
    void read(std::uint64_t offset, std::span<std::byte> bytes) const {
        for (int n = coming_.load(); n != 0; n = coming_.load()) coming_.wait(n);
        check();
        while (!bytes.empty()) {
            const std::int64_t n = file_.read_some(bytes.data(), bytes.size(), offset);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) fail_temporary_file(n < 0 ? errno : EIO, "cannot read a temporary file");
            offset += static_cast<std::uint64_t>(n);
            bytes = bytes.subspan(static_cast<std::size_t>(n));
        }
    }
    // Throws what went wrong with writing so far.
    void check() const {
        if (const int e = error_.load(); e != 0) fail_temporary_file(e, "cannot write a temporary file");
    }

private:
    temporary_file file_;
    std::uint64_t size_ = 0;
    std::atomic<int> coming_ = 0; // writes that have room and have not ended
    std::atomic<int> error_ = 0;  // of a write
};

// Records that leave the memory of a bin, and where they go.
template <class Record>
struct spilled_records {
    std::shared_ptr<scratch_file> file;      // shared with the bin that gave the records away
    std::uint64_t offset = 0, memory = 0;    // bytes: where in the file, and what the blocks take
    std::vector<std::vector<Record>> blocks; // in order

    // To the file; see scratch_file::write.
    void write() const noexcept { file->write(offset, blocks); }
};

// Records in the order in which they came. Those in a file precede those in memory.
template <class Record>
class bin {
    static_assert(std::is_trivially_copyable_v<Record>, "voxelpipe: varyings must be trivially copyable");

public:
    [[nodiscard]] std::uint64_t size() const { return in_file() + in_memory(); }
    // Records in the file.
    [[nodiscard]] std::uint64_t in_file() const { return pieces_.empty() ? 0 : pieces_.back().end; }
    // Records in memory.
    [[nodiscard]] std::uint64_t in_memory() const { return in_memory_; }
    // Bytes that records in memory take, with those that are reserved.
    [[nodiscard]] std::uint64_t memory_bytes() const { return blocks_.size() * block_ * sizeof(Record); }

    // Appends. block: records that memory is taken for at a time, always the same. Returns the bytes of memory taken.
    std::uint64_t push(std::span<const Record> records, std::size_t block) {
        const std::uint64_t before = blocks_.size();
        block_ = block;
        in_memory_ += records.size();
        while (!records.empty()) {
            if (blocks_.empty() || blocks_.back().size() == block_) {
                blocks_.emplace_back();
                blocks_.back().reserve(block_);
            }
            const std::size_t n = std::min(records.size(), block_ - blocks_.back().size());
            blocks_.back().insert(blocks_.back().end(), records.begin(),
                                  records.begin() + static_cast<std::ptrdiff_t>(n));
            records = records.subspan(n);
        }
        return (blocks_.size() - before) * block_ * sizeof(Record);
    }
    // Takes the records in memory out, for a file that other bins may have too. All of a bin's go to the first one.
    [[nodiscard]] spilled_records<Record> spill(const std::shared_ptr<scratch_file>& file) {
        if (file_ == nullptr) file_ = file;
        file_->check();
        const std::uint64_t bytes = memory_bytes();
        pieces_.push_back({in_file() + in_memory_, 0});
        const std::uint64_t offset = pieces_.back().offset = file_->extend(in_memory_ * sizeof(Record));
        spilled_records<Record> out{file_, offset, bytes, std::move(blocks_)};
        blocks_.clear();
        in_memory_ = 0;
        join_last_pieces();
        return out;
    }
    // Copies as many records as `to` holds, from `first` on; all of them exist.
    void copy(std::uint64_t first, std::span<Record> to) const {
        auto from = std::upper_bound(pieces_.begin(), pieces_.end(), first,
                                     [](std::uint64_t record, const piece& p) { return record < p.end; });
        for (; from != pieces_.end() && !to.empty(); ++from) {
            const std::uint64_t begin = from == pieces_.begin() ? 0 : std::prev(from)->end;
            const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(to.size(), from->end - first));
            file_->read(from->offset + (first - begin) * sizeof(Record), std::as_writable_bytes(to.first(n)));
            first += n;
            to = to.subspan(n);
        }
        for (first -= in_file(); !to.empty();) {
            const std::vector<Record>& block = blocks_[static_cast<std::size_t>(first / block_)];
            const auto at = static_cast<std::size_t>(first % block_), n = std::min(to.size(), block.size() - at);
            std::copy_n(block.begin() + static_cast<std::ptrdiff_t>(at), n, to.begin());
            first += n;
            to = to.subspan(n);
        }
    }
    // Calls f(std::span<const Record>) with all records, in order.
    template <class F>
    void for_each_block(F&& f) const {
        std::vector<Record> read;
        const std::uint64_t total = in_file(),
                            most = std::max<std::uint64_t>(1, (std::uint64_t{4} << 20) / sizeof(Record));
        for (std::uint64_t first = 0; first < total; first += most) {
            read.resize(static_cast<std::size_t>(std::min(most, total - first)));
            copy(first, std::span<Record>(read));
            f(std::span<const Record>(read));
        }
        for (const auto& b : blocks_) f(std::span<const Record>(b));
    }

private:
    // The records of the file from the end of the piece before on.
    struct piece {
        std::uint64_t end, offset; // records; bytes in the file
    };
    // One of two that follow each other in the file, as they do where no other bin has it.
    void join_last_pieces() {
        const std::size_t n = pieces_.size();
        if (n < 2) return;
        piece& before = pieces_[n - 2];
        const std::uint64_t begin = n < 3 ? 0 : pieces_[n - 3].end;
        if (before.offset + (before.end - begin) * sizeof(Record) != pieces_[n - 1].offset) return;
        before.end = pieces_[n - 1].end;
        pieces_.pop_back();
    }

    std::vector<std::vector<Record>> blocks_; // all full but the last
    std::shared_ptr<scratch_file> file_;      // none, or where records went that have left memory
    std::vector<piece> pieces_;               // these, in order
    std::uint64_t in_memory_ = 0;
    std::size_t block_ = 1;
};

// Keeps the memory of several bins below a budget: beyond three quarters of it, the largest goes to a file. Threads
// write while more records come; these wait once the budget is full of what is on its way. Bins that follow each other
// share a file where there are many: a process may have some thousand open.
template <class Record>
class bin_memory {
public:
    static constexpr std::size_t most_files = 64; // open at a time

    // budget: bytes of all bins' memory. folder: for files, each of which is there as long as a bin has records in it.
    bin_memory(std::uint64_t budget, std::size_t num_bins, std::string folder)
        : budget_(budget), folder_(std::move(folder)), files_(std::clamp<std::size_t>(num_bins, 1, most_files)),
          block_(static_cast<std::size_t>(std::clamp<std::uint64_t>(
              budget / sizeof(Record) / (4 * std::max<std::size_t>(1, num_bins)), 16, 65536))) {}
    bin_memory(const bin_memory&) = delete;
    bin_memory& operator=(const bin_memory&) = delete;
    // What is on its way is written.
    ~bin_memory() {
        {
            const std::lock_guard lock(mutex_);
            ends_ = true;
        }
        comes_.notify_all();
    }

    // Appends to bin i of the bins that share this budget. Throws std::bad_alloc, and std::system_error of files.
    void push(std::vector<bin<Record>>& bins, std::size_t i, const Record& r) {
        if (const std::uint64_t taken = append(bins[i], std::span<const Record>(&r, 1)); taken != 0)
            settle(bins, taken);
    }
    // The same in two parts. First several threads append to different bins, and get the bytes of memory taken.
    [[nodiscard]] std::uint64_t append(bin<Record>& to, std::span<const Record> records) const {
        return to.push(records, block_);
    }
    // Then one accounts for all of them, and brings the bins below the budget.
    void settle(std::vector<bin<Record>>& bins, std::uint64_t taken) {
        held_ += taken;
        while (held_ > budget_ / 4 * 3) {
            auto& largest = *std::max_element(bins.begin(), bins.end(), [](const auto& a, const auto& b) {
                return a.memory_bytes() < b.memory_bytes();
            });
            if (largest.in_memory() == 0) return;
            held_ -= largest.memory_bytes();
            send(largest.spill(file_of(static_cast<std::size_t>(&largest - bins.data()), bins.size())));
        }
    }

private:
    // The file of bin i of `count`.
    [[nodiscard]] std::shared_ptr<scratch_file> file_of(std::size_t i, std::size_t count) {
        std::weak_ptr<scratch_file>& known = files_[i * files_.size() / count];
        std::shared_ptr<scratch_file> file = known.lock();
        if (file == nullptr) known = file = std::make_shared<scratch_file>(folder_);
        return file;
    }
    // To a thread that writes; waits for room.
    void send(spilled_records<Record> records) {
        constexpr std::size_t most_writers = 2;
        if (writers_.size() < most_writers) {
            try {
                writers_.emplace_back([this] { serve(); });
            } catch (const std::system_error&) {
            } catch (const std::bad_alloc&) {
            }
        }
        if (writers_.empty()) return records.write(); // the machine grants no thread
        std::unique_lock lock(mutex_);
        try {
            queue_.emplace_back();
        } catch (const std::bad_alloc&) { // readers wait for what has room in the file
            lock.unlock();
            return records.write();
        }
        on_their_way_ += records.memory;
        queue_.back() = std::move(records);
        comes_.notify_one();
        goes_.wait(lock, [&] { return held_ + on_their_way_ <= budget_ || on_their_way_ == 0; });
    }
    void serve() {
        std::unique_lock lock(mutex_);
        for (;;) {
            comes_.wait(lock, [&] { return ends_ || !queue_.empty(); });
            if (queue_.empty()) return;
            spilled_records<Record> next = std::move(queue_.front());
            queue_.pop_front();
            lock.unlock();
            next.write();
            const std::uint64_t written = next.memory;
            next = {};
            lock.lock();
            on_their_way_ -= written;
            goes_.notify_all();
        }
    }

    std::uint64_t budget_, held_ = 0; // bytes; held by the bins
    std::string folder_;
    std::vector<std::weak_ptr<scratch_file>> files_; // by ranges of bins
    std::size_t block_;
    std::mutex mutex_; // of what follows
    std::condition_variable comes_, goes_;
    std::deque<spilled_records<Record>> queue_;
    std::uint64_t on_their_way_ = 0; // bytes
    bool ends_ = false;
    std::vector<std::jthread> writers_; // last: they end before the rest does
};

} // namespace voxelpipe::slabs
