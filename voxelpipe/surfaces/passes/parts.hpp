// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Components of a surface, and leaving parts of it out: functors for a backend's for_each.

#include <voxelpipe/core/disjoint_sets.hpp>
#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/surfaces/surface.hpp>

#include <glm/vec4.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// Sets of vertices.
using vertex_sets = disjoint_sets<std::uint32_t>;

// Each vertex by itself, and marked as left out.
struct start_vertices {
    std::uint32_t *parents, *kept;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        parents[i] = static_cast<std::uint32_t>(i);
        kept[i] = 0;
    }
};

// For parts of which none is left out: each vertex by itself, the vertices of quad i joined, and the number of sets
// that there are then.
struct start_sets {
    std::uint32_t* parents;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { parents[i] = static_cast<std::uint32_t>(i); }
};
struct join_all_quads {
    const glm::uvec4* quads;
    vertex_sets sets;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::uvec4 q = quads[i];
        sets.join(q.x, q.y);
        sets.join(q.y, q.z);
        sets.join(q.z, q.w);
    }
};
struct count_sets {
    const std::uint32_t* parents;
    std::uint64_t* count;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (parents[i] == i) add_shared(*count, 1);
    }
};

// Joins and marks the vertices of quad i, unless it reaches beyond the grid and the border is open. All threads write
// the same value to a mark.
struct join_quads {
    const glm::uvec4* quads;
    const surface_vertex* vertices;
    glm::ivec3 extent;
    bool open;
    vertex_sets sets;
    std::uint32_t* kept;
    std::uint32_t* kept_quads;

    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        const glm::uvec4 q = quads[i];
        const bool keep = !open || (is_within(q.x) && is_within(q.y) && is_within(q.z) && is_within(q.w));
        kept_quads[i] = keep ? 1 : 0;
        if (!keep) return;
        for (const std::uint32_t v : {q.x, q.y, q.z, q.w}) store_shared(kept[v], 1, true);
        sets.join(q.x, q.y);
        sets.join(q.y, q.z);
        sets.join(q.z, q.w);
    }
    [[nodiscard]] VOXELPIPE_HD bool is_within(std::uint32_t v) const {
        const glm::ivec3 c = vertices[v].cell;
        return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < extent.x - 1 && c.y < extent.y - 1 && c.z < extent.z - 1;
    }
};

// Sizes of components, at their roots.
struct count_members {
    vertex_sets sets;
    const std::uint32_t* kept;
    std::uint64_t* sizes;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (kept[i] == 0) return;
        const std::uint32_t root = sets.root(static_cast<std::uint32_t>(i));
#if defined(__CUDA_ARCH__)
        // A warp's vertices are mostly of one component: one thread adds them all.
        const unsigned same = __match_any_sync(__activemask(), root);
        if ((same & ((1u << threadIdx.x % 32) - 1)) == 0) add_shared(sizes[root], static_cast<unsigned>(__popc(same)));
#else
        add_shared(sizes[root], 1);
#endif
    }
};

// How many components there are, and how many are kept.
enum class part_count : int { found, left_out, count };

struct choose_components {
    vertex_sets sets;
    const std::uint64_t* sizes;
    std::uint64_t least;
    std::uint64_t* counts; // by part_count
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (sizes[i] == 0) return;
        add_shared(counts[static_cast<int>(part_count::found)], 1);
        if (sizes[i] < least) add_shared(counts[static_cast<int>(part_count::left_out)], 1);
    }
};

// Leaves out the vertices of small components. kept[count] becomes 0, for a sum.
struct drop_vertices {
    vertex_sets sets;
    const std::uint64_t* sizes;
    std::uint64_t least, count;
    std::uint32_t* kept;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == count || sizes[sets.root(static_cast<std::uint32_t>(i))] < least) kept[i] = 0;
    }
};
struct drop_quads {
    const glm::uvec4* quads;
    const std::uint32_t* kept_vertices;
    std::uint64_t count;
    std::uint32_t* kept;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (i == count || kept_vertices[quads[i].x] == 0) kept[i] = 0;
    }
};

// What is kept moves together.
struct move_vertices {
    const std::uint32_t* kept;
    const std::uint64_t* places;
    const surface_vertex* from;
    const std::uint32_t* from_sources; // or null
    surface_vertex* to;
    std::uint32_t* to_sources;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (kept[i] == 0) return;
        to[places[i]] = from[i];
        if (from_sources != nullptr) to_sources[places[i]] = from_sources[i];
    }
};
struct move_quads {
    const std::uint32_t* kept;
    const std::uint64_t *places, *vertex_places;
    const glm::uvec4* from;
    glm::uvec4* to;
    VOXELPIPE_HD void operator()(std::uint64_t i) const {
        if (kept[i] == 0) return;
        const glm::uvec4 q = from[i];
        to[places[i]] = glm::uvec4(vertex_places[q.x], vertex_places[q.y], vertex_places[q.z], vertex_places[q.w]);
    }
};

// Zeros.
struct clear_counts {
    std::uint64_t* counts;
    VOXELPIPE_HD void operator()(std::uint64_t i) const { counts[i] = 0; }
};

} // namespace voxelpipe::core::passes
