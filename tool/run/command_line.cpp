// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "command_line.hpp"

#include "run/options/help.hpp"
#include "run/options/raw_options.hpp"
#include "slab_run.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>

namespace voxelize {

namespace {

struct help_formatter : CLI::Formatter {
    std::string make_usage(const CLI::App*, std::string) const override {
        return "\nUsage: voxelize INPUT -o FILE [-o FILE...] [OPTIONS]\n"
               "       voxelize --list FILE -o \"out/{name}.npy\" [--rank R --world-size W] [--jobs J] [OPTIONS]\n";
    }
};

bool is_number(const std::string& text) {
    double number = 0;
    const char* const end = text.data() + text.size();
    return !text.empty() && std::from_chars(text.data(), end, number).ptr == end;
}

// As the parser understands it: "--stats" may stand before INPUT, since only "json" and "text" are its value, and the
// options that take three numbers take them as one word or as three, negative ones too.
std::vector<std::string> arguments(int argc, const char* const* argv) {
    const std::map<std::string, std::string> points{{"--origin", "--origin"},         {"--extent", "--extent"},
                                                    {"--voxel-size", "--voxel-size"}, {"-s", "--voxel-size"},
                                                    {"--resolution", "--resolution"}, {"-r", "--resolution"}};
    std::vector<std::string> list;
    for (int i = 1; i < argc; ++i) {
        list.emplace_back(argv[i]);
        const std::string next = i + 1 < argc ? argv[i + 1] : "";
        if (list.back() == "--stats") {
            if (next == "json" || next == "text") {
                list.back() += '=' + next;
                ++i;
            } else {
                list.back() += "=text";
            }
        } else if (list.back() == "--close-holes") {
            list.back() += "=all"; // a number stands behind '='
        } else if (const auto point = points.find(list.back()); point != points.end() && !next.empty()) {
            if (i + 3 < argc && is_number(next) && is_number(argv[i + 2]) && is_number(argv[i + 3])) {
                list.back() = point->second + '=' + next + ',' + argv[i + 2] + ',' + argv[i + 3];
                i += 3;
            } else if (next.size() > 1 && next[0] == '-' &&
                       (std::isdigit(static_cast<unsigned char>(next[1])) != 0 || next[1] == '.')) {
                list.back() = point->second + '=' + next;
                ++i;
            }
        }
    }
    std::reverse(list.begin(), list.end()); // as CLI::App::parse wants it
    return list;
}

// OPTION, by its first name, was given TIMES times and takes one value.
std::string why_repeated(const std::string& option, std::size_t times) {
    return option + (times == 2 ? " is given twice" : " is given " + std::to_string(times) + " times") +
           "; it takes one value";
}

// WORDS of the command line are neither options nor their values.
std::string why_unexpected(const std::vector<std::string>& words) {
    const auto option =
        std::find_if(words.begin(), words.end(), [](const std::string& w) { return w.starts_with('-'); });
    if (option != words.end()) return "there is no option " + *option;
    return '"' + words.front() + "\": one INPUT is read; --list FILE reads many";
}

} // namespace

command_line parse_command_line(int argc, const char* const* argv) {
    command_line options;
    raw_options raw;
    CLI::App app{help_introduction, "voxelize"};
    app.formatter(std::make_shared<help_formatter>());
    app.footer(help_footer());
    constexpr int name_column = 28;
    app.get_formatter()->column_width(name_column);
    describe(app, options, raw);
    for (CLI::Option* option : app.get_options())
        option->description(wrapped(option->get_description(), 100 - name_column));
    try {
        app.parse(arguments(argc, argv));
    } catch (const CLI::CallForHelp&) {
        throw early_exit{app.help()};
    } catch (const CLI::CallForVersion& version) {
        throw early_exit{std::string(version.what()) + '\n'};
    } catch (const CLI::ExtrasError&) {
        throw usage_error(why_unexpected(app.remaining()));
    } catch (const CLI::ArgumentMismatch& error) {
        const std::string text = error.what();
        if (text.find(" required ") == std::string::npos) throw usage_error(text);
        const std::string name = text.substr(0, text.find(':'));
        if (text.find("At Most") == std::string::npos) throw usage_error(name + " needs a value");
        throw usage_error(why_repeated(name, app.count(name)));
    } catch (const CLI::ConversionError& error) { // "Could not convert: OPTION = VALUE"
        const std::string text = error.what();
        const std::size_t colon = text.find(": "), equal = text.find(" = ");
        if (colon == std::string::npos || equal == std::string::npos || equal < colon) throw usage_error(text);
        throw usage_error(text.substr(colon + 2, equal - colon - 2) + " does not take \"" + text.substr(equal + 3) +
                          '"');
    } catch (const CLI::ParseError& error) {
        throw usage_error(error.what());
    }
    // Ranges let NaN through.
    if (!std::isfinite(options.load.scale)) throw usage_error("--scale takes a finite number");
    if (!std::isfinite(options.load.gltf.seconds)) throw usage_error("--time takes a finite number of seconds");
    for (const CLI::Option* const option : app.get_options()) {
        const std::string group = option->get_group();
        if (option->count() == 0 || group == "Many models, many processes" || group == "Machine" || group == "Messages")
            continue;
        options.arguments.push_back(option->get_name());
        for (const std::string& value : option->results()) options.arguments.push_back(value);
    }
    if (options.storage != storage_choice::automatic)
        options.arguments.emplace_back(options.storage == storage_choice::sparse ? "--sparse" : "--dense");
    understand_batch(options, app.count("--world-size") != 0, app.count("--rank") != 0);
    understand_solid(options, raw);
    understand_distance(options, raw);
    understand_remesh(options, raw);
    understand_grid(options, raw);
    understand_outputs(options, raw);
    understand_fractions(options, raw);
    understand_picture(options, raw);
    if (options.voxelize.backend == backend_choice::cpu && options.voxelize.strategy != voxelpipe::strategy::automatic)
        throw usage_error("--strategy says how a GPU draws; it does not go with --backend cpu");
    if (options.write.zstd && !has_zstd())
        throw usage_error("--zarr-codec zstd: this program was built without libzstd");
    if (options.voxelize.backend == backend_choice::cpu && options.voxelize.devices != 1)
        throw usage_error("--devices says how many GPUs draw; it does not go with --backend cpu");
    if (const std::string needs = options.by_slabs ? why_not_by_slabs(options) : std::string(); !needs.empty())
        throw usage_error((options.batch.world_size > 1
                               ? std::to_string(options.batch.world_size) +
                                     " processes share one model by slabs (--list shares many models), which needs "
                               : std::string("--resume needs ")) +
                          needs);
    return options;
}

} // namespace voxelize
