// SPDX-License-Identifier: MIT
#include "model/name_table.hpp"

#include <map>
#include <random>
#include <string>
#include <vector>

namespace hal {
namespace {

TEST(NameTable, Is_empty_at_first) {
    NameTable<int> table;
    EXPECT_TRUE(table.empty());
    EXPECT_EQ(table.find("a"), nullptr);
    EXPECT_EQ(table.begin(), table.end());
    table.erase("a");
    EXPECT_EQ(table.size(), 0u);
}

TEST(NameTable, Keeps_the_first_object_of_a_name) {
    NameTable<int> table;
    int one = 1;
    int two = 2;
    table.emplace("a", &one);
    table.emplace("a", &two);
    EXPECT_EQ(table.find("a"), &one);
    EXPECT_EQ(table.size(), 1u);
}

TEST(NameTable, Is_empty_after_it_was_moved) {
    NameTable<int> table;
    int one = 1;
    table.emplace("a", &one);
    NameTable<int> other = std::move(table);
    EXPECT_EQ(other.find("a"), &one);
    EXPECT_TRUE(table.empty());  // NOLINT(bugprone-use-after-move): that is what is tested
    EXPECT_EQ(table.find("a"), nullptr);
    table = std::move(other);
    EXPECT_EQ(table.find("a"), &one);
    EXPECT_TRUE(other.empty());  // NOLINT(bugprone-use-after-move)
}

/// A thousand names come and go; std::map is the reference.
TEST(NameTable, Agrees_with_a_map_after_random_edits) {
    std::mt19937 random(7);
    std::vector<std::string> names;
    for (int i = 0; i < 1000; ++i) {
        names.push_back("name." + std::to_string(i));
    }
    std::vector<int> objects(names.size());
    NameTable<int> table;
    std::map<std::string_view, int*> reference;
    for (int step = 0; step < 100'000; ++step) {
        const std::size_t i = random() % names.size();
        // mostly full, then mostly empty: erased slots are used again
        const bool enters = random() % 100 < (step / 10'000 % 2 == 0 ? 80u : 20u);
        if (enters) {
            table.emplace(names[i], &objects[i]);
            reference.emplace(names[i], &objects[i]);
        } else {
            table.erase(names[i]);
            reference.erase(names[i]);
        }
        ASSERT_EQ(table.size(), reference.size());
        const std::size_t asked = random() % names.size();
        const auto expected = reference.find(names[asked]);
        ASSERT_EQ(table.find(names[asked]),
                  expected == reference.end() ? nullptr : expected->second);
    }
    std::map<std::string_view, int*> listed;
    for (const auto& [name, object] : table) {
        listed.emplace(name, object);
    }
    EXPECT_EQ(listed, reference);
}

TEST(NameTable, Does_not_grow_within_what_was_reserved) {
    NameTable<int> table;
    table.reserve(100);
    std::vector<std::string> names;
    int object = 0;
    for (int i = 0; i < 100; ++i) {
        names.push_back(std::to_string(i));
    }
    for (const std::string& name : names) {
        table.emplace(name, &object);
    }
    EXPECT_EQ(table.size(), 100u);
    for (const std::string& name : names) {
        EXPECT_EQ(table.find(name), &object);
    }
}

}  // namespace
}  // namespace hal
