// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The manifests of a list of models: each rank appends to its own, and reads those of all.

#include "batch.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace voxelize {

// Lines are appended whole, each with one write: a run that is killed leaves at most one unfinished line. Members throw
// std::runtime_error.
class manifest {
public:
    explicit manifest(const std::filesystem::path& path);
    manifest(const manifest&) = delete;
    manifest& operator=(const manifest&) = delete;
    ~manifest();
    // A line of it, with the time.
    void add(nlohmann::ordered_json record) const;

private:
    void add_text(const std::string& text) const;
    [[noreturn]] void fail(const char* action) const;
    std::filesystem::path path_;
    int file_ = -1;
};

// The manifests of all ranks.
[[nodiscard]] std::vector<std::filesystem::path> manifests_in(const std::filesystem::path& folder);

// The latest record of each name in the manifests of all ranks, if it says ok and its files are there.
class finished_models {
public:
    explicit finished_models(const std::filesystem::path& folder);
    // True if this work was the last on the model's outputs.
    [[nodiscard]] bool has(const listed_model& model, const std::string& work) const;

    // The files of all records, which are this tool's own.
    [[nodiscard]] std::unordered_set<std::string> files() const;

private:
    struct known_model {
        std::string time, input, work; // of another's outputs, or of a failure: no files
        std::vector<std::pair<std::string, std::uint64_t>> files;
    };
    void read(const std::filesystem::path& path);
    std::unordered_map<std::string, known_model> works_;
};

} // namespace voxelize
