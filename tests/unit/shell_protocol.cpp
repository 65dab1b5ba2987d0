// SPDX-License-Identifier: MIT
// The control protocol without a socket: every request has its reply, whatever it is.
#include <nlohmann/json.hpp>

#include "control/connection.hpp"
#include "shell_machine.hpp"

namespace hal::test {
namespace {

using Json = nlohmann::json;

struct Protocol : testing::Test {
    Protocol() {
        machine.must(
            "loadrt and2 names=a,b\nloadrt sum2 names=s\nnewthread t 1000000\nnet on a.out => "
            "b.in0\nnewsig level float\naddf a t\n");
    }

    std::string raw(const std::string& line) {
        std::string replies;
        handled = connection.handle(line, replies);
        return replies;
    }
    Json ask(const Json& request) {
        std::string reply = raw(request.dump());
        if (handled == Connection::Handled::wants_thread) {
            handled = connection.handle(request.dump(), reply, true);
        }
        EXPECT_TRUE(reply.ends_with("\n")) << reply;
        return Json::parse(reply);
    }
    std::string refusal(const Json& request) {
        const Json reply = ask(request);
        EXPECT_EQ(reply["ok"], false) << reply;
        return reply.value("error", "");
    }
    std::vector<Json> published(std::int64_t now, bool congested = false) {
        std::string events;
        connection.publish(now, congested, events);
        std::vector<Json> all;
        for (std::size_t at = 0, end; (end = events.find('\n', at)) != events.npos; at = end + 1) {
            all.push_back(Json::parse(events.substr(at, end - at)));
        }
        return all;
    }

    ShellMachine machine;
    Connection connection{machine.shell, getpid()};
    Connection::Handled handled = Connection::Handled::done;
};

TEST_F(Protocol, the_hello_names_instance_and_version) {
    const Json hello = Json::parse(connection.hello());
    EXPECT_EQ(hello["halcyon"], 1);
    EXPECT_EQ(hello["name"], "test");
    EXPECT_EQ(hello["pid"], getpid());
    EXPECT_TRUE(hello["version"].is_string());
}

TEST_F(Protocol, run_gives_output_errors_and_status) {
    EXPECT_EQ(raw(R"({"id":7,"run":"getp a.in0"})"),
              "{\"id\":7,\"ok\":true,\"status\":0,\"out\":\"FALSE\\n\",\"err\":\"\"}\n");
    const Json failed = ask({{"id", "x"}, {"run", "getp a.ot"}, {"name", "<commandline>"}});
    EXPECT_EQ(failed["id"], "x");
    EXPECT_EQ(failed["ok"], true);
    EXPECT_EQ(failed["status"], 1);
    EXPECT_TRUE(failed["err"].get<std::string>().starts_with("<commandline>:1:6: error:"))
        << failed;
    EXPECT_EQ(ask({{"run", "quit"}})["quit"], true);
    EXPECT_EQ(ask({{"run", "begin"}})["collecting"], true);
}

TEST_F(Protocol, a_script_is_a_file_with_its_own_environment) {
    const Json reply = ask({{"script", "setp a.in0 $ON\ngetp a.in0\nsetp a.in1 $OFF\n"},
                            {"name", "x.hal"},
                            {"env", {{"ON", "TRUE"}}}});
    EXPECT_EQ(reply["status"], 1);
    EXPECT_EQ(reply["out"], "TRUE\n");
    EXPECT_NE(reply["err"].get<std::string>().find("x.hal:3:12: error:"), std::string::npos)
        << reply;
    EXPECT_NE(refusal({{"script", "start"}, {"env", {{"ON", 1}}}}), "");
}

TEST_F(Protocol, read_is_one_bulk_of_pins_and_signals) {
    const Json reply = ask({{"read", {"a.in0", "s.out", "level", "nothing", "a.tmax"}}});
    EXPECT_EQ(reply["values"], (Json{false, 0.0, 0.0, nullptr, 0}));
    EXPECT_EQ(reply["types"], (Json{"bit", "float", "float", nullptr, "s32"}));
    EXPECT_TRUE(ask({{"read", Json::array()}})["values"].empty());
}

TEST_F(Protocol, set_is_one_transaction_of_pins_and_signals) {
    EXPECT_EQ(
        ask({{"set", {{"a.in0", true}, {"s.in0", 1.5}, {"level", -2}, {"s.gain0", "3"}}}})["count"],
        4);
    EXPECT_EQ(ask({{"read", {"a.in0", "s.in0", "level", "s.gain0"}}})["values"],
              (Json{true, 1.5, -2.0, 3.0}));
    EXPECT_NE(refusal({{"set", {{"a.in0", false}, {"b.in0", true}}}}).find("nothing was changed"),
              std::string::npos);
    EXPECT_EQ(ask({{"read", {"a.in0"}}})["values"][0], true);
    EXPECT_NE(refusal({{"set", {{"a.in0", 3}}}}), "");
    EXPECT_NE(refusal({{"set", {{"a.in0", nullptr}}}}), "");
    EXPECT_NE(refusal({{"set", {"a.in0"}}}), "");
    machine.line("lock all");
    EXPECT_NE(refusal({{"set", {{"s.gain0", 1}}}}).find("[locked]"), std::string::npos);
    EXPECT_EQ(ask({{"set", {{"a.in0", false}}}})["count"], 1);
}

TEST_F(Protocol, values_without_a_json_number_are_words) {
    machine.must("setp s.in0 inf\nsetp s.in1 nan\nsetp s.offset -inf\n");
    EXPECT_EQ(ask({{"read", {"s.in0", "s.in1", "s.offset"}}})["values"],
              (Json{"inf", "nan", "-inf"}));
    EXPECT_EQ(ask({{"set", {{"s.in0", "-inf"}}}})["count"], 1);
}

TEST_F(Protocol, a_subscription_sends_values_when_due) {
    const Json reply = ask({{"subscribe", {"level", "a.in0"}}, {"every_ms", 10}});
    EXPECT_EQ(reply["subscription"], 1);
    const std::int64_t due = connection.next_due_ns();
    auto events = published(due);
    ASSERT_EQ(events.size(), 1U);
    EXPECT_EQ(events[0]["event"], "values");
    EXPECT_EQ(events[0]["subscription"], 1);
    EXPECT_EQ(events[0]["values"], (Json{0.0, false}));
    EXPECT_EQ(connection.next_due_ns(), due + 10'000'000);
    EXPECT_TRUE(published(due + 9'999'999).empty());
    // a late one keeps the grid
    EXPECT_EQ(published(due + 35'000'000).size(), 1U);
    EXPECT_EQ(connection.next_due_ns(), due + 40'000'000);
    // a client that does not read gets the number of skipped events later
    EXPECT_TRUE(published(due + 40'000'000, true).empty());
    EXPECT_TRUE(published(due + 50'000'000, true).empty());
    EXPECT_EQ(published(due + 60'000'000)[0]["skipped"], 2);
    EXPECT_FALSE(published(due + 70'000'000)[0].contains("skipped"));
    EXPECT_EQ(ask({{"unsubscribe", 1}})["ok"], true);
    EXPECT_EQ(connection.next_due_ns(), INT64_MAX);
    EXPECT_NE(refusal({{"unsubscribe", 1}}), "");
}

TEST_F(Protocol, a_subscription_to_changes_is_silent_while_nothing_changes) {
    ask({{"subscribe", {"level", "a.in0", "later"}}, {"every_ms", 1}, {"changes", true}});
    std::int64_t now = connection.next_due_ns();
    EXPECT_EQ(published(now).size(), 1U);
    EXPECT_TRUE(published(now += 1'000'000).empty());
    machine.must("sets level 1\n");
    EXPECT_EQ(published(now += 1'000'000)[0]["values"][0], 1.0);
    machine.must("newsig later bit\n");
    EXPECT_EQ(published(now += 1'000'000)[0]["values"][2], false);
    machine.must("delsig later\nnewsig later float\n");
    EXPECT_EQ(published(now += 1'000'000)[0]["values"][2], 0.0);
    EXPECT_TRUE(published(now += 1'000'000).empty());
}

TEST_F(Protocol, list_and_describe) {
    EXPECT_EQ(ask({{"list", "sig"}})["names"], (Json{"level", "on"}));
    EXPECT_EQ(ask({{"list", "pin"}, {"patterns", {"a.in", "b.o*"}}})["names"],
              (Json{"a.in0", "a.in1", "b.out"}));
    const Json pin = ask({{"describe", "pin"}, {"patterns", {"b.in0"}}})["objects"][0];
    EXPECT_EQ(pin["signal"], "on");
    EXPECT_EQ(pin["component"], "and2");
    EXPECT_TRUE(pin["doc"].is_string());
    EXPECT_EQ(ask({{"describe", "sig"}, {"type", "float"}})["objects"].size(), 1U);
    EXPECT_EQ(ask({{"describe", "all"}})["objects"]["threads"][0]["functions"], (Json{"a"}));
    EXPECT_NE(refusal({{"describe", "weather"}}), "");
    EXPECT_NE(refusal({{"describe", "sig"}, {"type", "flot"}}), "");
    EXPECT_NE(refusal({{"list", "pin"}, {"patterns", "a"}}), "");
}

TEST_F(Protocol, complete) {
    const Json reply = ask({{"complete", "addf "}, {"cursor", 5}});
    EXPECT_EQ(reply["begin"], 5);
    EXPECT_EQ(reply["candidates"].back()["text"], "s");
    EXPECT_EQ(ask({{"complete", "net lev"}})["candidates"][0]["text"], "level");
}

TEST_F(Protocol, a_component_is_there_as_long_as_its_client) {
    {
        Connection other(machine.shell, 4242);
        std::string reply;
        other.handle(R"({"component":"panel"})", reply);
        EXPECT_EQ(reply, "{\"id\":null,\"ok\":true}\n");
        EXPECT_EQ(machine.says("list comp"), "panel sum2 and2 \n");
        EXPECT_NE(refusal({{"component", "panel"}}).find("in use"), std::string::npos);
        EXPECT_NE(refusal({{"component", "and2"}}).find("in use"), std::string::npos);
        EXPECT_NE(refusal({{"component", "a b"}}), "");
    }
    EXPECT_EQ(machine.says("list comp"), "sum2 and2 \n");
}

TEST_F(Protocol, a_sampler_is_drained_and_a_streamer_fed) {
    machine.must(
        "loadrt sampler cfg=fb depth=5\nloadrt streamer cfg=fs depth=4\nnet level "
        "sampler.0.pin.0\naddf sampler.0 t\naddf streamer.0 t\n");
    EXPECT_EQ(ask({{"stream", "sampler.0"}})["types"], "fb");
    EXPECT_EQ(ask({{"stream", "sampler.0"}})["depth"], 4);
    EXPECT_EQ(ask({{"stream", "streamer.0"},
                   {"records", {{1.5, 1}, {2.5, -2}, {3, 3}, {4, 4}}}})["taken"],
              3);
    machine.must("start\nadvance 2 cycles\nsets level 7\nadvance 4 cycles\n");
    EXPECT_EQ(machine.says("getp streamer.0.pin.1"), "3\n");
    Json first = ask({{"stream", "sampler.0"}, {"take", 3}});
    EXPECT_EQ(first["records"], (Json{{0.0, false}, {0.0, false}, {7.0, false}}));
    EXPECT_EQ(first["numbers"], (Json{0, 1, 2}));
    EXPECT_EQ(first["lost_before"], (Json{0, 0, 0}));
    EXPECT_EQ(first["waiting"], 1);
    EXPECT_EQ(first["lost"], 2);
    EXPECT_EQ(ask({{"stream", "sampler.0"}, {"take", 100}})["numbers"], (Json{3}));
    EXPECT_TRUE(ask({{"stream", "sampler.0"}, {"take", 100}})["records"].empty());
    EXPECT_NE(refusal({{"stream", "sampler.0"}, {"records", {{1, 0}}}}), "");
    EXPECT_NE(refusal({{"stream", "streamer.0"}, {"take", 1}}), "");
    EXPECT_NE(refusal({{"stream", "streamer.0"}, {"records", {{1}}}}).find("record 0 has 1"),
              std::string::npos);
    EXPECT_NE(refusal({{"stream", "streamer.0"}, {"records", {{1, 2}, {1, 2.5}}}})
                  .find("record 1, value 1"),
              std::string::npos);
    EXPECT_NE(refusal({{"stream", "streamer.0"}, {"records", 3}}), "");
    EXPECT_EQ(ask({{"stream", "streamer.0"}, {"records", {{1, 2}}}})["taken"], 1);
    EXPECT_NE(refusal({{"stream", "sampler.1"}}).find("did you mean 'sampler.0'"),
              std::string::npos);
}

TEST_F(Protocol, options_hold_for_the_connection) {
    EXPECT_EQ(
        ask({{"options", {{"script", true}, {"level", "results"}, {"directory", "/"}}}})["ok"],
        true);
    EXPECT_EQ(ask({{"run", "show sig level"}})["out"], "float  0  level\n\n");
    EXPECT_EQ(ask({{"run", "sets level 1"}})["err"], "1 edit took effect\n");
    EXPECT_FALSE(machine.shell.options.script);
    EXPECT_NE(refusal({{"options", {{"colour", true}}}}), "");
    EXPECT_NE(refusal({{"options", {{"script", 1}}}}), "");
    EXPECT_NE(refusal({{"options", {{"level", "loud"}}}}), "");
    EXPECT_EQ(ask({{"run", "show sig level"}})["out"], "float  1  level\n\n");
}

TEST_F(Protocol, invalid_input_gets_an_error_and_changes_nothing) {
    for (const std::string line : {"",
                                   "hello",
                                   "{",
                                   "[]",
                                   "null",
                                   "17",
                                   "\"run\"",
                                   "{\"id\":1",
                                   "{\"run\":\"start\"}}",
                                   "\xff\xfe\x00\x01",
                                   "{}",
                                   "{\"id\":3}",
                                   "{\"rum\":\"start\"}",
                                   "{\"run\":\"start\",\"read\":[]}",
                                   "{\"run\":\"start\",\"colour\":1}",
                                   "{\"run\":5}",
                                   "{\"run\":[\"start\",5]}",
                                   "{\"run\":[[\"start\"]]}",
                                   "{\"script\":null}",
                                   "{\"read\":\"a\"}",
                                   "{\"read\":[1]}",
                                   "{\"read\":{}}",
                                   "{\"subscribe\":[],\"every_ms\":0}",
                                   "{\"subscribe\":[],\"every_ms\":1e300}",
                                   "{\"subscribe\":[],\"every_ms\":\"x\"}",
                                   "{\"unsubscribe\":-1}",
                                   "{\"complete\":\"x\",\"cursor\":-1}",
                                   "{\"stream\":\"sampler.0\",\"take\":-5}",
                                   "{\"set\":5}",
                                   "{\"\":1}",
                                   "{\"run\":\"\xc3\x28\"}"}) {
        const std::string reply = raw(line);
        ASSERT_TRUE(reply.ends_with("\n") && reply.find('\n') == reply.size() - 1) << line;
        EXPECT_EQ(Json::parse(reply)["ok"], false) << line << "\n" << reply;
    }
    EXPECT_FALSE(machine.session.threads().running());
    const std::string nested = raw("{\"run\":" + std::string(10'000'000, '['));
    EXPECT_EQ(Json::parse(nested)["ok"], false);
    EXPECT_LT(nested.size(), 200U);
    EXPECT_EQ(
        Json::parse(raw("{\"id\":\"" + std::string(1000, 'x') + "\",\"run\":\"status\"}"))["id"],
        nullptr);
    EXPECT_GT(connection.invalid_requests(), 5U);
    EXPECT_EQ(ask({{"run", "getp a.in0"}})["out"], "FALSE\n");
}

TEST_F(Protocol, what_may_wait_asks_for_a_thread_first) {
    EXPECT_EQ(raw(R"({"id":1,"run":"loadusr -w echo hi"})"), "");
    EXPECT_EQ(handled, Connection::Handled::wants_thread);
    std::string reply;
    EXPECT_EQ(connection.handle(R"({"id":1,"run":"loadusr -w echo hi"})", reply, true),
              Connection::Handled::done);
    EXPECT_EQ(Json::parse(reply)["out"], "hi\n");
    raw(R"({"run":"$COMMAND -w true"})");  // what it stands for may wait
    EXPECT_EQ(handled, Connection::Handled::wants_thread);
    EXPECT_TRUE(connection.cancels(R"({"cancel":true})"));
    EXPECT_FALSE(connection.cancels(R"({"run":"print \"cancel\""})"));
    EXPECT_FALSE(connection.cancels("\"cancel\" rubbish"));
    EXPECT_FALSE(connection.cancels(R"({"cancel":false})"));
}

TEST_F(Protocol, stop_ends_the_instance) {
    for (const Json& other : {Json(false), Json(nullptr), Json(0)}) {
        EXPECT_EQ(ask({{"stop", other}})["error"], "stop must be true");
        EXPECT_EQ(handled, Connection::Handled::done);
    }
    EXPECT_EQ(ask({{"stop", true}})["ok"], true);
    EXPECT_EQ(handled, Connection::Handled::stop);
    ask({{"run", "status"}});
    EXPECT_EQ(handled, Connection::Handled::done);
}

TEST_F(Protocol, a_program_without_a_process_id_here_is_no_component) {
    // as the kernel reports a process outside of the PID namespace
    Connection outside(machine.shell, 0);
    std::string reply;
    outside.handle(R"({"component":"panel"})", reply);
    EXPECT_EQ(Json::parse(reply)["ok"], false);
    EXPECT_EQ(ask({{"list", "comp"}, {"patterns", {"panel"}}})["names"], Json::array());
}

}  // namespace
}  // namespace hal::test
