// SPDX-License-Identifier: MIT
// The socket of an instance: its permissions, its name, and its removal.
#include "shell_server.hpp"

namespace hal::test {
namespace {

TEST_F(ServerTest, the_socket_is_accessible_to_its_user_only) {
    serve();
    struct stat about{};
    ASSERT_EQ(stat(server->path().c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0777, 0600U);
    ASSERT_EQ(stat(socket_folder().c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0777, 0700U);
    EXPECT_EQ(server->path(), folder.path + "/halcyon/test.sock");
}

TEST_F(ServerTest, a_second_instance_of_the_same_name_is_rejected) {
    serve();
    ShellMachine second;
    Server refused(second.shell);
    Diagnostics diagnostics;
    EXPECT_FALSE(refused.start(diagnostics));
    const std::string said = render(diagnostics, second.session.sources);
    EXPECT_NE(said.find("an instance named 'test' is already running (process " +
                        std::to_string(getpid()) + ") [instance-running]"),
              std::string::npos)
        << said;
    EXPECT_TRUE(alive());
    ShellMachine third({}, shell_session("third"));
    Server other(third.shell);
    Diagnostics none;
    EXPECT_TRUE(other.start(none));
    EXPECT_EQ(running_instances(), (std::vector<std::string>{"test", "third"}));
    std::string problem;
    EXPECT_EQ(Client::connect("fourth", problem), nullptr);
    EXPECT_EQ(problem,
              "no instance 'fourth' is running; running: test, third (choose with --name)");
}

/// Leaves the files of a dead instance in `folder`: a socket without a listener, a free lock.
void leave_behind(const Folder& folder, const std::string& name) {
    std::filesystem::create_directory(folder.path + "/halcyon");
    std::filesystem::permissions(folder.path + "/halcyon", std::filesystem::perms::owner_all);
    folder.write("halcyon/" + name + ".lock", "1\n");
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    (folder.path + "/halcyon/" + name + ".sock")
        .copy(address.sun_path, sizeof address.sun_path - 1);
    ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    close(fd);
}

TEST_F(ServerTest, files_of_a_dead_process_are_replaced) {
    leave_behind(folder, "test");
    serve();
    EXPECT_TRUE(alive());
    server.reset();
    EXPECT_FALSE(std::filesystem::exists(folder.path + "/halcyon/test.sock"));
    EXPECT_FALSE(std::filesystem::exists(folder.path + "/halcyon/test.lock"));
    std::string problem;
    EXPECT_EQ(Client::connect("test", problem), nullptr);
    EXPECT_EQ(problem, "no instance 'test' is running; start one with `hal run FILE.hal`");
}

TEST_F(ServerTest, files_of_dead_processes_are_removed_by_a_list_of_the_instances) {
    leave_behind(folder, "sim-1");
    leave_behind(folder, "default");
    EXPECT_TRUE(running_instances().empty());
    EXPECT_TRUE(std::filesystem::is_empty(folder.path + "/halcyon"));
}

TEST_F(ServerTest, files_of_dead_processes_are_removed_by_the_next_instance) {
    leave_behind(folder, "sim-1");
    serve();
    EXPECT_FALSE(std::filesystem::exists(folder.path + "/halcyon/sim-1.sock"));
    EXPECT_FALSE(std::filesystem::exists(folder.path + "/halcyon/sim-1.lock"));
    EXPECT_EQ(running_instances(), std::vector<std::string>{"test"});
    EXPECT_TRUE(alive());
}

TEST_F(ServerTest, files_that_no_instance_made_are_not_removed) {
    leave_behind(folder, "sim-1");
    folder.write("halcyon/cargo.lock", "version = 3\n");
    folder.write("halcyon/sim-1.lock", "1\n2\n");
    EXPECT_TRUE(running_instances().empty());
    EXPECT_TRUE(std::filesystem::exists(folder.path + "/halcyon/cargo.lock"));
    EXPECT_TRUE(std::filesystem::exists(folder.path + "/halcyon/sim-1.sock"));
    // a folder that a link leads to
    const std::string elsewhere = folder.path + "/elsewhere";
    std::filesystem::rename(folder.path + "/halcyon", elsewhere);
    folder.write("elsewhere/sim-1.lock", "1\n");
    std::filesystem::create_directory_symlink(elsewhere, folder.path + "/halcyon");
    EXPECT_TRUE(running_instances().empty());
    EXPECT_TRUE(std::filesystem::exists(elsewhere + "/sim-1.lock"));
}

TEST_F(ServerTest, an_instance_starts_while_others_list_the_instances) {
    std::atomic<bool> ends{false};
    std::thread lister([&ends] {
        while (!ends) {
            running_instances();
        }
    });
    for (int i = 0; i < 50; ++i) {
        leave_behind(folder, "test");
        serve();
        EXPECT_TRUE(alive());
        server.reset();
        std::filesystem::remove(folder.path + "/halcyon/test.sock");
    }
    ends = true;
    lister.join();
}

TEST_F(ServerTest, a_folder_of_another_user_is_rejected) {
    const auto said = [&](const std::string& name) {
        ShellMachine other({}, shell_session(name));
        Server refused(other.shell);
        Diagnostics diagnostics;
        EXPECT_FALSE(refused.start(diagnostics));
        return render(diagnostics, other.session.sources);
    };
    std::filesystem::create_directory_symlink("/tmp", folder.path + "/halcyon");
    EXPECT_NE(said("x").find("belongs to another user or is accessible to others [no-socket]"),
              std::string::npos)
        << said("x");
    std::filesystem::remove(folder.path + "/halcyon");
    folder.write("halcyon", "a file");
    EXPECT_NE(said("x").find("[no-socket]"), std::string::npos);
    for (const char* name : {"../x", "", ".x", "a b", "x/y"}) {
        EXPECT_NE(said(name).find("is not a valid instance name"), std::string::npos) << name;
    }
    EXPECT_NE(said(std::string(65, 'x')).find("[no-socket]"), std::string::npos);
    setenv("XDG_RUNTIME_DIR", (folder.path + "/" + std::string(100, 'd')).c_str(), 1);
    EXPECT_NE(said("x").find("too long"), std::string::npos);
}

TEST_F(ServerTest, stop_calls_back_and_the_end_is_clean) {
    std::atomic<bool> stopped{false};
    ServerOptions options;
    options.stop = [&] { stopped = true; };
    serve(std::move(options));
    const auto c = client();
    EXPECT_EQ(c->stop().status, 0);
    EXPECT_TRUE(eventually([&] { return stopped.load(); }));
    server.reset();
    EXPECT_EQ(c->run("getp a.out").err, "the connection to instance 'test' is lost\n");
    EXPECT_FALSE(c->connected());
    Json event;
    EXPECT_FALSE(c->next_event(event, -1));
}

TEST_F(ServerTest, the_default_instance_is_the_only_one_running) {
    EXPECT_EQ(instance_wanted("x"), "x");
    unsetenv("HALCYON_INSTANCE");
    EXPECT_EQ(instance_wanted(""), "default");
    serve();
    EXPECT_EQ(instance_wanted(""), "test");
    setenv("HALCYON_INSTANCE", "from-environment", 1);
    EXPECT_EQ(instance_wanted(""), "from-environment");
    unsetenv("HALCYON_INSTANCE");
}

}  // namespace
}  // namespace hal::test
