// SPDX-License-Identifier: MIT
#include "base/region.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <gtest/gtest.h>
#include <memory>
#include <sys/mman.h>
#include <sys/resource.h>
#include <thread>
#include <vector>

namespace hal {
namespace {

TEST(Region, Has_no_memory_outside_of_a_scope) {
    EXPECT_EQ(nullptr, region::allocate(16, 16));
    const auto number = std::make_unique<int>(1);
    EXPECT_FALSE(region::has(number.get()));
    EXPECT_FALSE(region::has(nullptr));
}

#if __SIZEOF_POINTER__ == 8

std::uint64_t place_of(const void* memory) { return reinterpret_cast<std::uint64_t>(memory); }

/// A block of the calling thread's scope.
void* block_of_bytes(std::size_t bytes, std::size_t alignment = 16) {
    void* const block = region::allocate(bytes, alignment);
    EXPECT_TRUE(region::has(block));
    std::memset(block, 0xa5, bytes);
    return block;
}

TEST(Region, Has_the_blocks_of_nested_scopes_side_by_side) {
    const region::Scope outer;
    void* first = nullptr;
    {
        const region::Scope inner;
        first = block_of_bytes(1);
    }
    void* const second = block_of_bytes(17);
    void* const third = block_of_bytes(1);
    EXPECT_EQ(place_of(first) + 16, place_of(second));
    EXPECT_EQ(place_of(second) + 32, place_of(third));
    region::release(first, 1);
    region::release(second, 17);
    region::release(third, 1);
}

TEST(Region, Is_not_resident_as_a_whole_in_a_program_that_locks_its_memory) {
    const region::Scope scope;
    void* const block = block_of_bytes(16);
    if (::mlockall(MCL_CURRENT) != 0) GTEST_SKIP() << "memory cannot be locked";
    ::munlockall();
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    EXPECT_LT(usage.ru_maxrss, 2'000'000);  // KiB
    region::release(block, 16);
}

TEST(Region, Leaves_large_and_widely_aligned_blocks_to_others) {
    const region::Scope scope;
    EXPECT_EQ(nullptr, region::allocate(100'000, 16));
    EXPECT_EQ(nullptr, region::allocate(16, 8192));
}

TEST(Region, Aligns_its_blocks) {
    const region::Scope scope;
    for (const std::size_t alignment : {16, 64, 4096}) {
        void* const odd = block_of_bytes(1);
        void* const aligned = block_of_bytes(alignment, alignment);
        EXPECT_EQ(0U, place_of(aligned) % alignment);
        region::release(aligned, 0);
        region::release(odd, 0);
    }
}

TEST(Region, Uses_the_place_of_the_newest_block_again) {
    const region::Scope scope;
    void* const older = block_of_bytes(40);
    void* const newest = block_of_bytes(40);
    region::release(newest, 40);
    EXPECT_EQ(newest, block_of_bytes(8));
    region::release(older, 40);
    EXPECT_NE(older, block_of_bytes(8));
}

TEST(Region, Keeps_a_block_after_its_scope_and_frees_it_on_any_thread) {
    const std::size_t before = region::chunks_in_use();
    std::vector<void*> blocks;
    {
        const region::Scope scope;
        for (int i = 0; i < 20'000; ++i) {
            blocks.push_back(block_of_bytes(100));
        }
    }
    EXPECT_LT(before + 5, region::chunks_in_use());
    std::thread([&blocks] {
        for (void* const block : blocks) {
            region::release(block, 100);
        }
    }).join();
    EXPECT_EQ(before, region::chunks_in_use());
}

TEST(Region, Uses_chunks_without_a_live_block_again) {
    const std::size_t before = region::chunks_in_use();
    std::size_t most = 0;
    for (int round = 0; round < 50; ++round) {
        const region::Scope scope;
        std::vector<void*> blocks;
        for (int i = 0; i < 1000; ++i) {
            blocks.push_back(block_of_bytes(1000));
        }
        most = std::max(most, region::chunks_in_use());
        for (void* const block : blocks) {
            region::release(block, 1000);
        }
    }
    EXPECT_LT(most, before + 10);
    EXPECT_EQ(before, region::chunks_in_use());
}

#endif

}  // namespace
}  // namespace hal
