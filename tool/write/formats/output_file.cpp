// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "output_file.hpp"

#include "model/system.hpp"
#include "part.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace voxelize {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t buffer_bytes = std::size_t{1} << 20;

} // namespace

output_file::output_file(const fs::path& target) : target_(target), real_(target) {
    std::error_code error;
    if (is_standard_output(target_)) {
        const int file = os::open_again(1);
        file_ = file < 0 ? nullptr : os::write_stream(file);
        if (file_ == nullptr) fail("open", errno);
        std::setvbuf(file_, nullptr, _IOFBF, buffer_bytes);
        return;
    }
    if (fs::is_symlink(target_, error)) {
        const fs::path resolved = fs::weakly_canonical(target_, error);
        if (!error) real_ = resolved;
    }
    const fs::file_status status = fs::status(real_, error);
    if (fs::is_directory(status)) fail("open", EISDIR);
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        file_ = os::write_stream(real_);
        if (file_ == nullptr) fail("open", errno);
    } else {
        try {
            locked_part part = open_part_file(real_);
            temporary_ = part.path();
            file_ = os::write_stream(part.file());
            if (file_ != nullptr) (void)part.take_file();
        } catch (const std::system_error& failure) {
            fail("open", failure.code().value());
        }
        if (file_ == nullptr) {
            const int reason = errno;
            fs::remove(temporary_, error);
            fail("open", reason);
        }
    }
    std::setvbuf(file_, nullptr, _IOFBF, buffer_bytes);
}

output_file::~output_file() {
    if (!temporary_.empty()) { // before another process can take it
        std::error_code ignored;
        fs::remove(temporary_, ignored);
    }
    if (file_ != nullptr) std::fclose(file_);
    if (lock_ >= 0) os::close_file(lock_);
}

void output_file::fail(std::string_view action, int error) const {
    throw write_error(target_, std::string(action) + ": " + std::generic_category().message(error));
}

void output_file::write(std::span<const std::byte> bytes) {
    if (bytes.empty()) return;
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail("write", errno);
    at_ += bytes.size();
}

void output_file::seek(std::uint64_t at) {
    if (!os::seek_stream(file_, at)) fail("seek", errno);
    at_ = at;
}

void output_file::close() {
    if (file_ == nullptr) return;
    if (!temporary_.empty()) lock_ = os::open_again(os::descriptor_of(file_));
    std::FILE* closing = file_;
    file_ = nullptr;
    if (std::fclose(closing) != 0) fail("write", errno);
}

void output_file::commit() {
    close();
    if (temporary_.empty()) return;
    std::error_code error;
    fs::rename(temporary_, real_, error);
    if (error) fail("rename", error.value());
    temporary_.clear();
    if (lock_ >= 0) os::close_file(std::exchange(lock_, -1));
}

std::vector<fs::path> commit_all(std::span<const std::unique_ptr<output_file>> files) {
    std::vector<fs::path> paths;
    for (const auto& file : files) file->close();
    for (const auto& file : files) {
        file->commit();
        paths.push_back(file->target());
    }
    return paths;
}

bool is_standard_output(const fs::path& path) {
    const std::string whole = path.string();
    return whole.size() > 2 && whole.ends_with(":-") && std::isalnum(static_cast<unsigned char>(whole.front())) != 0 &&
           std::all_of(whole.begin(), whole.end() - 2, // a point as in nii.gz:-
                       [](unsigned char c) { return std::isalnum(c) != 0 || c == '.'; });
}

namespace {

// The extension as it is written; both parts of "a.nii.gz".
std::string whole_extension(const fs::path& path) {
    const auto is = [](const std::string& extension, std::string_view word) {
        return std::equal(extension.begin(), extension.end(), word.begin(), word.end(),
                          [](unsigned char a, char b) { return std::tolower(a) == b; });
    };
    const std::string last = path.extension().string(), before = path.stem().extension().string();
    return is(last, ".gz") && is(before, ".nii") ? before + last : last;
}

} // namespace

std::string lower_extension(const std::filesystem::path& path) {
    const std::string whole = path.string();
    std::string extension = is_standard_output(path) ? '.' + whole.substr(0, whole.size() - 2) : whole_extension(path);
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    if (path.filename().string().find(layer_place) != std::string::npos) extension.insert(0, layer_place);
    return extension;
}

fs::path with_word(const fs::path& path, const std::string& word) {
    if (is_standard_output(path)) throw write_error(path, "standard output holds one file, and this is several");
    const std::string name = path.filename().string(), extension = whole_extension(path);
    return path.parent_path() / (name.substr(0, name.size() - extension.size()) + "." + word + extension);
}

} // namespace voxelize
