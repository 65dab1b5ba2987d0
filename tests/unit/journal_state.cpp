// SPDX-License-Identifier: MIT
#include <cstdint>
#include <gtest/gtest.h>
#include <string>
#include <sys/mman.h>
#include <sys/resource.h>

#include "journal/component_heap.hpp"
#include "journal/machine_state.hpp"
#include "machine.hpp"

namespace hal::test {
namespace {

TEST(MachineState, Of_another_version_is_rejected) {
    Machine machine;
    const std::string state = MachineState(machine.session, {}).capture();
    ASSERT_GT(state.size(), 12U);
    MachineState same(machine.session, {});
    EXPECT_TRUE(same.restore(state)) << same.problem();
    for (const std::size_t at : {0, 4, 11}) {
        std::string other = state;
        other[at] ^= 1;
        MachineState restored(machine.session, {});
        EXPECT_FALSE(restored.restore(other));
        EXPECT_EQ("another version of Halcyon has written it", restored.problem());
    }
    MachineState older(machine.session, {});
    EXPECT_FALSE(older.restore(state.substr(12)));
    EXPECT_EQ("another version of Halcyon has written it", older.problem());
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && __SIZEOF_POINTER__ == 8

TEST(ComponentHeap, Is_not_made_where_other_memory_has_its_addresses) {
    constexpr std::size_t page = 4096;
    constexpr std::uint64_t tib = std::uint64_t{1} << 40;
    for (const std::uint64_t offset : {std::uint64_t{0}, 16 * tib - page}) {
        void* const place = reinterpret_cast<void*>(component_heap::heap_begin + offset);
        constexpr int how = MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE;
        void* const other = ::mmap(place, page, PROT_READ | PROT_WRITE, how, -1, 0);
        ASSERT_EQ(place, other);
        *static_cast<char*>(other) = 7;
        EXPECT_EQ("other memory has the addresses that components need", component_heap::track());
        EXPECT_FALSE(component_heap::has(component_heap::heap_begin));
        EXPECT_EQ(7, *static_cast<char*>(other));
        ::munmap(other, page);
    }
}

TEST(ComponentHeap, Is_not_made_where_the_address_space_is_limited) {
    rlimit before{};
    ASSERT_EQ(0, ::getrlimit(RLIMIT_AS, &before));
    rlimit small = before;
    small.rlim_cur = rlim_t{1} << 40;
    ASSERT_EQ(0, ::setrlimit(RLIMIT_AS, &small));
    const std::string problem = component_heap::track();
    ::setrlimit(RLIMIT_AS, &before);
    EXPECT_EQ(
        "the addresses for the memory of components cannot be reserved: Cannot allocate memory; "
        "see: ulimit -v",
        problem);
}

#endif

}  // namespace
}  // namespace hal::test
