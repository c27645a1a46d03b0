// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "raw_options.hpp"
#include "values.hpp"

#include <voxelpipe/config.hpp>

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelize {

namespace {

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

// A number in [LOW, HIGH].
template <class Number>
CLI::Validator between(Number low, Number high) {
    const auto why_not = [low, high](const std::string& text) -> std::string {
        Number value{};
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return "";
        std::ostringstream reason;
        reason << (std::is_integral_v<Number> ? "a whole number from " : "a number from ") << low << " to " << high
               << ", not \"" << text << '"';
        return reason.str();
    };
    return {why_not, "", "between"};
}

// A number above 0.
CLI::Validator above_zero() {
    const auto why_not = [](const std::string& text) -> std::string {
        double value = 0;
        const bool is_good = CLI::detail::lexical_cast(text, value) && value > 0 && std::isfinite(value);
        return is_good ? "" : "a number above 0, not \"" + text + '"';
    };
    return {why_not, "", "above_zero"};
}

void describe_files(CLI::App& app, command_line& options, raw_options& raw) {
    app.add_option("INPUT", options.input,
                   "Model: glTF 2.0 (.glb, .gltf), or .obj, .stl, .ply, .off and others that assimp reads")
        ->option_text(" ");
    app.add_option("-o,--output", options.outputs,
                   "Write the voxels to FILE (required); one -o for each file. FORMAT:-, as npy:-, is standard output")
        ->allow_extra_args(false)
        ->option_text("FILE")
        ->group("Output");
    app.add_option("-t,--target", raw.targets,
                   "What to compute for each voxel, see TARGETS; may be repeated. Default: occupancy, with color where "
                   "an output shows colours (.vox, .schem, .litematic, .glb, .obj, .ply, .3mf, .xyz, .png)")
        ->allow_extra_args(false)
        ->delimiter(',')
        ->option_text("NAME")
        ->group("Output");
}

void describe_batch(CLI::App& app, command_line& options) {
    auto* const list = app.add_option("--list", options.batch.list,
                                      "In place of INPUT: a file with the path of a model in each line, - for standard "
                                      "input. {name} in each -o is the model's name, see MANY MODELS")
                           ->option_text("FILE")
                           ->group("Many models, many processes");
    auto* const size = app.add_option("--world-size", options.batch.world_size,
                                      "How many processes share the list, or the slabs of one model. Default: 1, or as "
                                      "mpiexec says, with --list as srun says too")
                           ->check(between(1, 1 << 30))
                           ->option_text("W")
                           ->group("Many models, many processes");
    app.add_option("--rank", options.batch.rank,
                   "The number of this one, from 0: it takes the models or slabs RANK, RANK + W, RANK + 2 W, ...")
        ->check(between(0, 1 << 30))
        ->needs(size)
        ->option_text("R")
        ->group("Many models, many processes");
    app.add_flag("--resume", options.by_slabs,
                 "One model slab by slab into a .zarr or .pvti: a run that was stopped goes on where it was when the "
                 "same command is given again, see LARGE MODELS")
        ->group("Many models, many processes");
    app.add_option("--jobs", options.batch.jobs,
                   "Models at a time, which share --max-memory and the machine's cores. Default: 1")
        ->check(between(1, 1024))
        ->needs(list)
        ->option_text("J")
        ->group("Many models, many processes");
}

void describe_grid(CLI::App& app, command_line& options, raw_options& raw) {
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
}

void describe_model(CLI::App& app, command_line& options) {
    app.add_option(
           "--scale", options.load.scale,
           "Multiply all lengths of the model by this: 0.001 takes millimetres to metres. Default: 1, the file's "
           "own units")
        ->check(between(1e-30, 1e30))
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
    app.add_option("--variant", options.load.gltf.variant,
                   "Give the surfaces of a glTF model the materials of this variant of the file, by name "
                   "(KHR_materials_variants)")
        ->option_text("NAME")
        ->group("Model");
    app.add_flag("--lenient", options.load.gltf.lenient,
                 "Go on with a warning where a file breaks the specification in a way that can be put right: unaligned "
                 "data, a node in the scene twice")
        ->group("Model");
}

void describe_values(CLI::App& app, command_line& options, raw_options& raw) {
    using voxelpipe::coverage;
    add_choice(app, "--coverage", raw.coverage,
               {{"conservative", coverage::conservative},
                {"thin", coverage::thin},
                {"crosshair", coverage::crosshair},
                {"diagonal", coverage::diagonal}},
               "conservative: every voxel that a triangle touches. thin: one voxel in each column along a triangle's "
               "dominant axis, without a hole (6-separating). crosshair: voxels whose axes through the centre meet a "
               "triangle (6-separating, fewer than thin, whatever the triangles). diagonal: the same with the "
               "diagonals of a voxel (26-separating). Default: conservative")
        ->option_text("RULE")
        ->group("Coverage and values");

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
    app.add_flag("--clamp", options.voxelize.clamp, "Fractions below 0 become 0, those above 1 become 1")
        ->group("Coverage and values");
    app.add_flag("--outside", options.voxelize.outside,
                 "Fractions and apertures are those of the outside, 1 minus those of the inside, as flow solvers want "
                 "them of the fluid around a body")
        ->group("Coverage and values");
    app.add_option("--neighbours", raw.neighbours,
                   "With --target links: the links of a voxel, 18 through faces and edges or 26 with corners. Default: "
                   "18")
        ->option_text("18|26")
        ->group("Coverage and values");
}

void describe_solids(CLI::App& app, raw_options& raw) {
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
           "Put a lid on every hole of the model, of at most EDGES edges where that is given, before it is filled or "
           "measured")
        ->option_text("[=EDGES]")
        ->group("Solids");
    app.add_flag("--vote", raw.vote,
                 "Inside is what most of the rows along x, y and z say, by whether they crossed the surface an odd "
                 "number of times; open rows abstain")
        ->group("Solids");
    app.add_flag("--winding", raw.winding,
                 "Inside is where the generalized winding number, the solid angle of the whole model over 4 pi, is at "
                 "least 1/2: holes of an open model close smoothly. Not with even_odd and each_draw")
        ->group("Solids");
    app.add_option("--closing", raw.closing,
                   "With --solid exterior: close gaps of about 2 R voxels for the flood. Default: 0")
        ->check(between(0, 64))
        ->option_text("R")
        ->group("Solids");
    app.add_option("--fill,--fill-color", raw.fill,
                   "What the voxels inside get: body, the colour and material of the body that they lie in; nearest, "
                   "those of the nearest triangle; mean, the colour of the surface's voxels; or #rrggbb. Default: body")
        ->option_text("WHAT")
        ->group("Solids");
}

void describe_distances(CLI::App& app, raw_options& raw) {
    app.add_flag("--distance", raw.distance,
                 "Compute the distance of every sample from the model instead, in its units, negative inside; see "
                 "DISTANCES")
        ->group("Distances");
    app.add_option("--band", raw.band,
                   "Samples further away than N voxels hold that distance, with their sign; whole: none do. Default: 3")
        ->option_text("N|whole")
        ->group("Distances");
    app.add_flag("--unsigned", raw.is_unsigned, "Positive inside, too: a model need not be closed")->group("Distances");
    app.add_flag("--corners", raw.corners,
                 "Samples at the corners of the voxels, one more along each axis. Default: at their centres")
        ->group("Distances");
    app.add_flag("--half", raw.half, "The field in numbers of 16 bits, each the nearest, in .npy, .npz and .zarr")
        ->group("Distances");
    app.add_option("--iso", raw.iso,
                   "What pictures, meshes and lists of voxels show of distances: those of at most D; with --remesh the "
                   "distance at which the mesh lies. Default: 0, the model")
        ->option_text("D")
        ->group("Distances");
}

void describe_remesh(CLI::App& app, raw_options& raw) {
    app.add_flag("--remesh", raw.remesh,
                 "Make a closed manifold mesh around what lies inside, not voxels; the outputs are .glb, .ply, .stl, "
                 ".obj, .3mf or .npz. See REMESHING")
        ->group("Remeshing");
    add_choice(
        app, "--place", raw.place,
        {{"corner", voxelpipe::place::corner}, {"mean", voxelpipe::place::mean}, {"sharp", voxelpipe::place::sharp}},
        "Where its vertices lie: where the model's planes meet (sharp), which keeps creases and corners, at the "
        "mean of its crossings, or at the corners of voxels. Default: sharp")
        ->option_text("WHERE")
        ->group("Remeshing");
    app.add_flag("--quads", raw.quads, "Quads, where the format has them: .obj, .ply and .npz")->group("Remeshing");
    app.add_flag("--embedded", raw.embedded,
                 "Move the vertices of triangles that intersect each other to the mean of their crossings, until none "
                 "intersect or all that do are there")
        ->group("Remeshing");
    app.add_flag("--report", raw.report,
                 "Print the mesh's components, its Euler characteristic, how many crossings were made up, and with "
                 "--embedded what it did")
        ->group("Remeshing");
}

void describe_machine(CLI::App& app, command_line& options) {
    add_choice(
        app, "--backend", options.voxelize.backend,
        {{"auto", backend_choice::automatic}, {"cpu", backend_choice::cpu}, {"cuda", backend_choice::cuda}},
        "cpu, cuda (the first GPU that CUDA shows), or auto: the quicker of the two for this model and grid, as far "
        "as that can be told before. Both give the same bytes. Default: auto")
        ->option_text("NAME")
        ->group("Machine");
    std::vector<std::pair<const char*, voxelpipe::strategy>> strategies{{"automatic", voxelpipe::strategy::automatic}};
    for (const auto& rule : voxelpipe::device::rules) strategies.emplace_back(to_string(rule.value), rule.value);
    add_choice(app, "--strategy", options.voxelize.strategy, std::move(strategies),
               "How a GPU draws: occupancy_mask, immediate, sorted_reduce, sorted_fold, tiled (the pipeline of the "
               "paper), or automatic. All give the same bytes; not all can draw all targets. Default: automatic")
        ->option_text("NAME")
        ->group("Machine");
    app.add_option_function<std::string>(
           "--devices", [&options](const std::string& n) { options.voxelize.devices = n == "all" ? 0 : std::stoi(n); },
           "GPUs that share the work, each with some layers of the grid: a number, or all that CUDA shows. The bytes "
           "are "
           "the same. A flood, --solid and color-outer are done by the first. Default: 1")
        ->check(CLI::Validator(
            [](std::string& n) {
                const bool is_number = !n.empty() && n.size() < 5 && n.find_first_not_of("0123456789") == n.npos;
                return n == "all" || (is_number && std::stoi(n) > 0)
                           ? std::string()
                           : "a whole number from 1 to 9999, or all, not \"" + n + '"';
            },
            "", "devices"))
        ->option_text("N|all")
        ->group("Machine");
    app.add_option("-j,--threads", options.voxelize.threads, "Threads on the CPU. Default: 0, one for each core")
        ->check(between(0, 1024))
        ->option_text("N")
        ->group("Machine");
    app.add_option_function<int>(
           "--max-memory",
           [&options](int mebibytes) { options.max_memory = static_cast<std::uint64_t>(mebibytes) << 20; },
           "The most MiB of this machine's memory that the run may hold at any time. Default: nine tenths of what "
           "there is")
        ->check(between(1, 1 << 30))
        ->option_text("MIB")
        ->group("Machine");
    app.add_option_function<int>(
           "--work-memory",
           [&options](int mebibytes) { options.voxelize.work_memory = static_cast<std::uint64_t>(mebibytes) << 20; },
           "MiB for sums that exist only on the way; a grid that needs more is computed in slabs, with the same "
           "result. Default: 128, on a GPU up to 1024")
        ->check(between(1, 1 << 20))
        ->option_text("MIB")
        ->group("Machine");
    app.add_option_function<int>(
           "--device-memory",
           [&options](int mebibytes) { options.voxelize.device_memory = static_cast<std::uint64_t>(mebibytes) << 20; },
           "The most MiB of a GPU's memory to take; where that is too little, auto turns to the CPU. Default: all that "
           "is free")
        ->check(between(1, 1 << 20))
        ->option_text("MIB")
        ->group("Machine");

    const auto choose_storage = [&options](storage_choice choice) {
        if (options.storage != storage_choice::automatic && options.storage != choice)
            throw usage_error("--sparse and --dense do not go together");
        options.storage = choice;
    };
    app.add_flag_callback(
           "--sparse", [choose_storage] { choose_storage(storage_choice::sparse); },
           "Keep only voxels that something is drawn in: .npz and .npy then hold their coords, (n, 3), and values. By "
           "itself where an output is .nvdb or .vdb, beside which they stay grids, or where a dense grid does not fit "
           "the memory")
        ->group("Machine");
    app.add_flag_callback(
           "--dense", [choose_storage] { choose_storage(storage_choice::dense); }, "Compute a dense grid in any case")
        ->group("Machine");
}

void describe_picture(CLI::App& app, command_line& options, raw_options& raw) {
    preview_options& picture = options.write.preview;
    app.add_option("--image-size", raw.image_size, "Pixels. Default: 1280x960")
        ->option_text("WxH")
        ->group("Picture (.png)");
    app.add_option("--azimuth", picture.azimuth, "Degrees around the model, 0 from its front. Default: 35")
        ->option_text("DEG")
        ->group("Picture (.png)");
    app.add_option("--elevation", picture.elevation, "Degrees above the horizon. Default: 25")
        ->check(between(-90.0, 90.0))
        ->option_text("DEG")
        ->group("Picture (.png)");
    app.add_option("--zoom", picture.zoom, "1 fits the model into the picture. Default: 1")
        ->check(above_zero())
        ->option_text("F")
        ->group("Picture (.png)");
    app.add_option("--fov", picture.field_of_view, "Degrees from top to bottom, 0: orthographic. Default: 28")
        ->check(between(0.0, 150.0))
        ->option_text("DEG")
        ->group("Picture (.png)");
    app.add_option("--samples", picture.samples, "Rays along each side of a pixel. Default: 2")
        ->check(between(1, 8))
        ->option_text("N")
        ->group("Picture (.png)");
    app.add_option("--background", raw.background,
                   "sky, white, dark, transparent, #rrggbb, or #rrggbb,#rrggbb from top to bottom. Default: sky")
        ->option_text("COLOUR")
        ->group("Picture (.png)");
    app.add_flag("--no-color", raw.no_color, "Show all voxels in one colour; with --remesh, a mesh without colours")
        ->group("Picture (.png)");
    app.add_flag("--no-edges", raw.no_edges, "No lines between voxels")->group("Picture (.png)");
    app.add_flag("--no-ground", raw.no_ground, "No shadow on the ground")->group("Picture (.png)");
}

void describe_output(CLI::App& app, command_line& options, raw_options& raw) {
    add_choice(app, "--up", options.write.up, {{"y", up_axis::y}, {"z", up_axis::z}},
               "Axis of the model that stands upright in .png, .vox, .schem and .litematic: y or z. Default: y, as in "
               "glTF; many "
               ".stl have z")
        ->option_text("AXIS")
        ->group("Files");
    app.add_flag(
           "--merge", options.write.merge_faces,
           "Join the faces of .glb, .obj, .ply, .stl and .3mf: coplanar ones of equal colour become one rectangle")
        ->group("Files");
    app.add_flag("--points", options.write.points, "Write the centres of the voxels into .ply, not their outer sides")
        ->group("Files");
    app.add_option("--blocks", options.block_file,
                   "Blocks of .schem and .litematic: a file with a block in each line and behind it its colour, "
                   "#rrggbb, or material and a name: voxels become the block of their material, or of the nearest "
                   "colour")
        ->option_text("FILE")
        ->group("Files");
    app.add_option("--threshold", raw.threshold,
                   "With --target fraction: the hexahedra of .vtu, .inp and .msh are the voxels whose fraction is at "
                   "least this, above 0 and up to 1")
        ->option_text("FRACTION")
        ->group("Files");
    app.add_flag("--levels", options.write.levels,
                 "Write each value of .zarr with its mip levels, as an OME-Zarr multiscale image")
        ->group("Files");
    app.add_option(
           "--pieces", options.write.pieces,
           "Slabs along z that .pvti is cut into, a file each, and .nvdb, a grid of each value each. Default: as "
           "many as .pvti needs for pieces of 1 GiB, or of a quarter of --max-memory; one in .nvdb")
        ->check(between(1, 512))
        ->option_text("N")
        ->group("Files");
    add_choice(app, "--zarr-codec", options.write.zstd, {{"gzip", false}, {"zstd", true}},
               "How the chunks of .zarr are compressed: gzip, which every reader has, or zstd. Default: gzip")
        ->option_text("NAME")
        ->group("Files");
    app.add_option("--slice-bits", options.write.slice_bits,
                   "Bits of a pixel of {z}.png: 8 or 16. Default: 8 of occupancy, 16 of fractions")
        ->check(CLI::Validator(
            [](const std::string& text) {
                return text == "8" || text == "16" ? std::string() : "8 or 16, not \"" + text + '"';
            },
            ""))
        ->option_text("N")
        ->group("Files");
    add_choice(
        app, "--space", raw.space, {{"lps", patient_axes::lps}, {"ras", patient_axes::ras}},
        "The axes of a patient that x, y and z of the model are, in .nrrd, .nii and .nii.gz: lps (left, posterior, "
        "superior), as 3D Slicer and ITK have those of meshes, or ras (right, anterior, superior), as FSL and "
        "FreeSurfer have theirs. Default: lps")
        ->option_text("AXES")
        ->group("Files");
    app.add_option(
           "--compression", options.write.compression,
           "Level of .npz, .vti, .vtu, .nrrd, .nii.gz, .zarr, .3mf, .schem, .litematic and {z}.png, 0 to 9. Default: 1")
        ->check(between(0, 9))
        ->option_text("N")
        ->group("Files");
}

void describe_messages(CLI::App& app, command_line& options) {
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

} // namespace

void describe(CLI::App& app, command_line& options, raw_options& raw) {
    describe_files(app, options, raw);
    describe_batch(app, options);
    describe_grid(app, options, raw);
    describe_model(app, options);
    describe_values(app, options, raw);
    describe_solids(app, raw);
    describe_distances(app, raw);
    describe_remesh(app, raw);
    describe_machine(app, options);
    describe_picture(app, options, raw);
    describe_output(app, options, raw);
    describe_messages(app, options);
}

} // namespace voxelize
