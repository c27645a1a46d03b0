// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "command_line.hpp"

#include "exit_code.hpp"

#include <voxelpipe/config.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

namespace voxelize {

namespace {

// "1,2,3" or "1x2x3" -> numbers; LEAST to 3 of them.
template <class Number>
std::vector<Number> parse_list(const std::string& option, const std::string& text, std::size_t least) {
    std::vector<Number> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (true) {
        Number number{};
        const auto [next, error] = std::from_chars(at, end, number);
        bool good = error == std::errc{} && (next == end || *next == ',' || *next == 'x');
        if constexpr (std::is_floating_point_v<Number>) good = good && std::isfinite(number);
        if (!good) break;
        numbers.push_back(number);
        if (next == end) {
            if (numbers.size() < least || (numbers.size() != 1 && numbers.size() != 3)) break;
            return numbers;
        }
        at = next + 1;
    }
    throw usage_error(option + " takes " + (least == 3 ? "three numbers x,y,z" : "one number or three, x,y,z") +
                      ", not \"" + text + '"');
}

glm::dvec3 parse_point(const std::string& option, const std::string& text, std::size_t least) {
    const std::vector<double> n = parse_list<double>(option, text, least);
    return n.size() == 3 ? glm::dvec3(n[0], n[1], n[2]) : glm::dvec3(n[0]);
}

// One member of every entry, with commas between.
template <class List, class Member>
std::string names(const List& list, Member member) {
    std::string text;
    for (const auto& entry : list) {
        if (!text.empty()) text += ", ";
        text += entry.*member;
    }
    return text;
}

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

// "y or z", "weight, cutoff or ignore".
template <class T>
std::string in_words(const std::vector<std::pair<const char*, T>>& choices) {
    std::string text;
    for (std::size_t i = 0; i < choices.size(); ++i)
        text += std::string(i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ") + choices[i].first;
    return text;
}

// An option that takes one of a few words.
template <class T>
struct choice_of {
    using type = T;
};
template <class T>
struct choice_of<std::optional<T>> {
    using type = T;
};
template <class T>
CLI::Option* add_choice(CLI::App& app, const std::string& name, T& value,
                        std::vector<std::pair<const char*, typename choice_of<T>::type>> choices,
                        const std::string& description) {
    const auto take = [&value, name, choices = std::move(choices)](const std::string& text) {
        for (const auto& [word, meaning] : choices) {
            if (lower(text) != word) continue;
            value = meaning;
            return;
        }
        throw usage_error(name + " takes " + in_words(choices) + ", not \"" + text + '"');
    };
    return app.add_option_function<std::string>(name, take, description);
}

// What --help says before the options: each example works as it is printed, on files of those names.
constexpr const char* introduction =
    "Turns a 3D model into voxels: exact coverage, several values a voxel, many file formats.\n"
    "\n"
    "EXAMPLES\n"
    "  voxelize helmet.glb -o helmet.vox -o helmet.png -r 256\n"
    "      coloured voxels, 256 along the longest side, for MagicaVoxel, and a picture of them\n"
    "  voxelize part.glb -o part.npy -s 0.5 --coverage thin\n"
    "      a thin shell of voxels of 0.5 units, as a NumPy array of 0 and 1\n"
    "  voxelize part.glb -o part.npz -t occupancy,normal,material --stats\n"
    "      three arrays in one file, and what it took to compute them\n";

struct help_formatter : CLI::Formatter {
    std::string make_usage(const CLI::App*, std::string) const override {
        return "\nUsage: voxelize INPUT -o FILE [-o FILE...] [OPTIONS]\n";
    }
};

// What --help says after the options.
std::string footer() {
    std::string text = "TARGETS (--target NAME)\n";
    const auto line = [&text](std::string_view name, std::string_view rest) {
        text += "  " + std::string(name) + std::string(name.size() < 16 ? 16 - name.size() : 1, ' ') +
                std::string(rest) + '\n';
    };
    for (const target_info& entry : target_table) {
        std::string type(name_of(entry.type));
        if (entry.components > 1) type += " x " + std::to_string(entry.components);
        line(entry.name,
             type + std::string(type.size() < 9 ? 9 - type.size() : 1, ' ') + std::string(entry.description));
    }
    text += "\nOUTPUTS (by extension; .npy has the shape (nz, ny, nx) or (nz, ny, nx, components))\n";
    for (const format& entry : formats()) line(entry.extension, entry.description);
    text +=
        "\nGRID\n"
        "  -r N            N voxels along the longest side of the model, as few as hold it along the others: 2 x 1 "
        "x 1\n"
        "                  gets 128 x 64 x 64. With --padding P, N - 2 P of them.\n"
        "  -s S            Voxel (i, j, k) spans i S to (i + 1) S, and so on. The grid is the voxels that the "
        "model's box\n"
        "                  spans: 6 of 0.1 for 0.6. A layer that the box only touches is left out, unless "
        "--coverage thin\n"
        "                  needs it: a face in the plane between two voxels lies in the upper one.\n"
        "  --padding P     Nothing is drawn in the P outermost layers.\n"
        "\nSOLIDS\n"
        "  A voxel is inside by the winding number of its centre: how often the surface goes round it. That is exact, "
        "and needs\n"
        "  a closed model: a warning says which share of the rows of voxels shows holes.\n"
        "  nonzero         where it is not 0: parts may overlap, a shell in a shell that faces inward is a cavity\n"
        "  even_odd        where it is odd: overlaps are holes, every shell in a shell is a cavity\n"
        "  positive        where it is more than 0: parts that are inside out are nothing\n"
        "  each_draw       even_odd for every mesh primitive of every node by itself, united\n"
        "  Inside, normal is 0, material and triangle are -1, depth is NaN, count is the number of bodies: 1, with "
        "each_draw\n"
        "  more where they overlap. Alpha masks cut no holes into a solid.\n"
        "\nEXIT CODES\n"
        "  0 done   1 wrong command line   2 the model cannot be used   3 not enough memory\n"
        "  4 an output cannot be written   5 --backend cuda cannot be used   70 a bug of this program\n"
        "  5 is: built without CUDA, no driver, a driver too old, no GPU, or one that there is no code for; too\n"
        "  little memory on the GPU is 3, as on the machine. With --backend auto the CPU does the work instead.\n";
    return text;
}

// Lines of at most WIDTH characters, broken at spaces.
std::string wrapped(const std::string& text, std::size_t width) {
    std::string lines;
    std::size_t column = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find(' ', at), text.size());
        if (column != 0 && column + 1 + end - at > width) {
            lines += '\n';
            column = 0;
        } else if (column != 0) {
            lines += ' ';
            ++column;
        }
        lines += text.substr(at, end - at);
        column += end - at;
        at = end + 1;
    }
    return lines;
}

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

// What the options fill before it is understood.
struct raw_options {
    std::string resolution, origin, voxel_size, extent, image_size, background, fill_color;
    std::optional<solid_rule> solid;
    std::optional<solid_extent> extent_of_solid;
    std::optional<voxelpipe::coverage> coverage;
    std::string close_holes; // "all", or how many edges
    std::optional<int> closing;
    bool vote = false;
    std::vector<std::string> targets;
    bool no_edges = false;
    bool no_ground = false;
    bool no_color = false;
};

void describe(CLI::App& app, command_line& options, raw_options& raw) {
    app.add_option("INPUT", options.input,
                   "Model: glTF 2.0 (.glb, .gltf), or .obj, .stl, .ply, .off and others that assimp reads")
        ->required()
        ->option_text(" ");
    app.add_option("-o,--output", options.outputs, "Write the voxels to FILE (required); one -o for each file")
        ->required()
        ->allow_extra_args(false)
        ->option_text("FILE")
        ->group("Output");
    app.add_option("-t,--target", raw.targets,
                   "What to compute for each voxel, see TARGETS; may be repeated. Default: occupancy, with color where "
                   "an output shows colours (.vox, .schem, .glb, .obj, .ply, .xyz, .png)")
        ->allow_extra_args(false)
        ->delimiter(',')
        ->option_text("NAME")
        ->group("Output");

    app.add_option("-r,--resolution", raw.resolution,
                   "N voxels along the longest side of the model, cubic and centred; or exactly NX x NY x NZ of them "
                   "around it. Default: 128")
        ->option_text("N|NXxNYxNZ")
        ->group("Grid");
    app.add_option("--padding", options.grid.padding, "Keep the N outermost voxels on every side free. Default: 0")
        ->option_text("N")
        ->group("Grid");
    app.add_option("-s,--voxel-size", raw.voxel_size,
                   "Voxels of this size in the model's units instead, on the lattice of its multiples")
        ->option_text("S[,SY,SZ]")
        ->group("Grid");
    app.add_option(
           "--origin", raw.origin,
           "With --voxel-size and --extent: the exact grid, its lowest corner at this point (three numbers may also "
           "stand apart)")
        ->option_text("X,Y,Z")
        ->group("Grid");
    app.add_option("--extent", raw.extent, "Voxels along each axis of the exact grid")
        ->option_text("NX,NY,NZ")
        ->group("Grid");

    app.add_option(
           "--scale", options.load.scale,
           "Multiply all lengths of the model by this: 0.001 takes millimetres to metres. Default: 1, the file's "
           "own units")
        ->check(CLI::Range(1e-30, 1e30).description(""))
        ->option_text("F")
        ->group("Model");
    auto* const animation =
        app.add_option(
               "--animation", options.load.gltf.animation,
               "Pose a glTF model as this animation of the file (by name, or by number from 0) has it at --time")
            ->option_text("NAME")
            ->group("Model");
    app.add_option("--time", options.load.gltf.seconds,
                   "Moment of the animation in seconds; before its start and behind its end those hold. Default: 0")
        ->check(CLI::Number.description(""))
        ->needs(animation)
        ->option_text("T")
        ->group("Model");
    app.add_flag("--lenient", options.load.gltf.lenient,
                 "Go on with a warning where a file breaks the specification in a way that can be put right: unaligned "
                 "data, a node in the scene twice")
        ->group("Model");

    using voxelpipe::coverage;
    add_choice(app, "--coverage", raw.coverage, {{"conservative", coverage::conservative}, {"thin", coverage::thin}},
               "conservative: every voxel that a triangle touches. thin: the fewest without a hole (6-separating). "
               "Default: conservative")
        ->option_text("RULE")
        ->group("Coverage and values");
    add_choice(app, "--solid", raw.solid,
               {{"nonzero", solid_rule::nonzero},
                {"even_odd", solid_rule::even_odd},
                {"positive", solid_rule::positive},
                {"each_draw", solid_rule::each_draw},
                {"exterior", solid_rule::exterior}},
               "Fill the model instead: nonzero, even_odd, positive, each_draw or exterior, see SOLIDS. Not with "
               "--coverage")
        ->option_text("RULE")
        ->group("Solids");
    add_choice(app, "--solid-extent", raw.extent_of_solid,
               {{"centre", solid_extent::centre}, {"outer", solid_extent::outer}, {"inner", solid_extent::inner}},
               "centre: voxels whose centre is inside. outer: these and those that the surface touches. inner: these "
               "without those. Default: outer")
        ->option_text("WHICH")
        ->group("Solids");
    app.add_option(
           "--close-holes", raw.close_holes,
           "Put a lid on every hole of the model, of at most EDGES edges where that is given, before it is filled")
        ->option_text("[=EDGES]")
        ->group("Solids");
    app.add_flag("--vote", raw.vote,
                 "Inside is what most of the rows along x, y and z say, by whether they crossed the surface an odd "
                 "number of times; open rows abstain")
        ->group("Solids");
    app.add_option("--closing", raw.closing,
                   "With --solid exterior: close gaps of about 2 R voxels for the flood. Default: 0")
        ->check(CLI::Range(0, 64).description(""))
        ->option_text("R")
        ->group("Solids");
    app.add_option("--fill-color", raw.fill_color,
                   "Colour of the voxels inside: #rrggbb, or mean, that of the surface's voxels. Default: mean")
        ->option_text("COLOUR")
        ->group("Solids");
    add_choice(app, "--depth-axis", options.voxelize.depth_axis, {{"x", 0}, {"y", 1}, {"z", 2}},
               "Axis of --target depth: x, y or z. Default: z")
        ->option_text("AXIS")
        ->group("Coverage and values");
    add_choice(app, "--alpha", options.voxelize.alpha,
               {{"weight", blend_alpha::weight}, {"cutoff", blend_alpha::cutoff}, {"ignore", blend_alpha::ignore}},
               "What alpha does in materials that blend. weight: colours count by it. cutoff: fragments below 0.5 are "
               "not there. ignore: nothing. Default: weight")
        ->option_text("RULE")
        ->group("Coverage and values");
    add_choice(app, "--backend", options.voxelize.backend,
               {{"auto", backend_choice::automatic}, {"cpu", backend_choice::cpu}, {"cuda", backend_choice::cuda}},
               "cpu, cuda (the first GPU that CUDA shows), or auto: cuda where it can be used, otherwise cpu. All "
               "give the same bytes. Default: auto")
        ->option_text("NAME")
        ->group("Machine");
    std::vector<std::pair<const char*, voxelpipe::strategy>> strategies{{"automatic", voxelpipe::strategy::automatic}};
    for (const auto& rule : voxelpipe::device::rules) strategies.emplace_back(to_string(rule.value), rule.value);
    add_choice(app, "--strategy", options.voxelize.strategy, std::move(strategies),
               "How a GPU draws: occupancy_mask, immediate, sorted_reduce, sorted_fold, tiled (the pipeline of the "
               "paper), or automatic. All give the same bytes; not all can draw all targets. Default: automatic")
        ->option_text("NAME")
        ->group("Machine");
    app.add_option("-j,--threads", options.voxelize.threads, "Threads on the CPU. Default: 0, one for each core")
        ->check(CLI::Range(0, 1024).description(""))
        ->option_text("N")
        ->group("Machine");
    app.add_option_function<int>(
           "--max-memory",
           [&options](int mebibytes) { options.max_memory = static_cast<std::uint64_t>(mebibytes) << 20; },
           "The most MiB of this machine's memory that the run may hold at any time. Default: nine tenths of what "
           "there is")
        ->check(CLI::Range(1, 1 << 30).description(""))
        ->option_text("MIB")
        ->group("Machine");
    app.add_option_function<int>(
           "--work-memory",
           [&options](int mebibytes) { options.voxelize.work_memory = static_cast<std::uint64_t>(mebibytes) << 20; },
           "MiB for sums that exist only on the way; a grid that needs more is computed in slabs, with the same "
           "result. Default: 128, on a GPU up to 1024")
        ->check(CLI::Range(1, 1 << 20).description(""))
        ->option_text("MIB")
        ->group("Machine");
    app.add_option_function<int>(
           "--device-memory",
           [&options](int mebibytes) { options.voxelize.device_memory = static_cast<std::uint64_t>(mebibytes) << 20; },
           "The most MiB of a GPU's memory to take; where that is too little, auto turns to the CPU. Default: all that "
           "is free")
        ->check(CLI::Range(1, 1 << 20).description(""))
        ->option_text("MIB")
        ->group("Machine");

    preview_options& picture = options.write.preview;
    app.add_option("--image-size", raw.image_size, "Pixels. Default: 1280x960")
        ->option_text("WxH")
        ->group("Picture (.png)");
    app.add_option("--azimuth", picture.azimuth, "Degrees around the model, 0 from its front. Default: 35")
        ->option_text("DEG")
        ->group("Picture (.png)");
    app.add_option("--elevation", picture.elevation, "Degrees above the horizon. Default: 25")
        ->check(CLI::Range(-90.0, 90.0).description(""))
        ->option_text("DEG")
        ->group("Picture (.png)");
    app.add_option("--zoom", picture.zoom, "1 fits the model into the picture. Default: 1")
        ->check(CLI::PositiveNumber.description(""))
        ->option_text("F")
        ->group("Picture (.png)");
    app.add_option("--fov", picture.field_of_view, "Degrees from top to bottom, 0: orthographic. Default: 28")
        ->check(CLI::Range(0.0, 150.0).description(""))
        ->option_text("DEG")
        ->group("Picture (.png)");
    app.add_option("--samples", picture.samples, "Rays along each side of a pixel. Default: 2")
        ->check(CLI::Range(1, 8).description(""))
        ->option_text("N")
        ->group("Picture (.png)");
    app.add_option("--background", raw.background,
                   "sky, white, dark, transparent, #rrggbb, or #rrggbb,#rrggbb from top to bottom. Default: sky")
        ->option_text("COLOUR")
        ->group("Picture (.png)");
    app.add_flag("--no-color", raw.no_color, "Show all voxels in one colour")->group("Picture (.png)");
    app.add_flag("--no-edges", raw.no_edges, "No lines between voxels")->group("Picture (.png)");
    app.add_flag("--no-ground", raw.no_ground, "No shadow on the ground")->group("Picture (.png)");

    const auto choose_storage = [&options](storage_choice choice) {
        if (options.storage != storage_choice::automatic && options.storage != choice)
            throw usage_error("--sparse and --dense do not go together");
        options.storage = choice;
    };
    app.add_flag_callback(
           "--sparse", [choose_storage] { choose_storage(storage_choice::sparse); },
           "Keep only voxels that something is drawn in: .npz and .npy then hold their coords, (n, 3), and values. By "
           "itself where an output is .nvdb, or where a dense grid does not fit the memory and all outputs can do "
           "without")
        ->group("Machine");
    app.add_flag_callback(
           "--dense", [choose_storage] { choose_storage(storage_choice::dense); }, "Compute a dense grid in any case")
        ->group("Machine");

    add_choice(app, "--up", options.write.up, {{"y", up_axis::y}, {"z", up_axis::z}},
               "Axis of the model that stands upright in .png, .vox and .schem: y or z. Default: y, as in glTF; many "
               ".stl have z")
        ->option_text("AXIS")
        ->group("Files");
    app.add_flag("--merge", options.write.merge_faces,
                 "Join the faces of .glb, .obj and .ply: coplanar ones of equal colour become one rectangle")
        ->group("Files");
    app.add_flag("--points", options.write.points, "Write the centres of the voxels into .ply, not their outer sides")
        ->group("Files");
    app.add_option("--compression", options.write.compression,
                   "Level of .npz, .vti, .nrrd and .schem, 0 to 9. Default: 1")
        ->check(CLI::Range(0, 9).description(""))
        ->option_text("N")
        ->group("Files");

    add_choice(app, "--stats", options.stats, {{"text", stats_format::text}, {"json", stats_format::json}},
               "Print counts, times and memory; `--stats json` for programs, one object on standard output")
        ->option_text("[json]")
        ->group("Messages");
    app.add_flag("-q,--quiet", options.quiet, "Print errors (and --stats) only")->group("Messages");
    app.set_help_flag("-h,--help", "Print this help")->group("Messages");
    app.set_version_flag("--version",
                         "voxelize " + std::to_string(VOXELPIPE_VERSION_MAJOR) + '.' +
                             std::to_string(VOXELPIPE_VERSION_MINOR) + '.' + std::to_string(VOXELPIPE_VERSION_PATCH),
                         "Print the version")
        ->group("Messages");
}

void understand_solid(command_line& options, const raw_options& raw) {
    if (raw.coverage) options.voxelize.coverage = *raw.coverage;
    if (!raw.solid) {
        const std::pair<const char*, bool> given[]{{"--solid-extent", raw.extent_of_solid.has_value()},
                                                   {"--close-holes", !raw.close_holes.empty()},
                                                   {"--vote", raw.vote},
                                                   {"--closing", raw.closing.has_value()},
                                                   {"--fill-color", !raw.fill_color.empty()}};
        for (const auto& [name, is_given] : given)
            if (is_given) throw usage_error(std::string(name) + " goes with --solid");
        return;
    }
    if (raw.coverage)
        throw usage_error("--solid and --coverage do not go together: a solid's surface is conservative, see "
                          "--solid-extent");
    solid_request& solid = options.voxelize.solid.emplace();
    solid.rule = *raw.solid;
    solid.extent = raw.extent_of_solid.value_or(solid_extent::outer);
    solid.vote = raw.vote;
    solid.closing = raw.closing.value_or(0);
    const bool is_flood = solid.rule == solid_rule::exterior;
    if (raw.closing && !is_flood) throw usage_error("--closing goes with --solid exterior");
    if (raw.vote && (is_flood || solid.rule == solid_rule::each_draw))
        throw usage_error(std::string("--vote does not go with --solid ") + to_string(solid.rule));
    if ((is_flood || raw.vote) && solid.extent != solid_extent::outer)
        throw usage_error(std::string(is_flood ? "--solid exterior" : "--vote") + " always has --solid-extent outer");
    if (!raw.close_holes.empty()) {
        if (is_flood || raw.vote)
            throw usage_error(std::string("--close-holes does not go with ") +
                              (is_flood ? "--solid exterior" : "--vote"));
        solid.close_holes = UINT64_MAX;
        if (raw.close_holes != "all") {
            const char* const end = raw.close_holes.data() + raw.close_holes.size();
            const auto [last, error] = std::from_chars(raw.close_holes.data(), end, solid.close_holes);
            if (error != std::errc{} || last != end || solid.close_holes == 0)
                throw usage_error(
                    "--close-holes takes the number of edges of the largest hole to close, 1 or more, not "
                    "\"" +
                    raw.close_holes + '"');
        }
    }
    if (raw.fill_color.empty() || lower(raw.fill_color) == "mean") return;
    solid.fill_color = parse_color(raw.fill_color);
    if (!solid.fill_color) throw usage_error("--fill-color takes mean or #rrggbb, not \"" + raw.fill_color + '"');
}

void understand_grid(command_line& options, const raw_options& raw) {
    if (!raw.resolution.empty()) {
        const std::vector<int> n = parse_list<int>("--resolution", raw.resolution, 1);
        if (n.size() == 1)
            options.grid.resolution = n[0];
        else
            options.grid.box = glm::ivec3(n[0], n[1], n[2]);
    }
    if (!raw.voxel_size.empty()) options.grid.voxel_size = parse_point("--voxel-size", raw.voxel_size, 1);
    if (!raw.origin.empty()) options.grid.origin = parse_point("--origin", raw.origin, 3);
    if (!raw.extent.empty()) {
        const std::vector<int> n = parse_list<int>("--extent", raw.extent, 3);
        options.grid.extent = glm::ivec3(n[0], n[1], n[2]);
    }
    // What can be told of the grid before the model is there.
    bounding_box unit;
    unit.high = glm::dvec3(1);
    try {
        grid_request probe = options.grid;
        options.grid.coverage = options.voxelize.coverage;
        if (probe.voxel_size && !probe.origin && !probe.extent) unit.high = *probe.voxel_size;
        (void)place_grid(probe, unit);
    } catch (const grid_error& error) {
        throw usage_error(error.what());
    }
}

void understand_outputs(command_line& options, const raw_options& raw) {
    bool shows_colors = false;
    bool needs_occupancy = false;
    for (const std::filesystem::path& output : options.outputs) {
        const format* found = find_format(output);
        if (found == nullptr) {
            throw usage_error("\"" + output.string() + "\": the extension of an output must be one of " +
                              names(formats(), &format::extension));
        }
        if (std::count(options.outputs.begin(), options.outputs.end(), output) > 1)
            throw usage_error("\"" + output.string() + "\" is given twice");
        // Now, not when all is computed.
        if (const auto& size = options.grid.voxel_size;
            size && found->needs_cubes && !are_cubic({size->x, size->y, size->z}))
            throw usage_error("\"" + output.string() + "\": " + std::string(found->extension) +
                              " has one voxel size for all axes, --voxel-size has several");
        needs_occupancy = needs_occupancy || found->needs_occupancy;
        shows_colors = shows_colors || found->shows_colors;
    }
    std::vector<target>& targets = options.voxelize.targets;
    targets.clear();
    for (const std::string& name : raw.targets) {
        const std::optional<target> id = target_named(lower(name));
        if (!id)
            throw usage_error("--target \"" + name + "\" is not one of " + names(target_table, &target_info::name));
        if (std::find(targets.begin(), targets.end(), *id) == targets.end()) targets.push_back(*id);
    }
    for (const target id : targets) {
        const std::string_view name = info_of(id).name;
        const bool held = std::any_of(options.outputs.begin(), options.outputs.end(), [&](const auto& output) {
            const format* const found = find_format(output);
            return id == target::occupancy || found->all_channels || (found->shows_colors && name.starts_with("color"));
        });
        if (!held)
            options.warnings.push_back("--target " + std::string(name) +
                                       " is in none of the outputs: their formats hold no such values");
    }
    if (targets.empty()) {
        targets.push_back(target::occupancy);
        if (shows_colors && !raw.no_color) options.implied.push_back(target::color);
    }
    if (needs_occupancy && std::find(targets.begin(), targets.end(), target::occupancy) == targets.end())
        options.implied.push_back(target::occupancy);
    targets.insert(targets.end(), options.implied.begin(), options.implied.end());
    options.load.gltf.colors =
        std::any_of(targets.begin(), targets.end(), [](target id) { return info_of(id).name.starts_with("color"); });
    options.load.gltf.blend_cuts = options.voxelize.alpha == blend_alpha::cutoff;
}

void understand_picture(command_line& options, const raw_options& raw) {
    preview_options& picture = options.write.preview;
    if (!raw.image_size.empty()) {
        const char* const end = raw.image_size.data() + raw.image_size.size();
        const auto [middle, first] = std::from_chars(raw.image_size.data(), end, picture.width);
        const bool cross = first == std::errc{} && middle != end && *middle == 'x';
        const auto [last, second] = cross ? std::from_chars(middle + 1, end, picture.height)
                                          : std::from_chars_result{middle, std::errc::invalid_argument};
        if (second != std::errc{} || last != end || picture.width < 1 || picture.width > 16384 || picture.height < 1 ||
            picture.height > 16384)
            throw usage_error("--image-size takes WIDTHxHEIGHT from 1x1 to 16384x16384, not \"" + raw.image_size + '"');
    }
    if (!raw.background.empty()) {
        const std::optional<background> chosen = parse_background(raw.background);
        if (!chosen) throw usage_error("--background \"" + raw.background + "\" is not known, see --help");
        picture.backdrop = *chosen;
    }
    picture.use_color = !raw.no_color;
    picture.edges = !raw.no_edges;
    picture.ground = !raw.no_ground;
    picture.up = options.write.up;
    picture.threads = options.voxelize.threads;
    options.write.threads = options.voxelize.threads;
    options.load.gltf.threads = options.voxelize.threads;
}

} // namespace

command_line parse_command_line(int argc, const char* const* argv) {
    command_line options;
    raw_options raw;
    CLI::App app{introduction, "voxelize"};
    app.formatter(std::make_shared<help_formatter>());
    app.footer(footer());
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
    } catch (const CLI::ParseError& error) {
        throw usage_error(error.what());
    }
    // Ranges let NaN through.
    if (!std::isfinite(options.load.scale)) throw usage_error("--scale is a number");
    if (!std::isfinite(options.load.gltf.seconds)) throw usage_error("--time is a number of seconds");
    understand_solid(options, raw);
    understand_grid(options, raw);
    understand_outputs(options, raw);
    understand_picture(options, raw);
    if (options.voxelize.backend == backend_choice::cpu && options.voxelize.strategy != voxelpipe::strategy::automatic)
        throw usage_error("--strategy says how a GPU draws; it does not go with --backend cpu");
    return options;
}

} // namespace voxelize
