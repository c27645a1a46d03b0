// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include <emulation/block.hpp>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <sys/mman.h>
#include <ucontext.h>
#if __has_include(<valgrind/valgrind.h>)
#include <valgrind/valgrind.h>
#endif
#include <vector>

uint3 threadIdx, blockIdx;
dim3 blockDim, gridDim;

namespace emulation {

namespace {

constexpr unsigned warp_size = 32, max_threads = 1024;
constexpr std::size_t stack_bytes = std::size_t{1} << 20; // of address space; pages are allocated on first use
constexpr std::size_t max_shared_bytes = 227 * 1024;
alignas(1024) unsigned char shared_bytes_of_block[max_shared_bytes];

[[noreturn]] void fail(const char* what) {
    std::fprintf(stderr, "emulated block %u of %u, thread %u: %s\n", blockIdx.x, gridDim.x, threadIdx.x, what);
    std::abort();
}

// For the compiler's built-in setjmp, which does not check whether a jump leaves its stack. Functions that call it must
// not be inlined.
using jump_buffer = void* [5];
[[noreturn]] __attribute__((noinline)) void jump(jump_buffer& to) { __builtin_longjmp(to, 1); }

enum class state { ready, waits, ended };

struct fiber {
    state is = state::ended;
    bool exists = false; // stack and context, from its first block on
    jump_buffer at{};
    std::uint64_t value = 0, result = 0; // exchanged when lanes meet
    unsigned from = 0;
};

// Lanes of one mask that wait for the other lanes of the mask.
struct meeting {
    unsigned mask = 0, arrived = 0;
    meeting_kind kind{};
};

struct warp {
    unsigned ended = 0;        // lanes that have ended or that the block does not have
    meeting places[warp_size]; // those where some lane waits
    meeting& of(unsigned mask) {
        for (meeting& m : places)
            if (m.arrived != 0 && m.mask == mask) return m;
        for (meeting& m : places)
            if (m.arrived == 0) return m;
        fail("more meetings than lanes");
    }
};

class block {
public:
    block() : fibers_(max_threads), warps_(max_threads / warp_size), random_(seed()) {
        void* const p = mmap(nullptr, stack_bytes * max_threads, PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
        if (p == MAP_FAILED) fail("no room for stacks");
        stacks_ = static_cast<unsigned char*>(p);
        tell_valgrind();
    }
    block(const block&) = delete;
    block& operator=(const block&) = delete;
    ~block() { munmap(stacks_, stack_bytes * max_threads); }

    // Runs blockDim.x threads.
    void run(const std::function<void()>& body) {
        if (body_ != nullptr) fail("a kernel that starts kernels");
        body_ = &body;
        num_threads_ = blockDim.x;
        num_ended_ = num_arrived_ = num_true_ = 0;
        for (unsigned i = 0; i < num_threads_; ++i) {
            fiber& f = fibers_[i];
            f.is = state::ready;
        }
        for (unsigned w = 0; w * warp_size < num_threads_; ++w) {
            const unsigned lanes = num_threads_ - w * warp_size;
            warps_[w] = {};
            warps_[w].ended = lanes < warp_size ? ~0u << lanes : 0;
        }
        while (num_ended_ < num_threads_) {
            bool any = false;
            const unsigned turn = static_cast<unsigned>(random_()) % num_threads_;
            for (unsigned k = 0; k < num_threads_; ++k) {
                const unsigned i = k + turn < num_threads_ ? k + turn : k + turn - num_threads_;
                if (fibers_[i].is != state::ready) continue;
                any = true;
                resume(i);
            }
            if (!any) stuck();
        }
        body_ = nullptr;
    }

    std::uint64_t meet(meeting_kind kind, unsigned mask, std::uint64_t value, unsigned from) {
        fiber& f = fibers_[running_];
        const unsigned lane = running_ % warp_size;
        warp& w = warps_[running_ / warp_size];
        if ((mask >> lane & 1u) == 0) fail("a lane that its own mask does not name");
        meeting& m = w.of(mask);
        if (m.arrived == 0) {
            m.mask = mask;
            m.kind = kind;
        }
        if (m.kind != kind) fail("lanes of one warp wait for one another in different functions");
        f.value = value;
        f.from = from;
        m.arrived |= 1u << lane;
        f.is = state::waits;
        end_where_all_are_here(running_ / warp_size, m);
        if (f.is == state::waits) leave();
        return f.result;
    }

    unsigned meet_block(bool predicate) {
        fiber& f = fibers_[running_];
        f.is = state::waits;
        ++num_arrived_;
        num_true_ += predicate;
        in_barrier_.push_back(running_);
        end_barrier_where_all_are_here();
        if (f.is == state::waits) leave();
        return static_cast<unsigned>(f.result);
    }

private:
    // Else it takes a jump to another thread for the end of functions, and what their stack holds for lost.
    void tell_valgrind() const {
#if __has_include(<valgrind/valgrind.h>)
        if (RUNNING_ON_VALGRIND == 0) return;
        for (std::size_t i = 0; i < max_threads; ++i)
            (void)VALGRIND_STACK_REGISTER(stacks_ + stack_bytes * i, stacks_ + stack_bytes * (i + 1));
#endif
    }

    static unsigned seed() {
        const char* const text = std::getenv("VOXELPIPE_EMULATION_SEED");
        return text == nullptr ? 1u : static_cast<unsigned>(std::strtoul(text, nullptr, 10));
    }

    __attribute__((noinline)) void resume(unsigned i) {
        running_ = i;
        fiber& f = fibers_[i];
        threadIdx = {i, 0, 0};
        if (__builtin_setjmp(scheduler_) != 0) return;
        if (f.exists) jump(f.at);
        f.exists = true;
        ucontext_t c;
        getcontext(&c);
        c.uc_stack.ss_sp = stacks_ + stack_bytes * i;
        c.uc_stack.ss_size = stack_bytes;
        c.uc_link = nullptr;
        self = this;
        makecontext(&c, &block::begin, 0);
        setcontext(&c);
        fail("no context");
    }
    __attribute__((noinline)) void leave() {
        if (__builtin_setjmp(fibers_[running_].at) == 0) jump(scheduler_);
    }
    // The main loop of a fiber: one thread of one block after another.
    static void begin() {
        block& b = *self;
        for (;;) {
            (*b.body_)();
            const unsigned i = b.running_;
            b.fibers_[i].is = state::ended;
            ++b.num_ended_;
            warp& w = b.warps_[i / warp_size];
            w.ended |= 1u << i % warp_size;
            for (meeting& m : w.places)
                if (m.arrived != 0) b.end_where_all_are_here(i / warp_size, m);
            b.end_barrier_where_all_are_here();
            b.leave();
        }
    }

    void end_barrier_where_all_are_here() {
        if (num_arrived_ == 0 || num_arrived_ + num_ended_ < num_threads_) return;
        for (const unsigned i : in_barrier_) {
            fibers_[i].result = num_true_;
            fibers_[i].is = state::ready;
        }
        in_barrier_.clear();
        num_arrived_ = num_true_ = 0;
    }

    void end_where_all_are_here(unsigned number, meeting& m) {
        if ((m.mask & ~(m.arrived | warps_[number].ended)) != 0) return;
        fiber* const lanes = fibers_.data() + std::size_t{number} * warp_size;
        const unsigned arrived = m.arrived;
        m.arrived = 0;
        const auto each = [&](const auto& f) {
            for (unsigned rest = arrived; rest != 0; rest &= rest - 1) {
                const auto lane = static_cast<unsigned>(__builtin_ctz(rest));
                f(lane, lanes[lane]);
            }
        };
        std::uint64_t all = 0; // the result of every lane, for most kinds
        each([&](unsigned lane, const fiber& f) {
            switch (m.kind) {
            case meeting_kind::ballot:
            case meeting_kind::any:
            case meeting_kind::all:
                all |= std::uint64_t{f.value != 0} << lane;
                break;
            case meeting_kind::add:
                all += f.value;
                break;
            case meeting_kind::maximum:
                all = f.value > all ? f.value : all;
                break;
            case meeting_kind::disjunction:
                all |= f.value;
                break;
            default:
                break;
            }
        });
        if (m.kind == meeting_kind::any) all = all != 0;
        if (m.kind == meeting_kind::all) all = all == arrived;
        each([&](unsigned, fiber& f) {
            f.result = all;
            if (m.kind == meeting_kind::match) {
                f.result = 0;
                each([&](unsigned other, const fiber& g) { f.result |= std::uint64_t{g.value == f.value} << other; });
            }
            if (m.kind == meeting_kind::shuffle) {
                if ((arrived >> f.from & 1u) == 0) fail("a value is asked of a lane that does not take part");
                f.result = lanes[f.from].value;
            }
        });
        each([&](unsigned, fiber& f) { f.is = state::ready; });
    }

    [[noreturn]] void stuck() const {
        for (unsigned w = 0; w * warp_size < num_threads_; ++w)
            for (const meeting& m : warps_[w].places)
                if (m.arrived != 0)
                    std::fprintf(stderr, "warp %u: lanes %08x of %08x wait (kind %d), %08x have ended\n", w, m.arrived,
                                 m.mask, static_cast<int>(m.kind), warps_[w].ended);
        std::fprintf(stderr, "%u of %u threads wait for the block, %u have ended\n", num_arrived_, num_threads_,
                     num_ended_);
        fail("threads wait for one another at different places");
    }

    static block* self;
    const std::function<void()>* body_ = nullptr;
    std::vector<fiber> fibers_;
    std::vector<warp> warps_;
    std::vector<unsigned> in_barrier_;
    std::minstd_rand random_;
    unsigned char* stacks_ = nullptr;
    jump_buffer scheduler_{};
    unsigned num_threads_ = 0, num_ended_ = 0, num_arrived_ = 0, num_true_ = 0, running_ = 0;
};
block* block::self = nullptr;

block& the_block() {
    static const auto b = std::make_unique<block>();
    return *b;
}

} // namespace

void run_grid(dim3 blocks, dim3 threads, std::size_t shared_bytes, const std::function<void()>& body) {
    if (threads.x > max_threads || threads.y * threads.z * blocks.y * blocks.z != 1) fail("grids along x only");
    if (shared_bytes > max_shared_bytes) fail("more shared memory than a block has");
    blockDim = threads;
    gridDim = blocks;
    for (unsigned i = 0; i < blocks.x; ++i) {
        blockIdx = {i, 0, 0};
        std::memset(shared_bytes_of_block, 0xcd, shared_bytes);
        the_block().run(body);
    }
}

std::uint64_t meet(meeting_kind kind, unsigned mask, std::uint64_t value, unsigned from) {
    return the_block().meet(kind, mask, value, from);
}
unsigned meet_block(bool predicate) { return the_block().meet_block(predicate); }

unsigned char* dynamic_shared() { return shared_bytes_of_block; }
std::uint32_t shared_address(const void* p) {
    const std::intptr_t d = reinterpret_cast<std::intptr_t>(p) - reinterpret_cast<std::intptr_t>(shared_bytes_of_block);
    if (d != static_cast<std::int32_t>(d)) fail("an address that is not one of shared memory");
    return static_cast<std::uint32_t>(d);
}
void* shared_pointer(std::uint32_t address) {
    return reinterpret_cast<void*>(reinterpret_cast<std::intptr_t>(shared_bytes_of_block) + // another array's
                                   static_cast<std::int32_t>(address));
}

} // namespace emulation
