// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// A libcuda.so.1 that serves the CUDA version STAND_IN_VERSION and whose every other call returns STAND_IN_RESULT: as
// much of a driver as the CUDA runtime asks before it gives up.

#include <cstdint>
#include <cstring>

extern "C" {

int cuDriverGetVersion(int* version) {
    *version = STAND_IN_VERSION;
    return 0;
}

int any_function() { return STAND_IN_RESULT; }

int cuGetExportTable(const void** table, const void*) {
    *table = nullptr;
    return STAND_IN_RESULT;
}

int cuGetProcAddress_v2(const char* name, void** function, int, std::uint64_t, void*) {
    const auto is = [name](const char* other) { return std::strcmp(name, other) == 0; };
    *function = is("cuDriverGetVersion") ? reinterpret_cast<void*>(cuDriverGetVersion)
                : is("cuGetExportTable") ? reinterpret_cast<void*>(cuGetExportTable)
                : is("cuGetProcAddress") ? reinterpret_cast<void*>(cuGetProcAddress_v2)
                                         : reinterpret_cast<void*>(any_function);
    return 0;
}

int cuGetProcAddress(const char* name, void** function, int version, std::uint64_t flags) {
    return cuGetProcAddress_v2(name, function, version, flags, nullptr);
}

int cuInit(unsigned) { return STAND_IN_RESULT; }

} // extern "C"
