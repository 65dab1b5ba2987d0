// SPDX-License-Identifier: MIT
// Programs as components, without a socket: pins, exchange, death and take-over, ports, streams.
#include <nlohmann/json.hpp>

#include "control/connection.hpp"
#include "machine/processes/programs.hpp"
#include "shell_machine.hpp"

namespace hal::test {
namespace {

using Json = nlohmann::json;

struct Programs : testing::Test {
    Programs() {
        machine.must(
            "loadrt sum2 names=s,second\nnewthread t 1000000\nnewthread slow 10000000\naddf s "
            "t\naddf second slow\nstart\n");
    }

    static Json ask(Connection& connection, const Json& request) {
        std::string reply;
        EXPECT_EQ(connection.handle(request.dump(), reply), Connection::Handled::done) << request;
        return Json::parse(reply);
    }
    Json ask(const Json& request) { return ask(*program, request); }
    std::string refusal(const Json& request) {
        const Json reply = ask(request);
        EXPECT_EQ(reply["ok"], false) << reply;
        return reply.value("error", "");
    }
    static Json pin(const char* name, const char* type, const char* dir) {
        return {{"name", name}, {"type", type}, {"dir", dir}};
    }
    Json declare(const Json& more = Json::object()) {
        Json body{{"component", "p"},
                  {"pins",
                   {pin("in", "float", "in"), pin("out", "float", "out"), pin("io", "s32", "io"),
                    pin("gain", "u64", "rw"), pin("about", "bit", "ro")}}};
        body["pins"][1]["safe"] = -1;
        body.update(more);
        return ask(body);
    }

    ShellMachine machine;
    std::unique_ptr<Connection> program = std::make_unique<Connection>(machine.shell, 4242);
};

TEST_F(Programs, declare_pins_that_are_there_like_any_other) {
    const Json reply = declare({{"ready", false}});
    EXPECT_EQ(reply["first"], 0) << reply;
    EXPECT_EQ(reply["values"], (Json{0.0, 0.0, 0, 0, false}));
    EXPECT_NE(machine.says("show comp p").find(" initializing\n"), std::string::npos)
        << machine.out;
    EXPECT_EQ(ask({{"component", "p"},
                   {"ready", true},
                   {"prefix", "q"},
                   {"pins", {pin("more", "bit", "out")}}})["first"],
              5);
    EXPECT_NE(machine.says("show comp p").find(" 4242 ready\n"), std::string::npos) << machine.out;
    EXPECT_EQ(machine.says("list pin p. q."), "p.in p.io p.out q.more \n");
    EXPECT_EQ(machine.says("list param p."), "p.about p.gain \n");
    EXPECT_EQ(machine.says("getp p.gain"), "0\n");
    machine.must("setp p.gain 18446744073709551615\nsetp p.in 2.5\n");
    EXPECT_EQ(machine.line("setp p.about 1"), 1);
    EXPECT_NE(machine.err.find("read-only"), std::string::npos) << machine.err;
    EXPECT_EQ(machine.line("setp p.out 1"), 1);
    EXPECT_EQ(ask({{"exchange", "p"}, {"read", true}})["values"],
              (Json{2.5, 0, 18446744073709551615U}));
}

TEST_F(Programs, one_writer_and_types_hold_for_their_pins_too) {
    declare();
    machine.must("net a p.out => s.in0\n");
    EXPECT_EQ(machine.line("net a s.out"), 1);
    EXPECT_NE(machine.err.find("[two-writers]"), std::string::npos) << machine.err;
    EXPECT_EQ(machine.line("net a p.io"), 1);
    EXPECT_NE(machine.err.find("[type-mismatch]"), std::string::npos) << machine.err;
}

TEST_F(Programs, values_reach_every_thread_and_come_back) {
    declare();
    machine.must("net a p.out => s.in0 second.in0\nnet b s.out => p.in\n");
    ask({{"exchange", "p"}, {"write", {1, 4.5, 4, true}}});
    EXPECT_EQ(machine.says("gets a"), "4.5\n");
    machine.must("advance 20ms\n");
    EXPECT_EQ(machine.says("getp second.out"), "4.5\n");
    const Json reply = ask({{"exchange", "p"}, {"read", true}});
    EXPECT_EQ(reply["values"], (Json{4.5, 0, 0}))
        << "own outputs and read-only parameters are not repeated";
    EXPECT_FALSE(reply.contains("loops"));
    EXPECT_EQ(machine.says("getp p.about"), "TRUE\n");
    machine.must("unlinkp p.in\nunlinkp p.out\n");
    EXPECT_EQ(machine.says("getp p.in"), "4.5\n");
    EXPECT_EQ(machine.says("getp p.out"), "4.5\n");
    EXPECT_EQ(machine.says("getp s.in0"), "4.5\n");
}

TEST_F(Programs, an_input_is_set_only_while_nothing_writes_it) {
    declare();
    ask({{"exchange", "p"}, {"write", {0, 3}}});
    EXPECT_EQ(machine.says("getp p.in"), "3\n");
    machine.must("net c p.in\n");
    ask({{"exchange", "p"}, {"write", {0, 5}}});
    EXPECT_EQ(machine.says("gets c"), "5\n");
    machine.must("net c p.out\nadvance 2ms\n");
    ask({{"exchange", "p"}, {"write", {0, 7}}});
    EXPECT_EQ(machine.says("gets c"), "0\n")
        << "an output hands its own value to a signal without writer";
    EXPECT_EQ(ask({{"exchange", "p"}, {"read", true}})["loops"], true);
}

TEST_F(Programs, what_is_wrong_is_refused_and_changes_nothing) {
    EXPECT_NE(refusal({{"exchange", "p"}, {"read", true}}), "");
    EXPECT_NE(refusal({{"exit", "p"}}), "");
    EXPECT_NE(refusal({{"component", "s"}, {"pins", Json::array()}}).find("in use"),
              std::string::npos);
    EXPECT_NE(
        refusal({{"component", "p"}, {"pins", {pin("a", "float", "in"), pin("a", "float", "in")}}}),
        "");
    EXPECT_EQ(machine.says("list comp"), "sum2 \n") << "not even the component";
    EXPECT_NE(refusal({{"component", "p"}, {"pins", {pin("a", "colour", "in")}}}), "");
    EXPECT_NE(refusal({{"component", "p"}, {"pins", {pin("a", "bit", "sideways")}}}), "");
    EXPECT_NE(refusal({{"component", "p"}, {"pins", {pin("a b", "bit", "in")}}}), "");
    EXPECT_NE(refusal({{"component", "p"}, {"pins", {pin("a", "port", "io")}}}), "");
    EXPECT_NE(refusal({{"component", "p"}, {"pins", 7}}), "");
    EXPECT_NE(refusal({{"component", "p"}, {"timeout_ms", -2}}), "");
    declare();
    EXPECT_NE(refusal({{"component", "p"}, {"pins", {pin("in", "float", "in")}}}), "");
    EXPECT_NE(refusal({{"exchange", "p"}, {"write", {5, 1}}}), "");
    EXPECT_NE(refusal({{"exchange", "p"}, {"write", {1}}}), "");
    EXPECT_NE(refusal({{"exchange", "p"}, {"write", {1, 2.0, 2, 1e10}}}), "");
    EXPECT_EQ(machine.says("getp p.out"), "0\n");
    Connection other(machine.shell, 4243);
    EXPECT_EQ(ask(other, {{"exchange", "p"}, {"read", true}})["ok"], false)
        << "only its own connection";
    EXPECT_EQ(ask(other, {{"component", "p"}})["ok"], false);
    EXPECT_EQ(machine.line("unloadrt p"), 1);
    EXPECT_NE(machine.err.find("[is-a-program]"), std::string::npos) << machine.err;
}

TEST_F(Programs, exit_takes_the_pins_along) {
    declare();
    machine.must("net a p.out => s.in0\n");
    EXPECT_EQ(ask({{"exit", "p"}})["ok"], true);
    EXPECT_EQ(machine.says("list comp"), "sum2 \n");
    EXPECT_EQ(machine.says("list pin p."), "\n");
    EXPECT_EQ(machine.says("gets a"), "-1\n") << "what it drove goes to its declared value";
    EXPECT_EQ(declare()["ok"], true) << "and the name is free";
}

TEST_F(Programs, a_dead_one_keeps_its_pins_for_its_successor) {
    declare({{"timeout_ms", -1}});
    machine.must("net a p.out => s.in0\nsetp p.gain 3\n");
    ask({{"exchange", "p"}, {"write", {1, 4.5}}});
    program = std::make_unique<Connection>(machine.shell, 4243);
    EXPECT_NE(machine.says("show comp p").find(" dead since "), std::string::npos) << machine.out;
    EXPECT_EQ(machine.says("gets a"), "4.5\n");
    Json pins{pin("out", "float", "out"), pin("io", "bit", "io"), pin("gain", "u64", "rw"),
              pin("new", "bit", "in")};
    const Json reply = ask({{"component", "p"}, {"pins", pins}});
    EXPECT_EQ(reply["values"], (Json{4.5, false, 3, false})) << "another type is another pin";
    EXPECT_EQ(machine.says("list pin p."), "p.io p.new p.out \n")
        << "what the successor does not have goes";
    EXPECT_NE(machine.says("show comp p").find(" 4243 ready\n"), std::string::npos) << machine.out;
    ask({{"exchange", "p"}, {"write", {0, 6}}});
    EXPECT_EQ(machine.says("gets a"), "6\n");
}

TEST_F(Programs, a_dead_one_takes_its_declared_values_after_its_time) {
    declare({{"timeout_ms", 0}});
    machine.must("net a p.out => s.in0\n");
    ask({{"exchange", "p"}, {"write", {1, 4.5, 2, 9}}});
    program.reset();
    for (int i = 0; i < 3000 && machine.says("gets a") != "-1\n"; ++i) {
        usleep(10'000);
    }
    EXPECT_EQ(machine.says("gets a"), "-1\n");
    EXPECT_EQ(machine.says("getp p.io"), "9\n") << "not declared: it stays";
    machine.must("unloadusr p\n");
    EXPECT_EQ(machine.says("list comp"), "sum2 \n");
}

TEST_F(Programs, one_that_declares_a_rate_and_misses_it_does_not_respond) {
    declare({{"timeout_ms", 0}, {"every_ms", 1}});
    machine.must("net a p.out => s.in0\n");
    const auto says = [&](const char* command, const char* what) {
        for (int i = 0; i < 3000 && machine.says(command).find(what) == std::string::npos; ++i) {
            usleep(10'000);
        }
        return machine.out.find(what) != std::string::npos;
    };
    EXPECT_TRUE(says("show comp p", " not responding since ")) << machine.out;
    EXPECT_EQ(machine.says("gets a"), "-1\n");
    ask({{"exchange", "p"}, {"write", {1, 4.5}}, {"alive", false}});
    EXPECT_EQ(machine.says("gets a"), "-1\n")
        << "values sent by a thread of its library do not count as a sign of life";
    ask({{"component", "p"}, {"every_ms", 0}});
    EXPECT_EQ(machine.says("gets a"), "4.5\n") << "what it wrote meanwhile";
    EXPECT_NE(machine.says("show comp p").find(" ready\n"), std::string::npos) << machine.out;
    EXPECT_NE(refusal({{"component", "p"}, {"every_ms", -1}}), "");
    EXPECT_NE(refusal({{"component", "p"}, {"safe", {9, 1}}}), "");
    ask({{"component", "p"}, {"safe", {2, 7}}});
    program.reset();
    EXPECT_TRUE(says("getp p.io", "7\n"));
}

TEST_F(Programs, a_hundred_thousand_pins_come_die_and_are_taken_over) {
    Json pins = Json::array();
    for (int i = 0; i < 100'000; ++i) {
        pins.push_back(pin(("n" + std::to_string(i)).c_str(), "float", i % 2 ? "in" : "out"));
    }
    const Json request{{"component", "many"}, {"pins", pins}};
    EXPECT_EQ(ask(request)["values"].size(), 100'000U);
    program = std::make_unique<Connection>(machine.shell, 4243);
    EXPECT_EQ(ask(request)["values"].size(), 100'000U);
    program = std::make_unique<Connection>(machine.shell, 4244);
    EXPECT_EQ(ask({{"component", "many"}, {"pins", {pin("n0", "float", "out")}}})["values"].size(),
              1U)
        << "all others go";
    EXPECT_EQ(ask({{"exit", "many"}})["ok"], true);
}

TEST_F(Programs, bytes_go_through_a_port) {
    ask({{"component", "p"}, {"pins", {pin("tx", "port", "out"), pin("rx", "port", "in")}}});
    EXPECT_EQ(ask({{"port", "p.tx"}})["size"], 0);
    machine.must("net pipe p.tx => p.rx\nsets pipe 9\n");
    EXPECT_EQ(ask({{"port", "p.tx"}, {"write", "68656c6c6f"}})["writable"], 3);
    EXPECT_EQ(ask({{"port", "p.tx"}, {"write", "00000000"}})["done"], false);
    EXPECT_EQ(ask({{"port", "p.rx"}, {"peek", 2}})["bytes"], "6865");
    EXPECT_EQ(ask({{"port", "p.rx"}, {"read", 6}})["done"], false);
    EXPECT_EQ(ask({{"port", "p.rx"}, {"read", 5}})["bytes"], "68656c6c6f");
    EXPECT_NE(refusal({{"port", "p.rx"}, {"write", "00"}}), "");
    EXPECT_NE(refusal({{"port", "p.tx"}, {"read", 1}}), "");
    EXPECT_NE(refusal({{"port", "p.tx"}, {"write", "0"}}), "");
    EXPECT_NE(refusal({{"port", "s.in0"}}), "");
}

TEST_F(Programs, records_go_through_a_stream_of_their_own) {
    ask({{"component", "p"}});
    EXPECT_EQ(ask({{"stream", "stream.7"},
                   {"create", {{"types", "fs"}, {"depth", 2}}},
                   {"owner", "p"}})["depth"],
              2);
    EXPECT_NE(
        refusal(
            {{"stream", "stream.7"}, {"create", {{"types", "f"}, {"depth", 2}}}, {"owner", "p"}}),
        "");
    EXPECT_NE(
        refusal(
            {{"stream", "stream.8"}, {"create", {{"types", "x"}, {"depth", 2}}}, {"owner", "p"}}),
        "");
    EXPECT_EQ(ask({{"stream", "stream.7"}, {"records", {{1.5, 2}, {"nan", 3}, {0, 4}}}})["taken"],
              2);
    Connection other(machine.shell, 4243);
    EXPECT_EQ(ask(other, {{"stream", "stream.7"}, {"take", 1}})["records"], (Json{{1.5, 2}}));
    ask({{"exit", "p"}});
    EXPECT_EQ(ask(other, {{"stream", "stream.7"}, {"take", 1}})["ok"], false);
}

TEST_F(Programs, each_end_of_a_stream_is_one_process) {
    ask({{"component", "p"}});
    ask({{"stream", "stream.7"}, {"create", {{"types", "u"}, {"depth", 9}}}, {"owner", "p"}});
    constexpr pid_t init = 1;  // a process that lives
    auto first = std::make_unique<Connection>(machine.shell, init);
    auto sibling = std::make_unique<Connection>(machine.shell, init);
    Connection second(machine.shell, ::getpid());
    const Json feed{{"stream", "stream.7"}, {"records", {{1}}}};
    const Json take{{"stream", "stream.7"}, {"take", 1}};
    EXPECT_EQ(ask(*first, feed)["taken"], 1);
    EXPECT_EQ(ask(*sibling, feed)["taken"], 1) << "the same process";
    EXPECT_EQ(ask(second, feed)["error"],
              "stream 'stream.7' is fed by process 1 already; records of two would be mixed; end "
              "that process first");
    EXPECT_EQ(ask(second, {{"stream", "stream.7"}})["waiting"], 2) << "anybody may look";
    EXPECT_EQ(ask(second, take)["records"], (Json{{1}})) << "the other end";
    EXPECT_EQ(ask(*first, take)["error"], "stream 'stream.7' is read by process " +
                                              std::to_string(::getpid()) +
                                              " already; two readers would take each other's "
                                              "records; end that process first");
    first.reset();
    EXPECT_EQ(ask(second, feed)["error"],
              "stream 'stream.7' is fed by process 1 already; records of two would be mixed; end "
              "that process first")
        << "its other connection still feeds it";
    EXPECT_EQ(ask(*sibling, feed)["taken"], 1);
    sibling.reset();
    EXPECT_EQ(ask(second, feed)["taken"], 1);

    // a process that has ended, and the end of its connection is still unknown
    Connection ghost(machine.shell, 0x7fff'fff0);
    ask({{"stream", "stream.8"}, {"create", {{"types", "u"}, {"depth", 9}}}, {"owner", "p"}});
    EXPECT_EQ(ask(ghost, {{"stream", "stream.8"}, {"records", {{1}}}})["taken"], 1);
    EXPECT_EQ(ask(second, {{"stream", "stream.8"}, {"records", {{1}}}})["taken"], 1);
}

}  // namespace
}  // namespace hal::test
