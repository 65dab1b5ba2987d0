// SPDX-License-Identifier: MIT
#include "panel/server.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <libwebsockets.h>
#include <new>
#include <sys/socket.h>
#include <unistd.h>

#include "panel/clock.hpp"
#include "panel/control_link.hpp"
#include "panel/foxglove.hpp"
#include "panel/http.hpp"
#include "panel/machine_list.hpp"
#include "panel/metrics.hpp"
#include "panel/panel_client.hpp"
#include "panel/user_panel.hpp"

namespace hal::tools {

namespace {

constexpr lws_usec_t tick_us = 50'000;

PanelServer& server_of(lws* wsi) {
    return *static_cast<PanelServer*>(lws_context_user(lws_get_context(wsi)));
}

/// HTTP, and clients that ask for no subprotocol of ours, which are rejected.
int on_http(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
    auto* const answer = static_cast<HttpAnswer**>(user);
    switch (reason) {
    case LWS_CALLBACK_HTTP:
        if (!*answer) {
            *answer = new HttpAnswer;
        }
        return answer_http(server_of(wsi), wsi, {static_cast<const char*>(in), length}, **answer);
    case LWS_CALLBACK_HTTP_WRITEABLE: return answer && *answer ? continue_http(wsi, **answer) : 0;
    case LWS_CALLBACK_CLOSED_HTTP:
    case LWS_CALLBACK_HTTP_DROP_PROTOCOL:
        if (!answer || !*answer) return 0;
        server_of(wsi).metrics().forget(wsi);
        delete *answer;
        *answer = nullptr;
        return 0;
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: return -1;
    case LWS_CALLBACK_HTTP_BODY:
    case LWS_CALLBACK_HTTP_BODY_COMPLETION: return -1;
    default: return 0;
    }
}

/// WebSockets. `make` returns the client of an accepted handshake; `foreign`: pages of other
/// origins in the list may connect, too.
template <class Make>
int on_web_socket(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length,
                  bool foreign, Make make) {
    auto* const client = static_cast<WebClient**>(user);
    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: {
        PanelServer& server = server_of(wsi);
        const std::string host = http_header(wsi, WSI_TOKEN_HOST);

        const std::string origin = http_header(wsi, WSI_TOKEN_ORIGIN);
        const auto& origins = server.access().origins;
        const bool listed =
            foreign && std::find(origins.begin(), origins.end(), origin) != origins.end();
        const bool absent = lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) == 0;  // not a browser
        const bool good =
            host_allowed(server.access(), host) && (absent || own_origin(origin, host) || listed);
        return good && server.make_space() ? 0 : -1;
    }
    case LWS_CALLBACK_ESTABLISHED: {
        auto made = make(server_of(wsi), wsi, lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) > 0);
        *client = made.get();
        server_of(wsi).add(std::move(made));
        return 0;
    }
    case LWS_CALLBACK_RECEIVE:
        if (!*client) return -1;
        return (*client)->received(
                   {static_cast<const char*>(in), length},
                   lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0,
                   lws_frame_is_binary(wsi), now_ms())
                   ? 0
                   : -1;
    case LWS_CALLBACK_SERVER_WRITEABLE: return *client && (*client)->writeable() ? 0 : -1;
    case LWS_CALLBACK_CLOSED:
        // a connection that the filter rejects is closed without a client
        if (*client) {
            server_of(wsi).remove(*client);
        }
        *client = nullptr;
        return 0;
    default: return 0;
    }
}

int on_panel(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
    return on_web_socket(wsi, reason, user, in, length, false,
                         [](PanelServer& server, lws* socket, bool browser) {
        return std::make_unique<PanelClient>(server, socket, browser, server.next_number());
    });
}

int on_foxglove(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t length) {
    return on_web_socket(wsi, reason, user, in, length, true,
                         [](PanelServer& server, lws* socket, bool browser) {
        std::array<char, 80> token{};
        const char* const given =
            lws_get_urlarg_by_name(socket, "t=", token.data(), static_cast<int>(token.size()));
        return std::make_unique<FoxgloveClient>(server, socket, browser, given ? given : "");
    });
}

int on_control(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t length) {
    auto* const link = static_cast<ControlLink*>(lws_get_opaque_user_data(wsi));
    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: return -1;  // for connections to the machine only
    case LWS_CALLBACK_RAW_RX:
        return link && link->received({static_cast<const char*>(in), length}) ? 0 : -1;
    case LWS_CALLBACK_RAW_WRITEABLE: return link && link->writeable() ? 0 : -1;
    case LWS_CALLBACK_RAW_CLOSE:
        if (link) {
            link->closed();
        }
        lws_set_opaque_user_data(wsi, nullptr);
        return 0;
    default: return 0;
    }
}

constexpr std::size_t receive_size = 16384;
const std::array<lws_protocols, 6> protocols{{
    {"http", on_http, sizeof(void*), receive_size, 0, nullptr, 65536},
    {"halcyon.panel.v1", on_panel, sizeof(void*), receive_size, 0, nullptr, 65536},
    {"foxglove.sdk.v1", on_foxglove, sizeof(void*), receive_size, 0, nullptr, 65536},
    {"foxglove.websocket.v1", on_foxglove, sizeof(void*), receive_size, 0, nullptr, 65536},
    {"control", on_control, 0, 65536, 0, nullptr, 65536},
    {nullptr, nullptr, 0, 0, 0, nullptr, 0},
}};
// pings an idle client after 10 s, closes it after 25 s
const lws_retry_bo_t pings{nullptr, 0, 0, 10, 25, 0};

/// Returns why nothing can listen there, "" if it can. The library does not report it.
std::string obstacle(const std::string& address, int port) {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int yes = 1;
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, address.c_str(), &at.sin_addr);
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    const bool good = ::bind(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0 &&
                      ::listen(socket, 1) == 0;
    const int error = errno;
    ::close(socket);
    if (good) return "";
    if (error == EADDRINUSE) return "another program uses it; choose another with --port";
    if (error == EADDRNOTAVAIL) {
        return "this host does not have the address; to list them: ip address";
    }
    if (error == EACCES) {
        return "ports below 1024 need the capability CAP_NET_BIND_SERVICE; choose another with "
               "--port";
    }
    return std::strerror(error);
}

}  // namespace

/// The timer of the event loop.
struct EventLoop {
    lws_sorted_usec_list_t timer{};  // first: the library gives its address back
    PanelServer* server = nullptr;
    lws_context* context = nullptr;

    static void fire(lws_sorted_usec_list_t* timer) {
        auto* const loop = reinterpret_cast<EventLoop*>(timer);
        lws_sul_schedule(loop->context, 0, timer, fire, tick_us);
        loop->server->tick();
    }
};

PanelServer::PanelServer(Access access, std::string instance)
    : access_(std::move(access)),
      instance_(std::move(instance)),
      log_(instance_),
      loop_(std::make_unique<EventLoop>()) {
    log_.on_entry = [this](const EventLog::Entry& entry) {
        tell_pages(entry.event, &entry.instance);
    };
}

PanelServer::~PanelServer() {
    panel_.reset();
    metrics_.reset();
    machines_.reset();
    log_.on_entry = nullptr;
    if (context_) {
        lws_context_destroy(context_);
    }
}

std::string PanelServer::open(const std::string& address, int port) {
    lws_set_log_level(0, nullptr);
    lws_context_creation_info info{};
    info.port = port == 0 ? 0 : port;
    info.iface = address == "0.0.0.0" ? nullptr : address.c_str();
    info.protocols = protocols.data();
    info.user = this;
    info.gid = static_cast<gid_t>(-1);
    info.uid = static_cast<uid_t>(-1);
    info.pt_serv_buf_size = 65536;
    info.max_http_header_data = 8192;
    info.keepalive_timeout = 10;
    info.timeout_secs = 10;
    info.retry_and_idle_policy = &pings;
    info.options = LWS_SERVER_OPTION_DISABLE_IPV6 | LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND;
    if (const std::string why = obstacle(address, port); !why.empty()) {
        return "cannot listen on " + address + " port " + std::to_string(port) + ": " + why;
    }
    context_ = lws_create_context(&info);
    if (!context_) {
        return "cannot listen on " + address + " port " + std::to_string(port) +
               "; choose another with --port";
    }
    host_ = lws_get_vhost_by_name(context_, "default");
    metrics_ = std::make_unique<Metrics>(host_, instance_);
    loop_->server = this;
    loop_->context = context_;
    lws_sul_schedule(context_, 0, &loop_->timer, EventLoop::fire, tick_us);
    return "";
}

int PanelServer::port() const { return lws_get_vhost_listen_port(host_); }

void PanelServer::load(PanelLayout layout) {
    panel_ = std::make_unique<UserPanel>(host_, instance_, std::move(layout), log_);
    panel_->on_values = [this](const std::string& event) { tell_pages(event, &instance_); };
}

void PanelServer::offer_machines() {
    machines_ = std::make_unique<MachineList>(host_, instance_);
    machines_->on_change = [this](const std::string& event) { tell_pages(event); };
}

void PanelServer::tell_pages(const std::string& message, const std::string* instance) {
    for (const auto& client : clients_) {
        auto* const page = dynamic_cast<PanelClient*>(client.get());
        if (!page || !page->admitted()) continue;
        if (instance && page->instance() != *instance) continue;
        page->send(message, false, true);
    }
}

void PanelServer::run() {
    while (!stop_ && lws_service(context_, 0) >= 0) {
    }
}

void PanelServer::interrupt() noexcept {
    stop_ = true;
    lws_cancel_service(context_);
}

void PanelServer::tick() {
    const std::int64_t now = now_ms();
    for (std::size_t i = 0; i < clients_.size(); ++i) {
        clients_[i]->tick(now);
    }
    if (panel_) {
        panel_->tick(now);
    }
    metrics_->tick(now);
    const bool watched = std::any_of(clients_.begin(), clients_.end(), [](const auto& client) {
        return client->admitted() && dynamic_cast<PanelClient*>(client.get());
    });
    if (machines_ && watched) {
        machines_->tick(now);
    }
}

const PanelClient* PanelServer::controller(const std::string& instance) const {
    const auto at = controllers_.find(instance);
    return at == controllers_.end() ? nullptr : at->second;
}

bool PanelServer::controls(const PanelClient& client) const {
    return controller(client.instance()) == &client;
}

void PanelServer::tell_control(const std::string& instance) {
    for (const auto& client : clients_) {
        auto* const page = dynamic_cast<PanelClient*>(client.get());
        if (page && page->admitted() && page->instance() == instance) {
            page->send_control();
        }
    }
}

void PanelServer::take_control(PanelClient& client) {
    if (!access_.write || !client.by_token() || controls(client)) return;
    const std::string& instance = client.instance();
    if (panel_ && instance == instance_ && controller(instance)) {
        panel_->page_lost();
    }
    controllers_[instance] = &client;
    log_.add("client", client.title() + " has control", instance);
    tell_control(instance);
}

void PanelServer::offer_control(PanelClient& client) {
    if (!controller(client.instance())) {
        take_control(client);
    }
}

void PanelServer::release(PanelClient& client) {
    if (!controls(client)) return;
    controllers_.erase(client.instance());
    if (panel_ && client.instance() == instance_) {
        panel_->page_lost();
    }
    log_.add("client", client.title() + " released control", client.instance());
    tell_control(client.instance());
}

bool PanelServer::admit(WebClient& client) {
    if (clients_.size() <= max_clients) return true;
    if (!client.by_token()) return false;
    const auto viewer = std::find_if(clients_.begin(), clients_.end(),
                                     [](const auto& one) { return !one->by_token(); });
    if (viewer == clients_.end()) return false;
    (*viewer)->close(1013, "displaced by a client with the token");
    return true;
}

bool PanelServer::make_space() {
    if (clients_.size() < max_connections) return true;
    const auto silent = [](const auto& one) { return !one->by_token() && !one->admitted(); };
    auto oldest = std::find_if(clients_.begin(), clients_.end(), silent);
    if (oldest == clients_.end()) {
        oldest = std::find_if(clients_.begin(), clients_.end(),
                              [](const auto& one) { return !one->by_token(); });
    }
    if (oldest == clients_.end()) return false;
    (*oldest)->drop();
    // a dropped one is removed when the library has closed it
    return clients_.size() < 2 * max_connections;
}

void PanelServer::remove(WebClient* client) {
    const auto at = std::find_if(clients_.begin(), clients_.end(),
                                 [&](const auto& one) { return one.get() == client; });
    if (at == clients_.end()) return;
    const auto gone = std::move(*at);
    clients_.erase(at);
}

}  // namespace hal::tools
