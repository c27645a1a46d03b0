// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// The state of exceptions of each thread, in place of that of the libstdc++ that is linked into this library. That one
// is thread-local memory which glibc allocates when a thread first throws, where the library was loaded by dlopen, as
// bindings do: without memory, glibc then ends the program, and a call that should report it cannot. The memory here is
// there when the thread starts. CUDA's runtime has a page of thread-local memory, aligned as one, for which a program
// that is running has no room: with it all such memory of the library is allocated late.

#include <cxxabi.h>

namespace {

#if defined(VOXELPIPE_CAPI_CUDA)
#define VOXELPIPE_EARLY_MEMORY
#else
#define VOXELPIPE_EARLY_MEMORY __attribute__((tls_model("initial-exec")))
#endif

// As __cxa_eh_globals: a pointer, a number, and on ARM another pointer.
VOXELPIPE_EARLY_MEMORY thread_local void* exception_state[3] = {};

} // namespace

namespace __cxxabiv1 { // NOLINT(bugprone-reserved-identifier): the names of the C++ ABI

extern "C" __cxa_eh_globals* __cxa_get_globals() noexcept {
    return reinterpret_cast<__cxa_eh_globals*>(exception_state);
}
extern "C" __cxa_eh_globals* __cxa_get_globals_fast() noexcept {
    return reinterpret_cast<__cxa_eh_globals*>(exception_state);
}

} // namespace __cxxabiv1
