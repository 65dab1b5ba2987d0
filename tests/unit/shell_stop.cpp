// SPDX-License-Identifier: MIT
// `stop` waits for no other client: not for the session's lock, not for a place, not for a descriptor.
#include "shell_server.hpp"

#include <fcntl.h>
#include <sys/resource.h>

#include <atomic>
#include <vector>

namespace hal::test {
namespace {

/// A machine whose threads run; its lock, held by a test, is the work of another client.
struct StopTest : testing::Test {
    StopTest() {
        setenv("XDG_RUNTIME_DIR", folder.path.c_str(), 1);
        machine = std::make_unique<ShellMachine>(ShellOptions{}, shell_session("test", false));
        machine->must(
            "loadrt sum2 names=s\nnewthread fast 1000000\nnewthread slow 1000000000\naddf s "
            "slow\nstart\n");
        options.stop = [this] { ended = true; };
    }
    ~StopTest() override { server.reset(); }
    void serve() {
        server = std::make_unique<Server>(machine->shell, options);
        Diagnostics diagnostics;
        ASSERT_TRUE(server->start(diagnostics)) << render(diagnostics, machine->session.sources);
    }
    std::unique_ptr<Client> client() {
        std::string problem;
        auto made = Client::connect("test", problem);
        EXPECT_NE(made, nullptr) << problem;
        return made;
    }
    void start() {
        const auto lock = machine->session.lock();
        EXPECT_TRUE(machine->session.threads().start());
    }

    Folder folder;
    std::unique_ptr<ShellMachine> machine;
    ServerOptions options;
    std::atomic<bool> ended{false};
    std::unique_ptr<Server> server;
};

TEST_F(StopTest, stop_is_carried_out_while_another_client_has_the_machine) {
    serve();
    const auto busy = client();
    const auto calm = client();
    auto lock = machine->session.lock();
    const auto waiting = busy->send({{"run", "getp s.out"}});
    Client::Options how;
    how.script = true;
    EXPECT_TRUE(calm->set_options(how));
    EXPECT_TRUE(machine->session.threads().running());
    EXPECT_EQ(calm->run("stop").status, 0);
    EXPECT_FALSE(machine->session.threads().running());
    machine->session.threads().start();
    const auto words = calm->request({{"id", "x"}, {"run", {"stop"}}});
    EXPECT_EQ(words["status"], 0);
    EXPECT_FALSE(machine->session.threads().running());
    EXPECT_EQ(calm->stop().status, 0);
    EXPECT_TRUE(eventually([this] { return ended.load(); }));
    lock.unlock();
    EXPECT_EQ(busy->wait(waiting)["status"], 0);
}

TEST_F(StopTest, outputs_have_their_safe_values_when_stop_has_been_answered) {
    machine->must("loadrt charge_pump names=pump\naddf pump fast\nstart\n");
    serve();
    const auto c = client();
    for (int i = 0; i < 20; ++i) {
        start();
        EXPECT_EQ(c->run("stop").status, 0);
        const std::string once = c->run("getp pump.out").out;
        for (int look = 0; look < 3; ++look) {
            EXPECT_EQ(c->run("getp pump.out").out, once);
        }
    }
}

TEST_F(StopTest, stop_in_a_transaction_and_a_locked_stop_keep_their_rules) {
    serve();
    const auto c = client();
    EXPECT_EQ(c->run("begin").status, 0);
    EXPECT_EQ(c->run("stop").status, 0);
    EXPECT_TRUE(machine->session.threads().running());
    EXPECT_EQ(c->run("commit").status, 0);
    EXPECT_FALSE(machine->session.threads().running());
    start();
    EXPECT_EQ(c->run("lock all").status, 0);
    EXPECT_NE(c->run("stop").err.find("[locked]"), std::string::npos);
    EXPECT_TRUE(machine->session.threads().running());
}

TEST_F(StopTest, pipelined_requests_before_a_stop_are_executed_first) {
    serve();
    const auto c = client();
    const auto set = c->send({{"run", "setp s.in0 5"}});
    const auto stop = c->send({{"run", "stop"}});
    const auto start = c->send({{"run", "start"}});
    EXPECT_EQ(c->wait(start)["status"], 0);
    EXPECT_EQ(c->wait(stop)["status"], 0);
    EXPECT_EQ(c->wait(set)["status"], 0);
    EXPECT_TRUE(machine->session.threads().running());
}

TEST_F(StopTest, stop_gets_in_when_all_places_are_taken_by_clients_that_wait) {
    options.max_clients = 3;
    options.reserved = 1;
    serve();
    const auto lock = machine->session.lock();
    std::vector<std::unique_ptr<Client>> busy;
    for (int i = 0; i < 12; ++i) {  // more than there are places
        busy.push_back(client());
        busy.back()->send({{"run", "getp s.out"}});
    }
    EXPECT_EQ(client()->run("stop").status, 0);
    EXPECT_FALSE(machine->session.threads().running());
    EXPECT_EQ(client()->stop().status, 0);
    EXPECT_TRUE(eventually([this] { return ended.load(); }));
}

TEST_F(StopTest, a_client_without_a_place_gets_one_when_another_leaves) {
    options.max_clients = 1;
    options.reserved = 1;
    options.idle_ms = 300'000;
    serve();
    auto first = client();
    auto second = client();
    auto third = client();
    const auto id = third->send({{"run", "getp s.in0"}});
    first.reset();
    EXPECT_EQ(third->wait(id)["out"], "0\n");
}

TEST_F(StopTest, stop_gets_in_when_the_process_has_no_descriptor_left) {
    serve();
    const auto lock = machine->session.lock();
    std::vector<std::unique_ptr<Client>> busy;
    for (int i = 0; i < 3; ++i) {
        busy.push_back(client());
        busy.back()->send({{"run", "getp s.out"}});
    }
    // This process is client and server: the client's descriptor comes first, the server has none
    // but that in reserve.
    const auto calm = std::make_unique<Wire>("");
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    std::vector<int> filler;
    rlimit few = before;
    few.rlim_cur = 200;
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
    for (int fd; (fd = open("/dev/null", O_RDONLY | O_CLOEXEC)) >= 0;) {
        filler.push_back(fd);
    }
    calm->connect_to(server->path());
    EXPECT_TRUE(calm->send("{\"id\":1,\"options\":{}}\n{\"id\":2,\"run\":\"stop\"}\n"));
    calm->line();  // hello
    EXPECT_EQ(Json::parse(calm->line())["ok"], true);
    EXPECT_EQ(Json::parse(calm->line())["status"], 0);
    EXPECT_FALSE(machine->session.threads().running());
    for (const int fd : filler) {
        close(fd);
    }
    setrlimit(RLIMIT_NOFILE, &before);
}

TEST_F(StopTest, an_interrupted_session_ends_the_texts_and_queries_of_clients_early) {
    serve();
    const auto c = client();
    std::string text;
    for (int i = 0; i < 1000; ++i) {
        text += "newsig x" + std::to_string(i) + " float\n";
    }
    machine->session.interrupt();
    const auto reply = c->request({{"script", text}});
    EXPECT_EQ(reply["ok"], false) << reply;
    EXPECT_EQ(machine->file(text), 1);
    EXPECT_NE(machine->err.find("'newsig' was interrupted"), std::string::npos) << machine->err;
    const auto lock = machine->session.lock();
    EXPECT_EQ(machine->session.model().find_signal("x0"), nullptr);
}

TEST_F(StopTest, a_waiting_command_states_that_the_machine_ends) {
    serve();
    const auto c = client();
    const auto id = c->send({{"run", "loadusr -w sleep 1000"}});
    EXPECT_TRUE(eventually([&] {
        const auto lock = machine->session.lock();
        return !machine->session.programs().idle();
    }));
    machine->session.interrupt();
    const std::string text = c->wait(id)["err"].get<std::string>();
    EXPECT_NE(text.find("'loadusr' was interrupted: the machine ends"), std::string::npos) << text;
}

TEST_F(StopTest, a_component_is_served_until_the_machine_has_ended_also_after_a_rejection) {
    serve();
    const auto c = client();
    const Json pin{{"name", "out"}, {"type", "float"}, {"dir", "out"}};
    ASSERT_EQ(c->request({{"component", "p"}, {"pins", Json::array({pin})}})["ok"], true);
    machine->session.interrupt();
    EXPECT_EQ(c->request({{"list", "pin"}})["error"], "the machine ends");
    const std::uint64_t before = server->counts().requests;
    const auto exchange = c->send({{"exchange", "p"}, {"write", {0, 1.5}}});
    ASSERT_TRUE(eventually([&] { return server->counts().requests > before; }));
    EXPECT_EQ(c->wait(exchange)["ok"], true);
    EXPECT_EQ(c->request({{"list", "pin"}})["error"], "the machine ends");
    EXPECT_EQ(c->stop().status, 0);
    EXPECT_TRUE(eventually([this] { return ended.load(); }));
}

}  // namespace
}  // namespace hal::test
