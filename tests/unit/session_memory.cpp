// SPDX-License-Identifier: MIT
// The end of memory at every single allocation of an edit: the edit succeeds, or it fails and
// nothing has changed.
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <dlfcn.h>
#include <malloc.h>
#include <new>
#include <pthread.h>

#include "machine.hpp"
#include "plugins/watch.hpp"

namespace {

// Counts allocations of this thread while it is armed; fails one, or all from one on until a number
// of bytes was freed.
struct Shortage {
    bool armed = false;
    long refuse = -1;
    long made = 0;
    bool lasting = false;
    long given_back = 0;
};
thread_local Shortage shortage;

void* take(std::size_t bytes, std::size_t align) {
    if (shortage.armed) {
        const long number = shortage.made++;
        const bool refused = shortage.lasting
                                 ? number >= shortage.refuse && shortage.given_back < (1 << 19)
                                 : number == shortage.refuse;
        if (shortage.refuse >= 0 && refused) throw std::bad_alloc();
    }
    void* const memory = align > alignof(std::max_align_t)
                             ? std::aligned_alloc(align, (bytes + align - 1) / align * align)
                             : std::malloc(bytes ? bytes : 1);
    if (!memory) throw std::bad_alloc();
    return memory;
}

void give(void* memory, std::size_t bytes) noexcept {
    if (shortage.armed) {
        shortage.given_back += static_cast<long>(bytes);
    }
    std::free(memory);
}

}  // namespace

void* operator new(std::size_t bytes) { return take(bytes, 0); }
void* operator new[](std::size_t bytes) { return take(bytes, 0); }
void* operator new(std::size_t bytes, std::align_val_t align) {
    return take(bytes, static_cast<std::size_t>(align));
}
void* operator new[](std::size_t bytes, std::align_val_t align) {
    return take(bytes, static_cast<std::size_t>(align));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
    try {
        return take(bytes, 0);
    } catch (const std::bad_alloc&) {
        return nullptr;
    }
}
void* operator new[](std::size_t bytes, const std::nothrow_t& none) noexcept {
    return operator new(bytes, none);
}
void operator delete(void* memory) noexcept { give(memory, 0); }
void operator delete[](void* memory) noexcept { give(memory, malloc_usable_size(memory)); }
void operator delete(void* memory, std::size_t) noexcept { give(memory, 0); }
void operator delete[](void* memory, std::size_t) noexcept {
    give(memory, malloc_usable_size(memory));
}
void operator delete(void* memory, std::align_val_t) noexcept { give(memory, 0); }
void operator delete[](void* memory, std::align_val_t) noexcept { give(memory, 0); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { give(memory, 0); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { give(memory, 0); }

#if !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__) && !defined(HALCYON_RT_GUARD)
static std::atomic<bool> refuse_threads{false};

extern "C" [[gnu::visibility("default")]] int pthread_create(pthread_t* thread,
                                                             const pthread_attr_t* attributes,
                                                             void* (*run)(void*), void* self) {
    if (refuse_threads) return EAGAIN;
    static const auto real =
        reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
    return real(thread, attributes, run, self);
}
#else
static bool refuse_threads = false;
#endif

namespace hal::test {
namespace {

const char* const machine_text =
    "loadrt threads name1=t period1=1000000 name2=u period2=2000000\nloadrt test-counter "
    "names=a,b\nloadrt test-types names=x,y\nloadrt test-shared count=2\nloadrt test-port "
    "names=p,q\n"
    "loadrt test-two names=w\nloadrt test-life names=h\naddf a t\naddf b u\naddf x t\naddf "
    "test-shared.update t\nnet s a.sum => b.step\nnet i x.s64-in\nnet io x.bit-io y.bit-io\n"
    "net stream p.to => q.from\nsets stream 16\nalias pin x.u32-in speed\naddf h u\nnet level "
    "h.level\n";

struct Memory : testing::TestWithParam<std::tuple<const char*, bool>> {};

// One edit with the n-th allocation failing, for n = 0, 1, 2 …, until an edit needs fewer than n.
TEST_P(Memory, running_out_at_any_allocation_changes_nothing_or_all) {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "one thread only, and the address sanitizer looks closer";
#endif
#if defined(HALCYON_EMULATED)
    GTEST_SKIP() << "an emulator takes an hour for thousands of machines, and nothing of it "
                    "depends on the processor";
#endif
    const auto& [edit, lasting] = GetParam();
    Machine machine;
    machine.must(machine_text);
    machine.start();
    machine.cycles(3);
    // a thread that was ended and made again has made its outputs safe, so their values are not
    // compared
    const bool values = !std::string_view(edit).starts_with("delthread") &&
                        !std::string_view(edit).starts_with("unloadrt all");
    std::string before = machine.dump(values);
    const auto source = machine.session.sources.add("edit", edit);
    Diagnostics none;
    const std::vector<Command> commands = parse(machine.session.sources, source, {}, none);
    int refused = 0;
    for (long n = 0;; ++n) {
        ASSERT_LT(n, 20'000);
        Diagnostics diagnostics;
        bool good = false;
        shortage = {true, n, 0, lasting, 0};
        hal::Transaction transaction = machine.session.begin();
        for (const Command& command : commands) {
            apply_edit(transaction, command, diagnostics);
        }
        good = transaction.commit(diagnostics);
        const bool reached = shortage.made > n;
        shortage = {};
        if (good && !reached) {
            break;  // it has worked with every allocation granted
        }
        ASSERT_FALSE(good) << "allocation " << n << " failed, but the edit took effect";
        ++refused;
        const std::string said = render(diagnostics, machine.session.sources);
        // what a constructor itself could not get is its own reason
        ASSERT_TRUE(said.find("[out-of-memory]") != std::string::npos ||
                    said.find("std::bad_alloc [") != std::string::npos)
            << "allocation " << n << ": " << said;
        ASSERT_EQ(machine.dump(values), before) << "allocation " << n;
        machine.cycles(1);
        ASSERT_EQ(machine.get("t.threadbeat"), std::to_string(3 + refused));
        before = machine.dump(values);  // the counters went on
    }
    EXPECT_GT(refused, 5);
}

INSTANTIATE_TEST_SUITE_P(
    Edit, Memory,
    testing::Combine(
        testing::Values("loadrt test-counter names=new\naddf new t 1\nnet n new.sum => y.float-in",
                        "loadrt test-life names=new", "loadrt test-shared count=2 kind=1,2",
                        "newthread v 4000000\ndelf a t\naddf a v", "delthread u",
                        "unloadrt a\nunloadrt test-shared", "unloadrt all", "delsig all",
                        "unlinkp a.sum\nsets s 3", "net fresh y.u64-out\nnewsig f2 port\nsets f2 8",
                        "setp x.float-in 3\nsetp y.float-in 4\nsets i 5",
                        "alias pin y.u32-in other\nunalias pin speed", "addf --auto u",
                        "reload test-counter\nreload test-shared\nunlinkp b.step",
                        "reload test-types\nreload test-port", "reload test-life"),
        testing::Bool()),
    [](const auto& edit) { return std::to_string(edit.index); });

TEST(A_thread_that_the_system_cannot_create, rolls_back_the_edit) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__) || defined(HALCYON_RT_GUARD)
    GTEST_SKIP() << "the sanitizer stands before pthread_create itself";
#endif
    Machine machine(Clock::real);
    machine.must("newthread first 1000000\nloadrt test-counter names=c\naddf c first");
    machine.start();
    refuse_threads = true;
    machine.rejected(
        "newthread second 2000000\nloadrt test-life names=x\naddf x second\nsetp c.step 4",
        "thread-refused");
    refuse_threads = false;
    EXPECT_NE(machine.said.find("thread 'second' cannot be created: the system gives no thread: "
                                "Resource temporarily unavailable"),
              std::string::npos)
        << machine.said;
    machine.must("newthread second 2000000\nloadrt test-counter names=d\naddf d second");
    EXPECT_TRUE(
        eventually([&] { return machine.number("d.count") > 3 && machine.number("c.count") > 3; }));
}

}  // namespace
}  // namespace hal::test
