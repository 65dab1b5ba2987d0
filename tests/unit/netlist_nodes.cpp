// SPDX-License-Identifier: MIT
#include "tests/unit/netlist_text.hpp"

#include "netlist/nodes.hpp"

namespace {

class Nodes : public netlist_text::Netlist {
protected:
    std::vector<hal::NodeLine> nodes(const std::string& text) {
        std::vector<hal::NodeLine> all;
        hal::collect_nodes(parse(text), all, found);
        return all;
    }
    std::string part(const std::string& text, const std::string& name) {
        auto commands = parse(text);
        hal::keep_part(name, commands);
        return netlist_text::joined(commands);
    }
};

TEST_F(Nodes, are_named_in_order_of_first_mention) {
    const auto all = nodes("a\nnode two one\nb\nnode one\nnode all\nc\nnode r[1..2]\n");
    ASSERT_EQ(all.size(), 4u);
    EXPECT_EQ(all[0].name + all[1].name + all[2].name + all[3].name, "twooner1r2");
    EXPECT_EQ(in_source(all[1].at), "one");
    EXPECT_EQ(render(found, sources), "");
}

TEST_F(Nodes, parts_are_the_lines_of_a_node_and_of_all) {
    const std::string text = "a\nnode x\nb\nnode y x\nc\nnode y\nd\nnode all\ne\n";
    EXPECT_EQ(part(text, "x"), "a\nb\nc\ne\n");
    EXPECT_EQ(part(text, "y"), "a\nc\nd\ne\n");
    EXPECT_EQ(part(text, "z"), "a\ne\n");
}

TEST_F(Nodes, times_are_said_once_and_a_deadline_follows_the_rate) {
    auto all = nodes("node x rate=50ms\nnode x deadline=2s\nnode y rate=1ms\nnode z\n");
    EXPECT_EQ(all[0].rate(), 50'000'000);
    EXPECT_EQ(all[0].deadline(), 2'000'000'000);
    EXPECT_EQ(all[1].deadline(), 100'000'000);
    EXPECT_EQ(all[2].rate(), 10'000'000);
    EXPECT_EQ(all[2].deadline(), 100'000'000);
    EXPECT_EQ(render(found, sources), "");
    nodes("node x rate=50ms\nnode x rate=20ms\n");
    EXPECT_NE(
        render(found, sources).find("node 'x' has two different values of rate= or deadline="),
        std::string::npos)
        << render(found, sources);
}

TEST_F(Nodes, a_pin_called_node_is_no_line) {
    EXPECT_TRUE(nodes("node = 3\n").empty());
    EXPECT_EQ(part("node = 3\n", "x"), "node = 3\n");
}

TEST_F(Nodes, more_than_a_hundred_are_refused) {
    nodes("node n[1..200]\n");
    EXPECT_NE(render(found, sources).find("more than 100 nodes"), std::string::npos);
}

}  // namespace
