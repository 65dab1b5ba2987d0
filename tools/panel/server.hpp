// SPDX-License-Identifier: MIT
// The web server of `hal panel`: one event loop, one thread. HTTP for the page and metrics,
// WebSockets for pages and Foxglove.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panel/event_log.hpp"
#include "panel/guard.hpp"
#include "panel/recordings.hpp"
#include "panel/web_client.hpp"

struct lws;
struct lws_context;
struct lws_vhost;

namespace hal::tools {

class MachineList;
class Metrics;
class PanelClient;
class UserPanel;
struct PanelLayout;
struct EventLoop;

class PanelServer {
public:
    PanelServer(Access access, std::string instance);
    ~PanelServer();
    PanelServer(const PanelServer&) = delete;

    /// Opens the port, 0 for any. Returns a sentence when that fails.
    std::string open(const std::string& address, int port);
    int port() const;
    void load(PanelLayout layout);
    /// Sets what pages can show besides the machine; before run().
    void load(Recordings recordings) { recordings_ = std::move(recordings); }
    /// Serves until interrupt() is called.
    void run();
    void interrupt() noexcept;  ///< [any]

    const Access& access() const { return access_; }
    const std::string& instance() const { return instance_; }
    lws_vhost* host() const { return host_; }
    EventLog& log() { return log_; }
    UserPanel* panel() { return panel_.get(); }
    Metrics& metrics() { return *metrics_; }
    /// The machines that a page can choose from; nullptr: all pages show that of the command line.
    const MachineList* machines() const { return machines_.get(); }
    /// Lets pages choose among the machines of this user; after open().
    void offer_machines();
    const Recordings& recordings() const { return recordings_; }

    /// At most one page at a time has control of a machine.
    const PanelClient* controller(const std::string& instance) const;
    bool controls(const PanelClient& client) const;
    void take_control(PanelClient& client);
    void offer_control(PanelClient& client);
    void release(PanelClient& client);
    /// Returns false when too many clients are connected. One with the token displaces the oldest
    /// one without it.
    bool admit(WebClient& client);
    /// Makes space for one more connection: drops the oldest one that is not admitted yet, else the
    /// oldest without the token.
    bool make_space();

    // Called by the event loop.
    void add(std::unique_ptr<WebClient> client) { clients_.push_back(std::move(client)); }
    void remove(WebClient* client);
    std::uint64_t next_number() { return ++numbers_; }
    void tick();

    static constexpr std::size_t max_clients = 32;
    static constexpr std::size_t max_connections = 48;

private:
    void tell_control(const std::string& instance);
    /// Sends a live message to all pages; with `instance` to those that show it.
    void tell_pages(const std::string& message, const std::string* instance = nullptr);

    Access access_;
    std::string instance_;
    lws_context* context_ = nullptr;
    lws_vhost* host_ = nullptr;
    EventLog log_;
    Recordings recordings_;
    std::unique_ptr<EventLoop> loop_;
    std::unique_ptr<Metrics> metrics_;
    std::unique_ptr<MachineList> machines_;
    std::unique_ptr<UserPanel> panel_;
    std::vector<std::unique_ptr<WebClient>> clients_;
    std::map<std::string, PanelClient*> controllers_;  ///< by instance
    std::uint64_t numbers_ = 0;
    bool stop_ = false;
};

}  // namespace hal::tools
