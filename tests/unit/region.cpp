// SPDX-License-Identifier: MIT
#include "base/region.hpp"

#include <algorithm>
#include <cstdint>
#include <gtest/gtest.h>
#include <memory>
#include <string>
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

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && __SIZEOF_POINTER__ == 8

std::uint64_t place_of(const void* memory) { return reinterpret_cast<std::uint64_t>(memory); }

TEST(Region, Has_the_small_blocks_of_a_scope_side_by_side) {
    const region::Scope outer;
    std::unique_ptr<int> first;
    {
        const region::Scope inner;
        first = std::make_unique<int>(1);
    }
    const auto second = std::make_unique<int>(2);
    const auto large = std::make_unique<std::vector<char>>(100'000);
    EXPECT_TRUE(region::has(first.get()));
    EXPECT_EQ(place_of(first.get()) + 16, place_of(second.get()));
    EXPECT_FALSE(region::has(large->data()));
}

TEST(Region, Aligns_its_blocks) {
    const region::Scope scope;
    for (const std::size_t alignment : {16, 64, 4096}) {
        void* const odd = ::operator new(1);
        void* const memory = ::operator new(alignment, std::align_val_t{alignment});
        EXPECT_TRUE(region::has(memory));
        EXPECT_EQ(0U, place_of(memory) % alignment);
        ::operator delete(memory, std::align_val_t{alignment});
        ::operator delete(odd);
    }
}

TEST(Region, Uses_the_place_of_the_newest_block_again) {
    const region::Scope scope;
    auto first = std::make_unique<int>(1);
    const std::uint64_t place = place_of(first.get());
    first.reset();
    const auto second = std::make_unique<int>(2);
    EXPECT_EQ(place, place_of(second.get()));
}

TEST(Region, Keeps_a_block_after_its_scope_and_frees_it_on_any_thread) {
    const std::size_t before = region::chunks_in_use();
    std::vector<std::unique_ptr<std::string>> texts;
    {
        const region::Scope scope;
        for (int i = 0; i < 20'000; ++i) {
            texts.push_back(std::make_unique<std::string>(100, 'x'));
        }
        EXPECT_LT(before + 5, region::chunks_in_use());
    }
    EXPECT_LT(before + 5, region::chunks_in_use());
    EXPECT_EQ(std::string(100, 'x'), *texts.back());
    std::thread([&texts] { texts.clear(); }).join();
    texts.shrink_to_fit();
    EXPECT_EQ(before, region::chunks_in_use());
}

TEST(Region, Uses_chunks_without_a_live_block_again) {
    const std::size_t before = region::chunks_in_use();
    std::size_t most = 0;
    for (int round = 0; round < 50; ++round) {
        const region::Scope scope;
        std::vector<std::unique_ptr<char[]>> blocks;
        for (int i = 0; i < 1000; ++i) {
            blocks.push_back(std::make_unique<char[]>(1000));
        }
        most = std::max(most, region::chunks_in_use());
    }
    EXPECT_LT(most, before + 10);
    EXPECT_EQ(before, region::chunks_in_use());
}

#endif

}  // namespace
}  // namespace hal
