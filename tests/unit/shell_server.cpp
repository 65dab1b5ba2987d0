// SPDX-License-Identifier: MIT
// The control server: what clients can do, and that the machine keeps running whatever they do.
#include "shell_server.hpp"

#include <csignal>

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>

#include "machine/processes/address.hpp"

namespace hal::test {
namespace {

TEST_F(ServerTest, a_client_runs_commands_reads_and_completes) {
    serve();
    const auto c = client();
    EXPECT_EQ(c->instance(), "test");
    EXPECT_EQ(c->pid(), getpid());
    EXPECT_EQ(c->run("setp a.in0 1").status, 0);
    EXPECT_EQ(c->run("getp a.in0").out, "TRUE\n");
    const auto failed = c->run("getp nothing", "<commandline>");
    EXPECT_EQ(failed.status, 1);
    EXPECT_NE(failed.err.find("<commandline>:1:6"), std::string::npos) << failed.err;
    EXPECT_EQ(c->complete("getp a.o", 8).candidates[0].text, "a.out");
    Client::Options options;
    options.script = true;
    EXPECT_TRUE(c->set_options(options));
    EXPECT_EQ(c->run("show pin a.out").out, "and2 bit   OUT FALSE a.out\n\n");
    setenv("HALCYON_TEST_VALUE", "2.5", 1);
    EXPECT_EQ(c->run("setp s.in0 $HALCYON_TEST_VALUE").status, 0);
    EXPECT_EQ(c->run_text("x.hal", "setp s.in1 $(HALCYON_TEST_VALUE)\ngetp s.in0\n").out, "2.5\n");
    EXPECT_TRUE(c->run("quit").quit);
    EXPECT_TRUE(c->run("begin").collecting);
}

TEST_F(ServerTest, pipelined_requests_are_answered_in_order) {
    serve();
    const auto c = client();
    std::vector<std::uint64_t> ids;
    for (int i = 0; i < 5000; ++i) {
        ids.push_back(c->send({{"run", "setp s.in0 " + std::to_string(i)}}));
    }
    for (const auto id : ids) {
        EXPECT_EQ(c->wait(id)["status"], 0);
    }
    EXPECT_EQ(c->run("getp s.in0").out, "4999\n");
    EXPECT_EQ(server->counts().requests, 5001U);
}

TEST_F(ServerTest, many_clients_are_served_at_once) {
    serve();
    std::vector<std::unique_ptr<Client>> clients;
    for (int i = 0; i < 40; ++i) {
        clients.push_back(client());
    }
    std::vector<std::uint64_t> ids;
    for (auto& c : clients) {
        ids.push_back(c->send({{"read", {"a.in0"}}}));
    }
    for (std::size_t i = clients.size(); i-- > 0;) {
        EXPECT_EQ(clients[i]->wait(ids[i])["ok"], true);
    }
    EXPECT_EQ(server->counts().clients, 40U);
    clients.clear();
    EXPECT_TRUE(eventually([&] { return server->counts().clients == 0; }));
}

TEST_F(ServerTest, subscriptions_send_values_by_themselves) {
    serve();
    const auto c = client();
    EXPECT_EQ(c->request({{"subscribe", {"a.in0"}}, {"every_ms", 1}})["ok"], true);
    Json event;
    ASSERT_TRUE(c->next_event(event, 10'000));
    EXPECT_EQ(event["values"], (Json{false}));
    EXPECT_EQ(c->run("setp a.in0 1").status, 0);
    EXPECT_TRUE(
        eventually([&] { return c->next_event(event, 10'000) && event["values"] == Json{true}; }));
}

TEST_F(ServerTest, a_waiting_command_holds_up_nobody_else_and_ends_with_its_client) {
    serve();
    auto waiting = client();
    const auto id = waiting->send({{"run", "loadusr -w sleep 1000"}});
    const auto after = waiting->send({{"run", "getp a.in0"}});
    EXPECT_TRUE(alive());
    waiting->send({{"cancel", true}});
    EXPECT_NE(waiting->wait(id)["err"].get<std::string>().find("[interrupted]"), std::string::npos);
    EXPECT_EQ(waiting->wait(after)["out"], "FALSE\n");

    const auto second = waiting->send({{"run", "loadusr -Wn nobody sleep 1000"}});
    (void)second;
    EXPECT_TRUE(eventually([&] { return client()->run("list comp nobody").out == "nobody \n"; }));
    waiting.reset();
    EXPECT_TRUE(eventually([&] { return server->counts().clients == 0; }));
    EXPECT_TRUE(alive());
}

TEST_F(ServerTest, an_open_transaction_is_discarded_when_its_client_disconnects) {
    serve();
    auto c = client();
    c->run("begin");
    c->run("setp a.in0 1");
    c.reset();
    EXPECT_TRUE(eventually([&] { return server->counts().clients == 0; }));
    EXPECT_EQ(client()->run("getp a.in0").out, "FALSE\n");
}

// --- clients that behave badly ---------------------------------------------------------------------------------------------

TEST_F(ServerTest, invalid_requests_get_an_error_and_the_connection_continues) {
    serve();
    Wire wire(server->path());
    ASSERT_TRUE(wire.connected);
    EXPECT_EQ(Json::parse(wire.line())["halcyon"], 1);
    wire.send("hello?\r\n\n\xff\xfe\n{\"id\":1,\"run\":\"getp a.out\"}\r\n");
    EXPECT_EQ(Json::parse(wire.line())["ok"], false);
    EXPECT_EQ(Json::parse(wire.line())["ok"], false);
    EXPECT_EQ(Json::parse(wire.line())["out"], "FALSE\n");
    EXPECT_TRUE(eventually([&] { return server->counts().invalid_requests == 2; }));
}

TEST_F(ServerTest, a_line_received_in_parts_is_one_request) {
    serve();
    Wire wire(server->path());
    wire.line();
    for (const char c : std::string("{\"id\":1,\"run\":\"getp a.out\"}\n")) {
        wire.send(std::string_view(&c, 1));
    }
    EXPECT_EQ(Json::parse(wire.line())["out"], "FALSE\n");
}

TEST_F(ServerTest, a_client_that_has_ended_its_requests_gets_all_replies) {
    serve();
    Wire wire(server->path());
    wire.line();
    wire.send(
        "{\"id\":1,\"run\":\"setp a.in0 1\"}\n{\"id\":2,\"run\":\"advance 1 cycles\"}\n"
        "{\"id\":3,\"run\":\"getp a.in0\"}\n{\"options\":{},\"id\":4}\n{\"id\":5,\"ru");
    wire.end_requests();
    for (int id = 1; id <= 4; ++id) {
        EXPECT_EQ(Json::parse(wire.line(), nullptr, false)["id"], id);
    }
    EXPECT_EQ(wire.line(), "");
    EXPECT_TRUE(eventually([&] { return server->counts().clients == 0; }));
}

TEST_F(ServerTest, more_replies_than_the_queue_holds_reach_a_client_that_has_ended_its_requests) {
    ServerOptions options;
    options.queue = 10'000;
    serve(options);
    Wire wire(server->path());
    wire.line();
    constexpr int requests = 200;
    std::string all;
    for (int id = 0; id < requests; ++id) {
        all += "{\"id\":" + std::to_string(id) + ",\"run\":\"show pin\"}\n";
    }
    ASSERT_TRUE(wire.send(all));
    wire.end_requests();
    for (int id = 0; id < requests; ++id) {
        ASSERT_EQ(Json::parse(wire.line(), nullptr, false)["id"], id);
    }
    EXPECT_EQ(wire.line(), "");
}

TEST_F(ServerTest, a_command_that_waits_is_answered_after_the_client_has_ended_its_requests) {
    serve();
    Wire wire(server->path());
    wire.line();
    wire.send(
        "{\"id\":1,\"run\":\"loadusr -w sh -c 'sleep 0.1'\"}\n"
        "{\"id\":2,\"run\":\"getp a.out\"}\n");
    wire.end_requests();
    EXPECT_EQ(Json::parse(wire.line(), nullptr, false)["id"], 1);
    EXPECT_EQ(Json::parse(wire.line(), nullptr, false)["out"], "FALSE\n");
    EXPECT_EQ(wire.line(), "");
}

TEST_F(ServerTest, a_truncated_request_is_never_executed) {
    serve();
    {
        Wire wire(server->path());
        wire.line();
        wire.send("{\"id\":1,\"run\":\"setp a.in0 1\"}");  // no end of line
    }
    EXPECT_TRUE(eventually(
        [&] { return server->counts().accepted == 1 && server->counts().clients == 0; }));
    EXPECT_EQ(client()->run("getp a.in0").out, "FALSE\n");
    EXPECT_EQ(server->counts().requests, 1U);
}

TEST_F(ServerTest, a_line_of_100_megabytes_is_rejected_and_skipped) {
    serve();
    Wire wire(server->path());
    wire.line();
    const std::string megabyte(1 << 20, 'x');
    wire.send("{\"run\":\"");
    for (int i = 0; i < 100; ++i) {
        ASSERT_TRUE(wire.send(megabyte));
    }
    EXPECT_TRUE(alive());
    wire.send("\"}\n{\"id\":2,\"run\":\"getp a.out\"}\n");
    const Json refused = Json::parse(wire.line());
    EXPECT_EQ(refused["ok"], false);
    EXPECT_NE(refused["error"].get<std::string>().find("longer than 16777216 bytes"),
              std::string::npos)
        << refused;
    EXPECT_EQ(Json::parse(wire.line())["id"], 2);
}

TEST_F(ServerTest, a_client_that_never_reads_is_disconnected_and_the_reason_is_logged) {
    ServerOptions options;
    options.queue = 10'000;
    options.stall_ms = 20;
    serve(options);
    Wire wire(server->path());
    const std::string request = "{\"run\":\"help\"}\n";
    std::string many;
    for (int i = 0; i < 1000; ++i) {
        many += request;
    }
    EXPECT_TRUE(eventually([&] {
        wire.push(many);
        return server->counts().dropped == 1;
    }));
    EXPECT_TRUE(eventually([&] { return log().find("nothing read") != std::string::npos; }))
        << log();
    EXPECT_TRUE(eventually([&] { return server->counts().clients == 0; }));
    EXPECT_TRUE(alive());
}

TEST_F(ServerTest, a_subscriber_that_sleeps_misses_values_but_stays) {
    ServerOptions options;
    options.stall_ms = 20;
    serve(options);
    Wire wire(server->path());
    wire.line();
    std::string names = "\"a.in0\"";
    for (int i = 0; i < 5000; ++i) {
        names += ",\"a.in0\"";
    }
    wire.send("{\"subscribe\":[" + names + "],\"every_ms\":1}\n");
    EXPECT_EQ(Json::parse(wire.line())["subscription"], 1);
    // The client reads nothing while others are served; then it resumes, and an event has the
    // number of skipped ones.
    for (int i = 0; i < 100; ++i) {
        EXPECT_TRUE(alive());
    }
    EXPECT_TRUE(eventually([&] { return Json::parse(wire.line()).contains("skipped"); }));
    EXPECT_EQ(server->counts().dropped, 0U);
}

TEST_F(ServerTest, clients_that_connect_and_disconnect_leak_nothing) {
    serve();
    for (int i = 0; i < 200; ++i) {
        Wire wire(server->path());
        if (i % 3 == 0) {
            wire.send(
                "{\"run\":\"show pin\"}\n{\"run\":\"advance 100 cycles\"}\n{\"run\":\"loadusr -w "
                "sleep 1000\"}\n");
        }
        if (i % 3 == 1) {
            wire.send("{\"subscribe\":[\"a.in0\"],\"every_ms\":1}\n{\"ru");
        }
        wire.shut();
    }
    EXPECT_TRUE(eventually(
        [&] { return server->counts().accepted == 200 && server->counts().clients == 0; }));
    EXPECT_TRUE(alive());
    const auto lock = machine->session.lock();
    EXPECT_FALSE(machine->session.in_transaction());
}

TEST_F(ServerTest, an_operator_gets_in_when_all_places_are_taken_by_idle_clients) {
    ServerOptions options;
    options.max_clients = 4;
    options.reserved = 2;
    options.idle_ms = 300'000;  // nobody counts as idle here: the reserved places alone have to do
    serve(options);
    std::vector<std::unique_ptr<Wire>> idle;
    for (int i = 0; i < 4; ++i) {
        idle.push_back(std::make_unique<Wire>(server->path()));
        EXPECT_EQ(Json::parse(idle.back()->line())["halcyon"], 1);
    }
    for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(client()->run("getp a.out").out, "FALSE\n");
    }
    EXPECT_EQ(client()->run("stop").status, 0);
    EXPECT_EQ(client()->stop().status, 0);
    EXPECT_EQ(server->counts().reclaimed, 0U);
}

TEST_F(ServerTest, idle_clients_are_closed_first_and_are_told_why) {
    ServerOptions options;
    options.max_clients = 3;
    options.reserved = 1;
    options.idle_ms = 20;
    serve(options);
    Wire subscriber(server->path()), component(server->path()), idle(server->path());
    subscriber.send("{\"subscribe\":[\"a.out\"],\"every_ms\":3600000}\n");
    component.send("{\"component\":\"panel\"}\n");
    EXPECT_EQ(Json::parse(idle.line())["halcyon"], 1);
    EXPECT_TRUE(eventually([&] { return server->counts().requests == 2; }));
    usleep(50'000);
    auto operator_ = client();
    const Json event = Json::parse(idle.line());
    EXPECT_EQ(event["event"], "closed");
    EXPECT_NE(event["reason"].get<std::string>().find(
                  "more than 3 clients are connected, and this one sent no request for"),
              std::string::npos)
        << event;
    EXPECT_EQ(idle.line(), "");
    EXPECT_EQ(operator_->run("getp a.out").out, "FALSE\n");
    EXPECT_TRUE(eventually([&] { return server->counts().clients == 3; }))
        << "those on which something depends stay";
    Wire fourth(server->path());
    EXPECT_TRUE(eventually([&] { return !operator_->look(); })) << "it is idle now";
    EXPECT_NE(operator_->closed_because().find("more than 3 clients"), std::string::npos)
        << operator_->closed_because();
}

TEST_F(ServerTest, a_reserved_place_is_not_kept_by_a_component) {
    ServerOptions options;
    options.max_clients = 2;
    options.reserved = 1;
    serve(options);
    Wire first(server->path()), second(server->path());
    first.line();
    second.line();
    first.send("{\"component\":\"first\"}\n");
    second.send("{\"component\":\"second\"}\n");
    EXPECT_EQ(Json::parse(first.line())["ok"], true);
    EXPECT_EQ(Json::parse(second.line())["ok"], true);
    {
        Wire third(server->path());
        third.line();
        third.send("{\"component\":\"third\"}\n");
        EXPECT_EQ(Json::parse(third.line())["error"],
                  "no connection is left for a component: 2 clients are connected, and further "
                  "connections are reserved for commands; end a program ('show comp' lists them), "
                  "or give one component the pins of several");
        third.send("{\"run\":\"getp a.out\"}\n");
        EXPECT_EQ(Json::parse(third.line())["out"], "FALSE\n") << "it serves commands";
    }
    first.shut();
    EXPECT_TRUE(eventually([&] { return server->counts().clients == 1; }));
    Wire fourth(server->path());
    fourth.line();
    fourth.send("{\"component\":\"fourth\"}\n");
    EXPECT_EQ(Json::parse(fourth.line())["ok"], true) << "a place is free again";
    EXPECT_EQ(client()->run("stop").status, 0);
}

TEST_F(ServerTest, a_reserved_place_is_not_kept_by_a_subscription) {
    ServerOptions options;
    options.max_clients = 1;
    options.reserved = 1;
    options.idle_ms = 20;
    serve(options);
    Wire first(server->path());
    first.send("{\"subscribe\":[\"a.out\"],\"every_ms\":3600000}\n");
    EXPECT_TRUE(eventually([&] { return server->counts().requests == 1; }));
    Wire second(server->path());
    second.send("{\"subscribe\":[\"a.out\"],\"every_ms\":3600000}\n");
    EXPECT_TRUE(eventually([&] { return server->counts().requests == 2; }));
    EXPECT_EQ(client()->run("getp a.out").out, "FALSE\n");
    EXPECT_EQ(server->counts().reclaimed, 1U);
}

/// Interrupts the system calls of this thread, each 50 ms, while it exists.
class Interruptions {
public:
    Interruptions() {
        struct sigaction ignored{};
        ignored.sa_handler = [](int) {};  // without SA_RESTART
        sigaction(SIGALRM, &ignored, &before_);
        set(50'000);
    }
    ~Interruptions() {
        set(0);
        sigaction(SIGALRM, &before_, nullptr);
    }

private:
    static void set(suseconds_t us) {
        const itimerval period{{0, us}, {0, us}};
        setitimer(ITIMER_REAL, &period, nullptr);
    }

    struct sigaction before_{};
};

TEST_F(ServerTest, a_machine_that_says_nothing_does_not_answer_also_when_waiting_is_interrupted) {
    serve();
    const std::string path = found_socket("test");
    server.reset();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    const int silent = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    ASSERT_EQ(bind(silent, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ASSERT_EQ(listen(silent, 1), 0);
    std::string problem;
    {
        const Interruptions interruptions;
        EXPECT_EQ(Client::connect("test", problem), nullptr);
    }
    EXPECT_EQ(problem, "instance 'test' does not answer");
    close(silent);
}

}  // namespace
}  // namespace hal::test
