// SPDX-License-Identifier: MIT
// A machine with a control server, and raw connections to it.
#pragma once

#include <cstdlib>
#include <memory>
#include <thread>

#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "control/client.hpp"
#include "control/server.hpp"
#include "machine.hpp"
#include "machine/processes/address.hpp"
#include "shell_machine.hpp"

namespace hal::test {

using Json = nlohmann::json;

/// A raw connection: what a badly behaved program would do.
class Wire {
public:
    /// Makes a socket, and connects it unless the path is empty.
    explicit Wire(const std::string& path) : fd_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        if (!path.empty()) {
            connect_to(path);
        }
    }
    void connect_to(const std::string& path) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path.copy(address.sun_path, sizeof address.sun_path - 1);
        connected =
            ::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    }
    ~Wire() { close(fd_); }
    Wire(const Wire&) = delete;
    /// False when the other side has closed.
    bool send(std::string_view text) {
        while (!text.empty()) {
            const ssize_t gone = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
            if (gone <= 0) return false;
            text.remove_prefix(static_cast<std::size_t>(gone));
        }
        return true;
    }
    /// As much as the kernel takes without waiting.
    std::size_t push(std::string_view text) {
        const ssize_t gone = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        return gone > 0 ? static_cast<std::size_t>(gone) : 0;
    }
    /// The next line; empty when the other side has closed.
    std::string line() {
        std::size_t end;
        while ((end = in_.find('\n')) == in_.npos) {
            char part[4096];
            const ssize_t got = recv(fd_, part, sizeof part, 0);
            if (got <= 0) return "";
            in_.append(part, static_cast<std::size_t>(got));
        }
        const std::string text = in_.substr(0, end);
        in_.erase(0, end + 1);
        return text;
    }
    void shut() { shutdown(fd_, SHUT_RDWR); }
    /// Sends nothing more, but still reads.
    void end_requests() { shutdown(fd_, SHUT_WR); }

    bool connected = false;

private:
    int fd_;
    std::string in_;
};

struct ServerTest : testing::Test {
    ServerTest() {
        setenv("XDG_RUNTIME_DIR", folder.path.c_str(), 1);
        machine = std::make_unique<ShellMachine>();
        machine->must(
            "loadrt and2 names=a,b\nloadrt sum2 names=s\nnewthread t 1000000\naddf s t\n");
    }
    ~ServerTest() override { server.reset(); }
    void serve(ServerOptions options = {}) {
        options.log = [this](std::string_view sentence) {
            const std::scoped_lock lock(log_mutex);
            logged += std::string(sentence) + "\n";
        };
        server = std::make_unique<Server>(machine->shell, std::move(options));
        Diagnostics diagnostics;
        ASSERT_TRUE(server->start(diagnostics)) << render(diagnostics, machine->session.sources);
    }
    std::unique_ptr<Client> client() {
        std::string problem;
        auto made = Client::connect("test", problem);
        EXPECT_NE(made, nullptr) << problem;
        return made;
    }
    /// True when an ordinary client is still served.
    bool alive() {
        const auto probe = client();
        return probe && probe->run("getp a.out").out == "FALSE\n";
    }
    std::string log() {
        const std::scoped_lock lock(log_mutex);
        return logged;
    }

    Folder folder;
    std::unique_ptr<ShellMachine> machine;
    std::mutex log_mutex;
    std::string logged;
    std::unique_ptr<Server> server;
};

}  // namespace hal::test
