// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "batch_manifest.hpp"

#include "model/system.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace voxelize {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

// Now, in UTC, as ISO 8601 with microseconds: later times are greater texts.
std::string now() {
    const auto since = std::chrono::system_clock::now().time_since_epoch();
    const auto micros = std::chrono::duration_cast<std::chrono::microseconds>(since).count();
    const auto seconds = static_cast<std::time_t>(micros / 1000000);
    const std::tm utc = os::utc(seconds);
    std::array<char, 32> date{}, text{};
    std::strftime(date.data(), date.size(), "%Y-%m-%dT%H:%M:%S", &utc);
    std::snprintf(text.data(), text.size(), "%.19s.%06dZ", date.data(), static_cast<int>(micros % 1000000));
    return text.data();
}

} // namespace

manifest::manifest(const fs::path& path) : path_(path) {
    if (path.has_parent_path()) fs::create_directories(path.parent_path());
    file_ = os::open_file(path, os::opening::append_shared);
    if (file_ < 0) fail("open");
    if (os::last_byte(file_).value_or('\n') != '\n') add_text("\n");
}

manifest::~manifest() { os::close_file(file_); }

void manifest::add(json record) const {
    record["time"] = now();
    add_text(record.dump(-1, ' ', false, json::error_handler_t::replace) + '\n');
}

void manifest::add_text(const std::string& text) const {
    if (!os::write_once(file_, text)) fail("write");
}

void manifest::fail(const char* action) const {
    throw std::runtime_error("cannot " + std::string(action) + " '" + path_.string() + "': " + std::strerror(errno));
}

std::vector<fs::path> manifests_in(const fs::path& folder) {
    std::vector<fs::path> paths;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder.empty() ? fs::path(".") : folder, error)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("manifest.") && name.ends_with(".jsonl")) paths.push_back(folder / name);
    }
    return paths;
}

finished_models::finished_models(const fs::path& folder) {
    for (const fs::path& path : manifests_in(folder)) read(path);
}

void finished_models::read(const fs::path& path) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        const json record = json::parse(line, nullptr, false);
        if (!record.is_object() || !record.contains("name") || !record.contains("work")) continue;
        try {
            known_model read;
            read.time = record.value("time", "");
            if (record.value("status", "") == "ok" && record.contains("outputs")) {
                read.input = record.value("input", "");
                read.work = record["work"].get<std::string>();
                for (const json& output : record["outputs"])
                    read.files.emplace_back(output.value("file", ""), output.value("bytes", std::uint64_t{0}));
            }
            known_model& known = works_[record["name"].get<std::string>()];
            if (read.time >= known.time) known = std::move(read);
        } catch (const json::exception&) { // a line that this program has not written
        }
    }
}

bool finished_models::has(const listed_model& model, const std::string& work) const {
    const auto found = works_.find(model.name);
    if (found == works_.end()) return false;
    const known_model& known = found->second;
    if (known.work != work || known.input != model.input.string() || known.files.empty()) return false;
    return std::all_of(known.files.begin(), known.files.end(), [](const auto& file) {
        std::error_code error;
        if (fs::is_directory(file.first, error)) return true;
        return fs::file_size(file.first, error) == file.second && !error;
    });
}

std::unordered_set<std::string> finished_models::files() const {
    std::unordered_set<std::string> all;
    for (const auto& [name, known] : works_)
        for (const auto& [file, bytes] : known.files) all.insert(file);
    return all;
}

} // namespace voxelize
