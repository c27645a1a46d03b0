/* SPDX-FileCopyrightText: 2026 The VoxelPipe authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The C API of VoxelPipe: surfaces, solids, values of attributes, lists of voxels, distance fields, cut cells and links
 * of triangle meshes, with the bits of the C++ library. C99 and C++.
 *
 * Errors. Every call that can fail returns a vp_code; VP_OK is 0. vp_last_message() then has one line of English that
 * says what was wrong. No exception leaves the library and no argument ends the program, except memory that is not
 * what the caller says it is: a pointer that is not null has to be valid for the length that goes with it, and a handle
 * must not be used after it was destroyed. A call that fails has written nothing but the message.
 *
 * Handles are opaque. What vp_..._create or a call returned through a pointer to a handle belongs to the caller, who
 * passes it to its vp_..._destroy once; that of a null handle does nothing. A null handle anywhere else, and a handle
 * of another kind, are errors.
 *
 * Structures begin with struct_size, which the caller sets to sizeof the structure. Zeros in all other members of an
 * options structure are the defaults, and a null pointer to options is the same. Later versions add members at the end
 * only, and take the sizes of the earlier ones.
 *
 * Memory. The arrays of a call stay the caller's. A mesh copies what it is made from, and a list owns its voxels until
 * it is destroyed: nothing else is kept after a call. Lengths are uint64_t, strides are in bytes, enumerations are
 * int32_t with the values below. Axes are x, y, z; x is the one that runs fastest in memory. Triangles are
 * counter-clockwise seen from their front.
 *
 * Threads. Any number of threads may call the library, also with the same context, mesh and list, as long as none of
 * them destroys it; arrays that two calls write must not overlap. A call uses the threads of its context and returns
 * when its work is done. vp_last_message() belongs to the calling thread.
 */
#ifndef VOXELPIPE_H
#define VOXELPIPE_H

#include <stdint.h>

/* VP_BUILDS_LIBRARY is the library's own. */
#if defined(_WIN32) && defined(VP_BUILDS_LIBRARY)
#define VP_API __declspec(dllexport)
#elif defined(_WIN32)
#define VP_API __declspec(dllimport)
#else
#define VP_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The version of this interface, for vp_context_create. It changes only when a program has to be compiled again. */
#define VP_ABI_VERSION 1u

/* Results of calls. */
typedef int32_t vp_code;
enum {
    VP_OK = 0,
    VP_ERROR_NULL_HANDLE = 1,  /* a handle is null */
    VP_ERROR_WRONG_HANDLE = 2, /* a handle of another kind */
    VP_ERROR_NULL_POINTER = 3, /* a pointer is null that must not be */
    VP_ERROR_VERSION = 4,      /* another VP_ABI_VERSION, or a struct_size that this library does not know */
    VP_ERROR_BAD_INDEX = 5,    /* a triangle names a vertex that does not exist, or a range leaves a list */
    VP_ERROR_BAD_ARRAY = 6,    /* an array is too short, not aligned, of a wrong type, or its elements overlap */
    VP_ERROR_BAD_GRID = 7,     /* extent, crop, origin or voxel size */
    VP_ERROR_BAD_OPTION = 8,   /* a value that is none of its enumeration, or that does not go with the others */
    VP_ERROR_TOO_LARGE = 9,    /* more triangles or voxels than can be numbered */
    VP_ERROR_OUT_OF_MEMORY = 10,
    VP_ERROR_NO_BACKEND = 11, /* this library was built without the backend, or there is no device */
    VP_ERROR_INTERNAL = 12,   /* a fault of the library: please report the message */
    VP_ERROR_DEVICE = 13      /* the device of VP_BACKEND_CUDA failed; the message has CUDA's text */
};

/* VP_ABI_VERSION of the library that is loaded. */
VP_API uint32_t vp_abi_version(void);
/* Version of the library, such as "0.1.0". Static memory. */
VP_API const char* vp_version(void);
/* Name of a vp_code, such as "VP_ERROR_BAD_INDEX"; "unknown code" for another number. Static memory. */
VP_API const char* vp_code_name(vp_code code);
/* Of the calling thread's last call that returned a vp_code: why it failed, in one line of at most 511 bytes without a
 * final stop, or "". Valid until the thread's next such call. */
VP_API const char* vp_last_message(void);

/* ---- Contexts: where calls run ---------------------------------------------------------------------------------- */

typedef struct vp_context vp_context;

/* The results are the same bytes on each. VP_BACKEND_CUDA is the first device that CUDA shows the process
 * (CUDA_VISIBLE_DEVICES); arrays are the host's all the same: each call copies its mesh to the device and its results
 * back, on a stream of its own. */
enum {
    VP_BACKEND_CPU = 0,
    VP_BACKEND_CUDA = 1
};

/* abi_version: VP_ABI_VERSION. threads: at most 4096, 0 takes all cores; the results are the same for any
 * number, and with VP_BACKEND_CUDA they do the host's part. VP_ERROR_NO_BACKEND where the library was built without
 * CUDA, or where there is no device: a program that then takes VP_BACKEND_CPU has the same results. */
VP_API vp_code vp_context_create(uint32_t abi_version, int32_t backend, uint32_t threads, vp_context** context);
VP_API void vp_context_destroy(vp_context* context);

/* ---- Meshes ------------------------------------------------------------------------------------------------------ */

typedef struct vp_mesh vp_mesh;

/* A triangle mesh in the caller's memory. */
typedef struct vp_mesh_desc {
    uint32_t struct_size;
    uint32_t index_bytes;          /* of a vertex index, which is unsigned: 2, 4 or 8; 0: 4 */
    const float* positions;        /* x, y, z of a vertex */
    uint64_t num_vertices;         /* at most 2^32 */
    uint64_t position_stride;      /* bytes from vertex to vertex; 0: 12 */
    const void* triangles;         /* three indices from 0 each, one after the other */
    uint64_t num_triangles;        /* at most 2^32 - 1 */
    uint64_t triangle_stride;      /* bytes from triangle to triangle; 0: 3 * index_bytes */
    const uint64_t* first_of_part; /* of each part its first triangle, ascending from 0; null: one part */
    uint64_t num_parts;            /* parts are the bodies of VP_BODIES_EACH */
} vp_mesh_desc;

/* Copies the arrays, which need no alignment. VP_ERROR_BAD_INDEX names the first triangle with an index that is out of
 * range. */
VP_API vp_code vp_mesh_create(vp_context* context, const vp_mesh_desc* desc, vp_mesh** mesh);
VP_API void vp_mesh_destroy(vp_mesh* mesh);

/* ---- Grids ------------------------------------------------------------------------------------------------------- */

/* Voxel (i, j, k) of the whole grid is the closed box from origin + (i, j, k) * voxel_size to
 * origin + (i + 1, j + 1, k + 1) * voxel_size. A part of a grid gives, bit for bit, that part of what the whole gives.
 */
typedef struct vp_grid {
    uint32_t struct_size;
    uint32_t reserved;    /* 0 */
    double origin[3];     /* world position of the whole grid's low corner */
    double voxel_size[3]; /* world units, above 0 */
    uint64_t extent[3];   /* voxels to compute, 1 to 2^20 an axis */
    uint64_t offset[3];   /* the first of these in the whole grid */
    uint64_t whole[3];    /* extent of the whole grid; zeros: `extent`, with an offset of zeros */
} vp_grid;

/* The grids of the C++ functions fit_longest, fit and fit_voxel_size around the finite positions of a mesh. They fill
 * all members but struct_size, which is the caller's to set: n cubic voxels along the longest side; an extent; a voxel
 * size with `padding` more voxels on either side. */
VP_API vp_code vp_grid_fit_longest(const vp_mesh* mesh, uint64_t n, vp_grid* grid);
VP_API vp_code vp_grid_fit(const vp_mesh* mesh, const uint64_t extent[3], vp_grid* grid);
VP_API vp_code vp_grid_fit_voxel_size(const vp_mesh* mesh, const double voxel_size[3], uint64_t padding, vp_grid* grid);

/* ---- Arrays that calls write ------------------------------------------------------------------------------------- */

enum {
    VP_TYPE_UINT8 = 0,
    VP_TYPE_BITS = 1, /* uint32_t: 32 voxels along x, the lowest bit first; a row has (extent x + 31) / 32 elements */
    VP_TYPE_FLOAT32 = 2,
    VP_TYPE_INT64 = 3
};

/* A value, or a few, for each voxel. Aligned as its type is. Strides of zeros: packed, x fastest, the values of a voxel
 * side by side. Other strides are whole elements, and no two values may share memory. */
typedef struct vp_array {
    uint32_t struct_size;
    int32_t type;          /* VP_TYPE_... */
    void* data;            /* of voxel (0, 0, 0) */
    uint64_t size;         /* bytes from `data` on that may be written */
    uint64_t stride[3];    /* bytes from element to element along x, y, z */
    uint64_t value_stride; /* bytes between the values of one voxel */
} vp_array;

/* What a call counted; members that it does not count are 0. */
typedef struct vp_counters {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t triangles;           /* of the mesh */
    uint64_t triangles_dropped;   /* left out: a position that is not finite or too far from the grid */
    uint64_t triangles_zero_area; /* without an area on the grid's lattice of positions */
    uint64_t triangles_outside;   /* that miss the grid */
    uint64_t triangles_drawn;     /* the others */
    uint64_t fragments;           /* of triangles in voxels */
    uint64_t voxels;              /* that something was drawn into */
    uint64_t open_rows;           /* solids, distances, fractions: above 0 proves that the mesh is not closed */
    uint64_t crossings;           /* solids: of triangles with rows of voxels */
    uint64_t max_winding;         /* solids: greatest |winding number|; 0 for VP_FILL_EVEN_ODD */
    uint64_t hole_edges;          /* VP_REPAIR_CLOSE_HOLES, _WINDING: edges that no opposite edge cancels */
    uint64_t holes;               /* ... their connected components */
    uint64_t cones;               /* ... those that were closed */
    uint64_t band_samples;        /* distances: samples that hold their distance */
    uint64_t bad_points;          /* vp_distance_at: points that were refused */
    uint64_t cut_voxels;          /* fractions: voxels that a triangle's inside reaches */
    uint64_t below_zero;          /* fractions: below -2^-24 */
    uint64_t above_one;           /* fractions: above 1 + 2^-24 */
    uint64_t open_edges;          /* fractions: edges that no opposite edge cancels */
    double volume;                /* fractions: their sum, in voxels */
} vp_counters;

/* In every call below `counters` may be null. */

/* ---- Surfaces ---------------------------------------------------------------------------------------------------- */

enum {
    VP_COVERAGE_CONSERVATIVE = 0, /* every voxel whose closed box a triangle touches */
    VP_COVERAGE_THIN = 1,         /* one voxel in each column along a triangle's main axis */
    VP_COVERAGE_CROSSHAIR = 2,    /* a triangle meets a segment through the centre along an axis */
    VP_COVERAGE_DIAGONAL = 3      /* a triangle meets a segment through the centre from corner to corner */
};

typedef struct vp_surface_options {
    uint32_t struct_size;
    int32_t coverage; /* VP_COVERAGE_... */
} vp_surface_options;

/* 1 in voxels that the mesh covers, 0 in the others. out: VP_TYPE_UINT8 or VP_TYPE_BITS. */
VP_API vp_code vp_surface(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                          const vp_surface_options* options, const vp_array* out, vp_counters* counters);

/* ---- Solids ------------------------------------------------------------------------------------------------------ */

enum {
    VP_FILL_NONZERO = 0,  /* overlapping parts are inside */
    VP_FILL_EVEN_ODD = 1, /* the parity of crossings */
    VP_FILL_POSITIVE = 2  /* counter-clockwise ones only */
};
enum {
    VP_BODIES_ALL = 0, /* all triangles are one body */
    VP_BODIES_EACH = 1 /* each part of the mesh by itself; inside of any */
};
enum {
    VP_EXTENT_CENTRE = 0, /* voxels whose centre is inside */
    VP_EXTENT_OUTER = 1,  /* these, and those that a triangle touches */
    VP_EXTENT_INNER = 2   /* those whose centre is inside and that no triangle touches */
};
enum {
    VP_REPAIR_NONE = 0,
    VP_REPAIR_CLOSE_HOLES = 1, /* a cone over each hole's boundary */
    VP_REPAIR_EXTERIOR = 2,    /* what a flood from outside does not reach; fills cavities */
    VP_REPAIR_VOTE = 3,        /* what most of the closed rows along x, y and z call inside */
    VP_REPAIR_WINDING = 4      /* a generalized winding number of 1/2 or more; not with VP_FILL_EVEN_ODD */
};

/* VP_REPAIR_EXTERIOR and VP_REPAIR_VOTE have an inside of their own: fill and extent keep their defaults with them. */
typedef struct vp_solid_options {
    uint32_t struct_size;
    int32_t fill;            /* VP_FILL_... */
    int32_t bodies;          /* VP_BODIES_... */
    int32_t extent;          /* VP_EXTENT_... */
    int32_t repair;          /* VP_REPAIR_... */
    int32_t closing;         /* VP_REPAIR_EXTERIOR: gaps of up to about twice as many voxels are closed, 0 to 64 */
    uint64_t max_hole_edges; /* VP_REPAIR_CLOSE_HOLES, _WINDING: holes with more edges stay open; 0: none does */
} vp_solid_options;

/* 1 in voxels inside of the mesh, 0 in the others. out: VP_TYPE_UINT8 or VP_TYPE_BITS. */
VP_API vp_code vp_solid(vp_context* context, const vp_mesh* mesh, const vp_grid* grid, const vp_solid_options* options,
                        const vp_array* out, vp_counters* counters);

/* ---- Values of attributes ---------------------------------------------------------------------------------------- */

enum {
    VP_ROWS_PER_VERTEX = 0,  /* interpolated at the fragment's point on its triangle */
    VP_ROWS_PER_TRIANGLE = 1 /* as they are */
};
/* How the fragments of a voxel become one value. */
enum {
    VP_BLEND_MEAN = 0,
    VP_BLEND_SUM = 1,
    VP_BLEND_MIN = 2,
    VP_BLEND_MAX = 3,
    VP_BLEND_LAST = 4 /* that of the last triangle */
};

/* Rows of float attributes, one a vertex or one a triangle, in the caller's memory. */
typedef struct vp_rows {
    uint32_t struct_size;
    int32_t per;         /* VP_ROWS_... */
    int32_t blend;       /* VP_BLEND_... */
    uint32_t columns;    /* values of a row, 1 to 1024 */
    const float* values; /* aligned as float is */
    uint64_t num_rows;   /* vertices or triangles of the mesh */
    uint64_t row_stride; /* bytes, whole floats; 0: packed */
} vp_rows;

/* The values of voxels that the mesh covers; `background` (columns floats; null: zeros) in the others. out:
 * VP_TYPE_FLOAT32, `columns` values a voxel. */
VP_API vp_code vp_surface_values(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                                 const vp_surface_options* options, const vp_rows* rows, const float* background,
                                 const vp_array* out, vp_counters* counters);

/* ---- Lists of voxels, for grids that are mostly empty ------------------------------------------------------------ */

typedef struct vp_list vp_list;

/* The voxels that the mesh covers, in Morton order, with their values unless `rows` is null. Memory in proportion to
 * them. */
VP_API vp_code vp_surface_list(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                               const vp_surface_options* options, const vp_rows* rows, vp_list** list,
                               vp_counters* counters);
/* The voxels inside of the mesh, in Morton order. */
VP_API vp_code vp_solid_list(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                             const vp_solid_options* options, vp_list** list, vp_counters* counters);
/* Number of voxels, and of values of each; `columns` may be null. */
VP_API vp_code vp_list_size(const vp_list* list, uint64_t* voxels, uint32_t* columns);
/* Copies voxels [first, first + count). coordinates: 3 * count, the voxel's x, y, z in the computed part of the grid.
 * values: columns * count. Either may be null. VP_ERROR_BAD_INDEX for a range that leaves the list. */
VP_API vp_code vp_list_read(const vp_list* list, uint64_t first, uint64_t count, int32_t* coordinates, float* values);
VP_API void vp_list_destroy(vp_list* list);

/* ---- Distances --------------------------------------------------------------------------------------------------- */

/* With is_unsigned, fill, bodies, repair, closing and max_hole_edges keep their defaults. */
typedef struct vp_distance_options {
    uint32_t struct_size;
    int32_t is_whole;    /* not 0: every sample holds its distance, and band is 0 */
    double band;         /* largest voxel sizes from the mesh to which samples hold theirs; 0: 3 */
    int32_t at_corners;  /* not 0: samples at the corners of voxels, one more an axis; else at the centres */
    int32_t is_unsigned; /* not 0: distances are not negative; else they are inside */
    int32_t fill, bodies, repair, closing; /* of the sign, as in vp_solid_options */
    uint64_t max_hole_edges;
} vp_distance_options;

/* Distances in world units, negative inside; beyond the band plus or minus the band's. out: VP_TYPE_FLOAT32. nearest:
 * VP_TYPE_INT64, the number of the nearest triangle, -1 beyond the band; may be null. */
VP_API vp_code vp_distance(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                           const vp_distance_options* options, const vp_array* out, const vp_array* nearest,
                           vp_counters* counters);
/* Distances of any points (x, y, z; point_stride bytes apart, 0: 12), which snap to the grid's lattice of positions.
 * options: band and at_corners are ignored, VP_REPAIR_EXTERIOR and VP_REPAIR_VOTE refused. Either of distances (NaN for
 * a point that is not finite) and nearest (-1 for such a one, or for an empty mesh) may be null; num_points each. */
VP_API vp_code vp_distance_at(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                              const vp_distance_options* options, const float* points, uint64_t num_points,
                              uint64_t point_stride, float* distances, int64_t* nearest, vp_counters* counters);

/* ---- Cut cells --------------------------------------------------------------------------------------------------- */

typedef struct vp_fraction_options {
    uint32_t struct_size;
    int32_t axis; /* that rows run along: 0 to 2 */
} vp_fraction_options;

/* How much of each voxel is inside, 0 to 1 for closed meshes without overlaps: computed, not sampled. out:
 * VP_TYPE_FLOAT32. */
VP_API vp_code vp_fractions(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                            const vp_fraction_options* options, const vp_array* out, vp_counters* counters);

/* ---- Links: walls between the nodes of lattice Boltzmann solvers ------------------------------------------------- */

/* The voxels of which a link is crossed. A link goes from a voxel's centre to that of a neighbour, which may lie beyond
 * the grid. */
typedef struct vp_links vp_links;

typedef struct vp_link_options {
    uint32_t struct_size;
    int32_t neighbours; /* of a voxel: 18, through faces and edges (D3Q19); 26, corners too (D3Q27); 0: 18 */
} vp_link_options;

/* The step x, y, z to the neighbour that link 0 to 25 leads to: 0 to 5 through faces, to 17 through edges, the others
 * through corners. Links i and i ^ 1 are opposite each other. */
VP_API vp_code vp_link_direction(int32_t link, int32_t direction[3]);

/* Where the mesh, which may be open, crosses links: exact, on a closed mesh between all voxels that VP_EXTENT_CENTRE
 * parts. counters: `voxels` with a crossed link, `fragments` the crossed links. */
VP_API vp_code vp_links_create(vp_context* context, const vp_mesh* mesh, const vp_grid* grid,
                               const vp_link_options* options, vp_links** links, vp_counters* counters);
/* Number of voxels, which lie by z, then y, then x, and of links of each; `neighbours` may be null. */
VP_API vp_code vp_links_size(const vp_links* links, uint64_t* voxels, uint32_t* neighbours);
/* Copies voxels [first, first + count). coordinates: 3 * count, the voxel's x, y, z in the computed part of the grid.
 * The others have neighbours * count elements, -1 for a link that is not crossed. q: the part of the link before its
 * first crossing, above 0 to 1, rounded once. triangles, parts: the triangle of the mesh that is crossed there, and its
 * part. Each may be null. VP_ERROR_BAD_INDEX for a range that leaves the list. */
VP_API vp_code vp_links_read(const vp_links* links, uint64_t first, uint64_t count, int32_t* coordinates, float* q,
                             int64_t* triangles, int32_t* parts);
VP_API void vp_links_destroy(vp_links* links);

#ifdef __cplusplus
}
#endif

#endif
