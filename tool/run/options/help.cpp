// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "help.hpp"

#include "model/targets.hpp"
#include "write/formats/formats.hpp"

#include <algorithm>
#include <string_view>

namespace voxelize {

const char* const help_introduction =
    "Turns a 3D model into voxels: exact coverage, several values a voxel, many file formats.\n"
    "\n"
    "EXAMPLES\n"
    "  voxelize model.glb -o model.vox -o model.png -r 256\n"
    "      coloured voxels, 256 along the longest side, for MagicaVoxel, and a picture of them\n"
    "  voxelize model.glb -o model.npy -s 0.05 --coverage thin\n"
    "      a thin shell of voxels of 0.05 units of the model, as a NumPy array of 0 and 1\n"
    "  voxelize model.glb -o model.npz -t occupancy,normal,material --stats\n"
    "      three arrays in one file, and what it took to compute them\n";

std::string help_footer() {
    std::string text = "TARGETS (--target NAME)\n";
    const auto line = [&text](std::string_view name, std::string_view rest) {
        text += "  " + std::string(name) + std::string(name.size() < 16 ? 16 - name.size() : 1, ' ') +
                std::string(rest) + '\n';
    };
    for (const target_info& entry : all_targets) {
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
        "\nREMESHING (--remesh)\n"
        "  A mesh without boundary edges, in which every edge has two faces and every vertex one fan of faces, around\n"
        "  what --solid RULE (default: nonzero) has inside at the voxels' centres; --close-holes, --winding, --vote "
        "and\n"
        "  --solid exterior with --closing repair models that are not closed. Vertices lie where the model crosses "
        "the\n"
        "  lines between centres, exactly; --iso D moves the surface outward by D, so that a sheet becomes a plate of "
        "2 D.\n"
        "  They have the model's colours, unless --no-color is given, and normals. --embedded moves vertices of\n"
        "  triangles that intersect each other to the mean of their crossings. One process makes it, on the CPU\n"
        "  or on one GPU.\n"
        "\nDISTANCES (--distance)\n"
        "  The distance of every sample from the nearest triangle, float32, in the model's units, exact. It is a "
        "distance "
        "to\n"
        "  the mesh: walls inside a union of parts count. Samples are the centres of the voxels, or their corners. "
        "Negative\n"
        "  inside, by the rule of --solid (nonzero without) and --close-holes, --winding or --vote, without --solid "
        "too. "
        "Further\n"
        "  away than the band of --band N voxels (of the longest side) they hold that distance. color, normal, "
        "material,\n"
        "  triangle, depth and nearest are those of the nearest triangle at its closest point, and empty beyond the "
        "band.\n"
        "  .nvdb and .vdb hold the band as a level set, if it is signed and voxels are cubes. Formats of voxels show "
        "those of\n"
        "  at most --iso. One process draws a field, on the CPU or on one GPU.\n"
        "\nFRACTIONS (--target fraction, area_vector, area, centroid, aperture_x, aperture_y, aperture_z)\n"
        "  The mean of the winding number over the voxel, float32: the volume inside, 0 to 1, of a closed model "
        "without\n"
        "  overlaps, whose triangles face outward. Parts that overlap add up, those that are inside out count "
        "negative; "
        "--clamp\n"
        "  keeps 0 to 1. It needs no --solid. --solid nonzero beside it decides on the other targets. --close-holes "
        "puts lids on\n"
        "  the model's holes first. Alpha masks cut no holes.\n"
        "  area_vector, float32 x 3: the surface's area within the voxel as a vector out of the inside, in squared "
        "units of\n"
        "  the model; its sum over a closed model is 0. Area between two voxels is the lower one's.\n"
        "  area, float32: the surface's area within the voxel in the same units. centroid, float32 x 3: that of the "
        "part\n"
        "  inside, from the voxel's centre in voxels, -0.5 to 0.5; 0 where hardly anything is inside.\n"
        "  aperture_x, _y, _z, float32: how much of each face across the axis is inside, into .npy, .npz, .zarr, .vti, "
        ".nrrd\n"
        "  and .nii; for a grid of nz, ny, nx voxels aperture_x has the shape (nz, ny, nx + 1), so beside other "
        "targets "
        "it\n"
        "  is an image of its own, OUT.aperture_x.vti.\n"
        "  --outside takes fractions and apertures of the outside, 1 minus these: of the fluid around a body.\n"
        "  With --sparse fraction, area and centroid keep what is cut or inside alone.\n"
        "  All are drawn on the CPU. --threshold makes hexahedra of the voxels whose fraction is at least so "
        "much.\n"
        "\nLINKS (--target links, link_triangle, link_material)\n"
        "  Where the model crosses the links from the centres of voxels to those of 18 neighbours, or of 26 with "
        "--neighbours\n"
        "  26: what lattice Boltzmann solvers read of walls. Lists in .npz and .npy, a row for each voxel of which a "
        "link is\n"
        "  crossed: coords, and for each link how much of it lies before its first crossing, above 0 to 1, or -1. "
        "Padding has\n"
        "  links too. The model may be open. The order of the links is in docs/tool.md.\n"
        "\nMANY MODELS (--list FILE)\n"
        "  {name} is the name of the model's file without its extension; equal names get -2, -3, ... in the order of "
        "the list.\n"
        "  Beside the outputs, manifest.RANK.jsonl gets a line for each model: input, outputs, status, counts, hash, "
        "ms. A later\n"
        "  run of the same command leaves out what is finished. A model that fails stops nothing; the exit code is 2 "
        "at the end.\n"
        "\nLARGE MODELS\n"
        "  An OBJ, a binary STL or PLY or a plain glTF file that does not fit --max-memory goes through temporary "
        "files.\n"
        "  With --resume, with --world-size and under mpiexec one model is drawn and written into a .zarr in slabs of "
        "256\n"
        "  layers, or into a .pvti piece by piece. Processes share the slabs; the same command goes on where a run "
        "was\n"
        "  stopped.\n"
        "\nEXIT CODES\n"
        "  0 done   1 wrong command line   2 the model, or the list, cannot be used   3 not enough memory\n"
        "  4 an output cannot be written   5 --backend cuda cannot be used   70 a bug of this program\n"
        "  5 is: built without CUDA, no driver, a driver too old, no GPU, or one that there is no code for; too\n"
        "  little memory on the GPU is 3, as on the machine. With --backend auto the CPU does the work instead.\n";
    return text;
}

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

} // namespace voxelize
