// SPDX-License-Identifier: MIT
// What several threads do with one connection at a time, and with one machine through several. To
// be run under ThreadSanitizer, too.
#include <atomic>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "control/client.hpp"
#include "control/connection.hpp"
#include "control/server.hpp"
#include "machine.hpp"
#include "shell_machine.hpp"

namespace hal::test {
namespace {

using Json = nlohmann::json;

constexpr const char* netlist =
    "loadrt and2 names=a,b\nloadrt sum2 names=s\nnewthread t 1000000\naddf s t\nnewsig level "
    "float\n";

TEST(ConnectionThreads,
     values_are_published_while_another_thread_subscribes_edits_and_unsubscribes) {
    ShellMachine machine;
    machine.must(netlist);
    Connection connection(machine.shell, 1);
    std::atomic<bool> over{false};
    std::atomic<int> rounds{0};
    std::string events;
    std::thread publisher([&] {
        for (std::int64_t now = 0; !over; ++rounds) {
            // asked once: the last subscription may end between two calls
            if (const std::int64_t due = connection.next_due_ns(); due != INT64_MAX) {
                now = due;
            }
            connection.publish(now, rounds % 5 == 0, events);
            if (connection.idle()) {
                EXPECT_GE(connection.requests(), connection.invalid_requests());
            }
        }
    });
    std::thread canceller([&] {
        while (!over) {
            EXPECT_TRUE(connection.cancels("{\"cancel\":true}"));
            connection.cancel(false);
        }
    });
    const auto ask = [&](const std::string& line) {
        std::string reply;
        EXPECT_NE(connection.handle(line, reply, true), Connection::Handled::wants_thread);
        return Json::parse(reply);
    };
    for (int i = 0; i < 200; ++i) {
        const Json made =
            ask(R"({"subscribe":["s.out","level","a.out","nothing"],"every_ms":1,"changes":)" +
                std::string(i % 2 == 0 ? "true}" : "false}"));
        ASSERT_EQ(made["ok"], true) << made;
        EXPECT_EQ(ask(R"({"run":"net level s.out"})")["status"], 0);
        EXPECT_EQ(ask(R"({"set":{"s.in0":)" + std::to_string(i) + "}}")["ok"], true);
        EXPECT_EQ(ask(R"({"script":"begin\nunlinkp s.out\ncommit\n"})")["status"], 0);
        const int before = rounds;
        while (rounds == before) {
            std::this_thread::yield();
        }
        EXPECT_EQ(ask(R"({"unsubscribe":)" + made["subscription"].dump() + "}")["ok"], true);
        EXPECT_EQ(ask("{\"nonsense\":1}")["ok"], false);
    }
    over = true;
    publisher.join();
    canceller.join();
    EXPECT_TRUE(connection.idle());
    EXPECT_EQ(connection.next_due_ns(), INT64_MAX);
    EXPECT_NE(events.find("\"event\":\"values\""), std::string::npos);
}

TEST(ConnectionThreads, a_connection_that_executes_a_request_or_collects_edits_is_not_idle) {
    ShellMachine machine;
    machine.must(netlist);
    Connection connection(machine.shell, 1);
    std::string replies;
    EXPECT_TRUE(connection.idle());
    connection.handle(R"({"run":"begin"})", replies);
    EXPECT_FALSE(connection.idle());
    connection.handle(R"({"run":"abort"})", replies);
    EXPECT_TRUE(connection.idle());
    std::thread worker(
        [&] { connection.handle(R"({"run":"loadusr -w sleep 1000"})", replies, true); });
    EXPECT_TRUE(eventually([&] { return !connection.idle(); }));
    connection.cancel();
    worker.join();
    EXPECT_TRUE(connection.idle());
}

TEST(ServerThreads, clients_subscribe_edit_wait_and_disconnect_at_the_same_time) {
    const Folder folder;
    setenv("XDG_RUNTIME_DIR", folder.path.c_str(), 1);
    ShellMachine machine;
    machine.must(netlist);
    Server server(machine.shell);
    Diagnostics diagnostics;
    ASSERT_TRUE(server.start(diagnostics)) << render(diagnostics, machine.session.sources);
    std::vector<std::thread> threads;
    for (int number = 0; number < 4; ++number) {
        threads.emplace_back([number] {
            const std::string name = "x" + std::to_string(number);
            for (int turn = 0; turn < 10; ++turn) {
                std::string problem;
                const auto client = Client::connect("test", problem);
                ASSERT_TRUE(client) << problem;
                EXPECT_EQ(client->request(
                              {{"subscribe", {"s.out", name + ".out"}}, {"every_ms", 1}})["ok"],
                          true);
                EXPECT_EQ(client->run("loadrt and2 names=" + name).status, 0);
                Json event;
                EXPECT_TRUE(client->next_event(event, -1));
                // in a thread of its own, while values go on coming
                EXPECT_EQ(client->run("loadusr -w true").status, 0);
                EXPECT_TRUE(client->next_event(event, -1));
                EXPECT_EQ(client->run("unloadrt " + name).status, 0);
                // and the client is gone
                if (turn % 2 == 0) {
                    client->send({{"run", "loadusr -w sleep 1000"}});
                }
            }
        });
    }
    for (std::thread& thread : threads) {
        thread.join();
    }
    EXPECT_TRUE(eventually([&] { return server.counts().clients == 0; }));
    EXPECT_EQ(server.counts().invalid_requests, 0U);
    const auto lock = machine.session.lock();
    EXPECT_FALSE(machine.session.in_transaction());
}

}  // namespace
}  // namespace hal::test
