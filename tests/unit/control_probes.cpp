// SPDX-License-Identifier: MIT
// Probes over the control protocol: the verbs, the batches on the wire, and the client that reads
// them.
#include <bit>
#include <cstring>

#include <nlohmann/json.hpp>

#include "control/connection.hpp"
#include "control/probe_client.hpp"
#include "shell_server.hpp"

namespace hal::test {
namespace {

struct ProbeProtocol : testing::Test {
    ProbeProtocol() {
        machine.must(
            "loadrt and2 names=a\nloadrt sum2 names=s\nnewthread t 1000000\nnewsig level "
            "float\nnet level s.in0\naddf a t\naddf s t\n");
    }

    Json ask(const Json& request) {
        std::string reply;
        connection.handle(request.dump(), reply, true);
        return Json::parse(reply);
    }
    std::string refusal(const Json& request) { return ask(request).value("error", ""); }

    ShellMachine machine;
    Connection connection{machine.shell, getpid()};
};

TEST_F(ProbeProtocol, a_probe_is_described_in_its_reply) {
    const Json reply = ask({{"probe", {"s.out", "level", "a.in0"}}, {"every", 3}});
    ASSERT_EQ(reply["ok"], true) << reply;
    EXPECT_EQ(reply["probe"], 1);
    EXPECT_EQ(reply["columns"][0], (Json{{"name", "s.out"}, {"type", "float"}, {"unit", ""}}));
    EXPECT_EQ(reply["columns"][2]["type"], "bit");
    EXPECT_EQ(reply["groups"],
              Json::parse(R"([{"thread":"t","period_ns":3000000,"columns":[0,1,2]}])"));
    EXPECT_FALSE(connection.idle());
    EXPECT_EQ(ask({{"unprobe", 1}})["lost"], 0);
    EXPECT_TRUE(connection.idle());
    EXPECT_EQ(connection.next_due_ns(), INT64_MAX);
}

TEST_F(ProbeProtocol, a_batch_is_a_line_and_its_bytes) {
    ask({{"probe", {"s.out", "a.in0"}}, {"batch_ms", 5}});
    machine.must("sets level 2.5\nsetp a.in0 1\nstart\nadvance 4 cycles\n");
    std::string events;
    connection.publish(connection.next_due_ns(), false, events);
    const std::size_t end = events.find('\n');
    ASSERT_NE(end, events.npos);
    const Json head = Json::parse(events.substr(0, end));
    EXPECT_EQ(head["event"], "samples");
    const std::size_t rows = head["parts"][0]["rows"];
    EXPECT_GE(rows, 4u);
    EXPECT_EQ(head["bytes"], rows * 32);
    ASSERT_EQ(events.size(), end + 1 + rows * 32);
    std::uint64_t word[4];
    std::memcpy(word, events.data() + events.size() - 32, 32);
    EXPECT_EQ(std::bit_cast<double>(word[2]), 2.5);
    EXPECT_EQ(word[3], 1u);
    EXPECT_LT(static_cast<std::int64_t>(word[1]), head["until_ns"].get<std::int64_t>());
}

TEST_F(ProbeProtocol, a_congested_client_loses_nothing_until_its_ring_is_full) {
    ask({{"probe", {"s.out"}}, {"buffer_ms", 100}});  // 128 rows
    std::string events;
    machine.must("start\nadvance 100 cycles\n");
    connection.publish(connection.next_due_ns(), true, events);
    EXPECT_EQ(events, "");
    machine.must("advance 100 cycles\n");
    connection.publish(connection.next_due_ns(), false, events);
    const Json head = Json::parse(events.substr(0, events.find('\n')));
    EXPECT_EQ(head["parts"][0]["rows"], 128);
    EXPECT_EQ(head["parts"][0]["lost"], 72);
    EXPECT_EQ(ask({{"unprobe", 1}})["lost"], 72);
}

TEST_F(ProbeProtocol, rejected_requests_say_why) {
    EXPECT_EQ(refusal({{"probe", {"s.uot"}}}),
              "unknown pin, parameter or signal 's.uot'; did you mean 's.out'?");
    EXPECT_EQ(refusal({{"probe", "s.out"}}), "probe must be an array of names");
    EXPECT_EQ(refusal({{"probe", {"s.out"}}, {"every", 0}}),
              "every must be a whole number from 1 to 1000000");
    EXPECT_EQ(refusal({{"probe", {"s.out"}}, {"buffer_ms", 1}}),
              "buffer_ms must be a whole number from 10 to 60000");
    EXPECT_EQ(refusal({{"unprobe", 7}}), "unknown probe 7");
    EXPECT_EQ(refusal({{"journal", 1}}), "journal must be true or false");
    for (int i = 0; i < 64; ++i) {
        EXPECT_EQ(ask({{"probe", {"s.out"}}})["ok"], true);
    }
    EXPECT_EQ(refusal({{"probe", {"s.out"}}}), "a client has at most 64 probes");
}

TEST_F(ProbeProtocol, the_journal_has_edits_and_commands_but_no_queries) {
    ask({{"journal", true}});
    machine.must("getp s.out\nsetp s.in1 4\nstart\n");
    ask({{"set", {{"a.in1", true}}}});
    const hal_messages& messages = machine.session.event_log().for_plugins();
    constexpr std::string_view line = "canopen.0: node 3: emergency 8110h";
    messages.add(&messages, line.data(), line.size());  // of an instance
    std::string events;
    connection.publish(connection.next_due_ns(), false, events);
    EXPECT_NE(events.find(R"("kind":"edit","text":"setp s.in1 4"})"), events.npos) << events;
    EXPECT_NE(events.find(R"("kind":"command","text":"start"})"), events.npos) << events;
    EXPECT_NE(events.find(R"("kind":"edit","text":"setp a.in1 TRUE"})"), events.npos) << events;
    EXPECT_NE(events.find(R"("kind":"message","text":"canopen.0: node 3: emergency 8110h"})"),
              events.npos)
        << events;
    EXPECT_EQ(events.find("getp"), events.npos) << events;
    ask({{"journal", false}});
    messages.add(&messages, line.data(), line.size());
    ask({{"journal", true}});
    events.clear();
    connection.publish(connection.next_due_ns(), false, events);
    EXPECT_EQ(events, "") << "nobody listened";
    ask({{"journal", false}});
    EXPECT_EQ(connection.next_due_ns(), INT64_MAX);
}

TEST_F(ProbeProtocol, the_journal_tells_rejected_edits_from_others) {
    ask({{"journal", true}});
    const auto run = [this](const std::string& text) {
        TextOutput output;
        machine.shell.run_text("t.hal", text, output);
    };
    run("setp nope 1");
    run("setp s.in1 4\nsetp s.in2 five\n");
    run("lock nothing");
    run("loadusr -w false");
    EXPECT_EQ(ask({{"set", {{"s.out", 1}}}})["ok"], false);
    std::string events;
    connection.publish(connection.next_due_ns(), false, events);
    EXPECT_EQ(events.find(R"("kind":"edit")"), events.npos) << events;
    for (const char* const entry :
         {R"("kind":"rejected","text":"setp nope 1: unknown pin 'nope'")",
          R"("kind":"rejected","text":"2 edits: )", R"("kind":"rejected","text":"lock nothing: )",
          R"("kind":"rejected","text":"setp s.out 1: )",
          R"("kind":"command","text":"loadusr -w false")",
          R"("kind":"failed","text":"loadusr -w false: 'false' )"}) {
        EXPECT_NE(events.find(entry), events.npos) << entry << "\n" << events;
    }
}

TEST_F(ServerTest, a_client_reads_batches_layouts_and_replies_between_them) {
    serve();
    machine->must("start\n");
    const auto one = client();
    const auto other = client();
    std::string problem;
    EXPECT_EQ(ProbeClient::attach(*one, {"nothing"}, {}, problem), nullptr);
    EXPECT_EQ(problem, "unknown pin, parameter or signal 'nothing'");
    ProbeClient::Options options;
    options.batch_ms = 1;
    options.journal = true;
    const auto probe = ProbeClient::attach(*one, {"s.out", "a.out"}, options, problem);
    ASSERT_NE(probe, nullptr) << problem;
    ASSERT_EQ(probe->groups().size(), 2u) << "a has no thread";
    bool layout = false;
    bool journal = false;
    std::size_t rows = 0;
    std::size_t wide = 0;
    for (int turn = 0; turn < 2000 && !(layout && journal && wide > 10); ++turn) {
        ASSERT_EQ(other->run("advance 3 cycles").status, 0);
        if (turn == 20) {
            ASSERT_EQ(other->run("addf a t").status, 0);
        }
        if (turn % 7 == 0) {
            ASSERT_EQ(one->run("getp a.out").out, "FALSE\n");
        }
        ProbeBatch batch;
        for (auto got = probe->next(batch, 0); got != ProbeClient::Got::nothing;
             got = probe->next(batch, 0)) {
            ASSERT_NE(got, ProbeClient::Got::disconnected);
            layout = layout || got == ProbeClient::Got::layout;
            journal =
                journal || (got == ProbeClient::Got::journal && probe->entry().text == "addf a t");
            if (got != ProbeClient::Got::batch) continue;
            std::int64_t last = 0;
            batch.in_time_order([&](const ProbeBatch::Part& part, std::size_t row) {
                EXPECT_GE(batch.time_ns(part, row), last);
                last = batch.time_ns(part, row);
                ++rows;
                wide += part.columns == 2;
            });
        }
    }
    EXPECT_TRUE(layout);
    EXPECT_TRUE(journal);
    EXPECT_GT(wide, 10u);
    EXPECT_GT(rows, wide);
    EXPECT_EQ(probe->lost(), 0u);
}

}  // namespace
}  // namespace hal::test
