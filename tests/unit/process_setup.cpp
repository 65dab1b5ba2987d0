// SPDX-License-Identifier: MIT
// Stacks of helper threads, where the memory of the process is locked.
#include <algorithm>
#include <pthread.h>
#include <sys/mman.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

#include "execute/process_setup.hpp"

namespace hal::test {
namespace {

/// Of the calling thread's stack, in pages.
std::size_t resident_stack_pages() {
    pthread_attr_t attributes;
    pthread_getattr_np(pthread_self(), &attributes);
    void* lowest = nullptr;
    std::size_t size = 0;
    pthread_attr_getstack(&attributes, &lowest, &size);
    pthread_attr_destroy(&attributes);
    std::vector<unsigned char> pages(size / static_cast<std::size_t>(sysconf(_SC_PAGESIZE)));
    EXPECT_EQ(mincore(lowest, size, pages.data()), 0);
    return static_cast<std::size_t>(
        std::count_if(pages.begin(), pages.end(), [](unsigned char page) { return page & 1; }));
}

[[gnu::noinline]] void touch_stack() {
    volatile char used[1 << 19];
    for (std::size_t i = 0; i < sizeof used; i += 4096) {
        used[i] = 0;
    }
}

TEST(ProcessSetup, release_unused_stack_frees_what_is_below_the_frame_and_leaves_it_usable) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "stacks are not released under a sanitizer";
#endif
    limit_helper_stacks();
    std::size_t touched = 0;
    std::size_t released = 0;
    std::size_t touched_again = 0;
    std::thread helper([&] {
        touch_stack();
        touched = resident_stack_pages();
        release_unused_stack();
        released = resident_stack_pages();
        touch_stack();
        touched_again = resident_stack_pages();
    });
    helper.join();
    EXPECT_GE(touched, 128u);
    EXPECT_LE(released, 24u);
    EXPECT_GE(touched_again, 128u);
}

}  // namespace
}  // namespace hal::test
