// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "batch.hpp"

#include "batch_manifest.hpp"
#include "batch_workers.hpp"
#include "model/memory.hpp"
#include "model/model_error.hpp"
#include "model/system.hpp"
#include "output_check.hpp"
#include "read/named_files.hpp"
#include "run_model.hpp"
#include "run_outputs.hpp"
#include "write/page/page.hpp"

#include <nlohmann/json.hpp>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace voxelize {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;
using clock = std::chrono::steady_clock;

// Bytes and CRC-32, as of cksum -a crc32b, of a file; of a folder's files by name, with their names.
struct content {
    std::uint64_t bytes = 0;
    std::uint32_t crc = 0;

    void add(const void* data, std::size_t size) {
        crc = static_cast<std::uint32_t>(crc32_z(crc, static_cast<const Bytef*>(data), size));
        bytes += size;
    }
    void add_file(const fs::path& path) {
        std::ifstream file(path, std::ios::binary);
        std::vector<char> block(std::size_t{1} << 20);
        while (file.read(block.data(), static_cast<std::streamsize>(block.size())) || file.gcount() > 0)
            add(block.data(), static_cast<std::size_t>(file.gcount()));
    }
};
content content_of(const fs::path& path) {
    content all;
    if (!fs::is_directory(path)) {
        all.add_file(path);
        return all;
    }
    std::set<fs::path> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path))
        if (entry.is_regular_file()) files.insert(entry.path());
    for (const fs::path& file : files) {
        const std::string name = file.lexically_relative(path).generic_string();
        all.add(name.data(), name.size());
        all.add_file(file);
    }
    return all;
}

const char* name_of(exit_code code) {
    switch (code) {
    case exit_ok:
        return "ok";
    case exit_usage:
        return "bad_grid";
    case exit_input:
        return "bad_model";
    case exit_too_large:
        return "out_of_memory";
    case exit_output:
        return "not_written";
    case exit_backend:
        return "no_backend";
    case exit_internal:
        break;
    }
    return "internal_error";
}

json record_of(const listed_model& model, const std::string& work) {
    return {{"input", model.input.string()}, {"name", model.name}, {"work", work}};
}

// In the process of a model: does the work.
work_done work_on(const command_line& all, const listed_model& model, const std::string& work, output_check* known) {
    const auto begin = clock::now();
    command_line options = all;
    options.input = model.input;
    options.quiet = true;
    run_outcome result;
    json record = record_of(model, work);
    try {
        for (fs::path& output : options.outputs) {
            output = with_name(output, model.name);
            if (output.has_parent_path()) fs::create_directories(output.parent_path());
        }
        const auto jobs = static_cast<std::uint64_t>(all.batch.jobs);
        const std::uint64_t limit = all.max_memory != 0 ? all.max_memory : memory::machine_limit();
        memory::set_limit(limit / jobs, all.max_memory != 0);
        if (options.voxelize.threads == 0)
            options.voxelize.threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency() / jobs));
        options.write.threads = options.voxelize.threads;
        result = run_model(options, begin, known);
        record["outputs"] = json::array();
        for (const fs::path& file : result.report.files) {
            const content c = content_of(file);
            std::array<char, 32> hash{};
            std::snprintf(hash.data(), hash.size(), "crc32:%08x", c.crc);
            record["outputs"].push_back({{"file", file.string()}, {"bytes", c.bytes}, {"hash", hash.data()}});
        }
    } catch (const std::exception& error) {
        result.code = exit_output;
        result.error = error.what();
    }
    record["status"] = result.is_conflict ? name_of(exit_output) : name_of(result.code);
    if (result.code != exit_ok) {
        record.erase("outputs");
        record["error"] = result.error;
    } else {
        const voxelize_stats& stats = result.report.stats;
        record["counts"] = {{"triangles", stats.triangles},
                            {"triangles_dropped", stats.triangles_dropped},
                            {"fragments", stats.fragments},
                            {"voxels", stats.voxels}};
        if (const auto& made = result.report.surface; made && result.report.request.remesh)
            record["counts"] = {{"triangles", stats.triangles},          {"triangles_dropped", stats.triangles_dropped},
                                {"vertices", made->counts.vertices},     {"faces", made->counts.faces},
                                {"components", made->counts.components}, {"euler", made->euler}};
        record["peak_memory_bytes"] = result.report.peak_memory;
    }
    if (!result.report.warnings.empty()) record["warnings"] = result.report.warnings;
    record["ms"] = std::chrono::duration<double, std::milli>(clock::now() - begin).count();
    return {record.dump(-1, ' ', false, json::error_handler_t::replace), result.code};
}

// The order for the process of a model, where that is this program once more: the model, and all models where their
// files have to be compared.
json order_of(const listed_model& model, const std::string& work, const std::vector<listed_model>* all) {
    json order = record_of(model, work);
    if (all == nullptr) return order;
    order["all"] = json::array();
    for (const listed_model& each : *all) order["all"].push_back({each.input.string(), each.name});
    return order;
}

// The models of the list FILE, "-" for standard input. Throws model_error, which names the list and the reason.
std::vector<listed_model> models_of(const fs::path& file) {
    const bool is_stdin = file == "-";
    try {
        if (is_stdin) return read_list(std::cin);
        std::error_code ignored;
        if (fs::is_directory(file, ignored)) throw model_error("it is a folder");
        std::ifstream list(file);
        if (!list.is_open()) throw model_error(std::generic_category().message(errno));
        std::vector<listed_model> models = read_list(list);
        if (list.bad()) throw model_error("reading it fails");
        return models;
    } catch (const model_error& error) {
        throw model_error("cannot read the list " + (is_stdin ? "on standard input" : '\'' + file.string() + '\'') +
                          ": " + error.what());
    }
}

// The page that shows those of the first output of .html side by side. Nothing without such an output.
std::optional<fs::path> page_beside(const command_line& options, const fs::path& folder) {
    for (const fs::path& output : options.outputs)
        if (lower_extension(output) == ".html") return folder / "side_by_side.html";
    return std::nullopt;
}

void write_page_beside(const command_line& options, const std::vector<listed_model>& models, const fs::path& page) {
    const auto pattern = std::find_if(options.outputs.begin(), options.outputs.end(),
                                      [](const fs::path& output) { return lower_extension(output) == ".html"; });
    std::vector<page_link> links;
    links.reserve(models.size());
    for (const listed_model& model : models)
        links.push_back({model.name, with_name(*pattern, model.name).lexically_proximate(page.parent_path())});
    write_pages_beside(links, page);
}

// Compares the files that all models of the list write with those that the run reads. own_manifest: of this rank.
// Throws output_conflict.
output_check check_list(const command_line& options, const std::vector<listed_model>& models, const fs::path& folder,
                        const fs::path& own_manifest, const finished_models& finished) {
    output_check check(options.outputs);
    if (options.batch.list != "-")
        check.add_input(options.batch.list, "the list '" + options.batch.list.string() + "'");
    for (const listed_model& model : models) check.add_input(model.input, "the model '" + model.input.string() + "'");
    for (const fs::path& path : manifests_in(folder))
        if (path != own_manifest) check.add_input(path, "the manifest '" + path.string() + "'");
    check.add_output(own_manifest, {{own_manifest}, {}});
    if (const auto page = page_beside(options, folder)) check.add_output(*page, {{*page}, {}});

    held_as held = held_as::unknown;
    if (options.storage != storage_choice::automatic)
        held = options.storage == storage_choice::sparse ? held_as::list : held_as::grid;
    voxelize_request request = options.voxelize;
    request.grid.extent = glm::ivec3(0);
    const std::unordered_set<std::string> own = finished.files();
    bool has_others =
        false; // files that are there and may be another model's: pictures, or not of a run over this list
    for (const listed_model& model : models)
        for (const fs::path& pattern : options.outputs) {
            const fs::path output = with_name(pattern, model.name);
            const written_names names = names_of_output(options, request, output, held);
            check.add_output(output, names);
            const bool is_picture = lower_extension(output) == ".png";
            for (const fs::path& file : names.files) {
                std::error_code error;
                has_others = has_others || ((is_picture || !own.contains(file.string())) && fs::exists(file, error));
            }
        }
    // The files that models name are looked for only where an output may be one of them.
    if (has_others)
        for (const listed_model& model : models)
            for (const fs::path& file : named_files(model.input)) check.add_named(file, model.input);
    return check;
}

// True where names that only the grid of a model tells, of meshes in several files, are compared once it is known.
bool may_split(const command_line& options) {
    return std::any_of(options.outputs.begin(), options.outputs.end(), [](const fs::path& output) {
        const std::string extension = lower_extension(output);
        return extension == ".obj" || extension == ".ply" || extension == ".glb" || extension == ".stl";
    });
}

fs::path manifest_of(const command_line& options, const fs::path& folder) {
    return folder / ("manifest." + std::to_string(options.batch.rank) + ".jsonl");
}

// In a process that has an order: does the work of it, and prints the record.
int follow(const std::string& text, const command_line& options) {
    const json order = json::parse(text);
    std::vector<listed_model> all;
    if (order.contains("all"))
        for (const json& each : order["all"]) all.push_back({each.at(0).get<std::string>(), each.at(1)});
    std::optional<output_check> known;
    const fs::path folder = manifest_folder(options.outputs.front());
    if (!all.empty()) known = check_list(options, all, folder, manifest_of(options, folder), finished_models(folder));
    const auto [record, code] = work_on(options, {order.at("input").get<std::string>(), order.at("name")},
                                        order.at("work"), known ? &*known : nullptr);
    std::cout << record << std::flush;
    return code;
}

} // namespace

std::string work_of(const command_line& options, const fs::path& model) {
    content arguments;
    for (const std::string& argument : options.arguments) arguments.add(argument.c_str(), argument.size() + 1);
    const auto size_and_time = [](const fs::path& file) {
        std::error_code error;
        const std::uintmax_t size = fs::file_size(file, error);
        const auto time = fs::last_write_time(file, error).time_since_epoch().count();
        std::array<char, 64> text{};
        std::snprintf(text.data(), text.size(), "-%jx-%llx", size, static_cast<unsigned long long>(time));
        return std::string(text.data());
    };
    const auto hex = [](std::uint32_t number) {
        std::array<char, 16> text{};
        std::snprintf(text.data(), text.size(), "%08x", number);
        return std::string(text.data());
    };
    std::string work = hex(arguments.crc) + size_and_time(model);
    content named;
    for (const fs::path& file : named_files(model)) {
        const std::string text = file.string() + size_and_time(file);
        named.add(text.c_str(), text.size() + 1);
    }
    if (named.bytes != 0) work += '-' + hex(named.crc);
    return work;
}

std::vector<listed_model> read_list(std::istream& list) {
    constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF", blank = " \t\r";
    std::vector<listed_model> models;
    std::unordered_set<std::string> stems;
    bool is_first = true;
    for (std::string line; std::getline(list, line);) {
        if (std::exchange(is_first, false)) {
            if (line.starts_with("\xFE\xFF") || line.starts_with("\xFF\xFE"))
                throw model_error("it is text in UTF-16, not UTF-8");
            if (line.starts_with(byte_order_mark)) line.erase(0, byte_order_mark.size());
        }
        const std::size_t start = line.find_first_not_of(blank);
        if (start == std::string::npos || line[start] == '#') continue;
        line = line.substr(start, line.find_last_not_of(blank) + 1 - start);
        models.push_back({line, fs::path(line).stem().string()});
        stems.insert(models.back().name);
    }
    std::unordered_map<std::string, std::uint64_t> times;
    std::unordered_set<std::string> numbered;
    for (listed_model& model : models) {
        std::uint64_t& n = times[model.name];
        if (++n == 1) continue;
        std::string name;
        for (;; ++n) {
            name = model.name + '-' + std::to_string(n);
            if (!stems.contains(name) && numbered.insert(name).second) break;
        }
        model.name = name;
    }
    return models;
}

fs::path with_name(const fs::path& path, const std::string& name) {
    constexpr std::string_view place = "{name}";
    std::string text = path.string();
    for (std::size_t at = text.find(place); at != std::string::npos; at = text.find(place, at + name.size()))
        text.replace(at, place.size(), name);
    return text;
}

fs::path manifest_folder(const fs::path& output) {
    fs::path folder;
    for (const fs::path& part : output.parent_path()) {
        if (part.string().find("{name}") != std::string::npos) break;
        folder /= part;
    }
    return folder;
}

int run_batch(const command_line& options) {
    if (const std::optional<std::string> order = os::worker_order()) return follow(*order, options);
    const std::vector<listed_model> models = models_of(options.batch.list);
    const fs::path folder = manifest_folder(options.outputs.front());
    const fs::path own_manifest = manifest_of(options, folder);
    const finished_models finished(folder);
    std::optional<output_check> known = check_list(options, models, folder, own_manifest, finished);
    if (!may_split(options)) known.reset();
    const manifest records(own_manifest);

    std::size_t mine = 0, skipped = 0, done = 0, failed = 0;
    workers running([&](const listed_model& model,
                        const std::string& work) { return work_on(options, model, work, known ? &*known : nullptr); },
                    [&](const listed_model& model, const std::string& work) {
                        return order_of(model, work, known ? &models : nullptr).dump();
                    });
    const auto wait = [&] {
        for (const workers::ended& end : running.wait()) {
            json record = json::parse(end.record, nullptr, false);
            if (!record.is_object()) {
                record = record_of(end.model, end.work);
                record["status"] = "crashed";
                record["error"] = end.how;
            }
            records.add(record);
            const std::string status = record.value("status", "");
            ++done;
            if (status != "ok") {
                ++failed;
                std::cerr << "voxelize: " << end.model.input.string() << ": " << status << ": "
                          << record.value("error", "") << '\n';
            } else if (!options.quiet) {
                const char* const what = record["counts"].contains("faces") ? "faces" : "voxels";
                std::cout << end.model.name << ": " << record["counts"][what] << ' ' << what << ", "
                          << static_cast<long long>(record["ms"].get<double>()) << " ms\n";
            }
        }
    };
    for (std::size_t i = 0; i < models.size(); ++i) {
        if (i % static_cast<std::size_t>(options.batch.world_size) != static_cast<std::size_t>(options.batch.rank))
            continue;
        ++mine;
        std::string work = work_of(options, models[i].input);
        if (finished.has(models[i], work)) {
            ++skipped;
            continue;
        }
        while (running.size() >= static_cast<std::size_t>(options.batch.jobs)) wait();
        running.start(models[i], std::move(work));
    }
    while (running.size() != 0) wait();
    // The same whoever writes it: it names the pages of every rank.
    if (const auto page = page_beside(options, folder); page && options.batch.rank == 0)
        write_page_beside(options, models, *page);
    if (!options.quiet)
        std::cout << mine << " models: " << done - failed << " done, " << skipped << " were finished, " << failed
                  << " failed\n";
    return failed != 0 ? exit_input : exit_ok;
}

} // namespace voxelize
