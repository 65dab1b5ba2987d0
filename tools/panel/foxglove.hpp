// SPDX-License-Identifier: MIT
// Foxglove's WebSocket protocol (foxglove.sdk.v1, foxglove.websocket.v1): a channel per signal and
// unlinked output, parameters, the connection graph.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "panel/control_link.hpp"
#include "panel/web_client.hpp"

namespace hal::tools {

class PanelServer;

class FoxgloveClient : public WebClient, ControlLink::User {
public:
    /// `browser`: the connection has an origin, which was checked. `token`: from the address
    /// (?t=…); empty without one.
    FoxgloveClient(PanelServer& server, lws* wsi, bool browser, const std::string& token);

    void tick(std::int64_t now_ms) override;
    bool by_token() const override { return by_token_; }
    bool admitted() const override { return admitted_; }

protected:
    void message(std::string_view text, bool binary) override;
    void drained() override { link_.pause(false); }

private:
    void machine_up(std::string_view hello) override;
    void machine_down() override;
    void machine_line(std::string_view line, std::string_view payload) override;

    void advertise(const nlohmann::json& objects, bool signals);
    void subscribe(const nlohmann::json& request);
    void follow();
    void values(const nlohmann::json& event);
    void get_parameters(const nlohmann::json& request);
    void set_parameters(const nlohmann::json& request);
    void parameter_values(const nlohmann::json& reply);
    void graph();
    void status(int level, std::string_view text);
    /// Sends a request whose reply is handled as `what`.
    void ask(std::string_view what, nlohmann::json body);

    struct Channel {
        std::string name, type, writer;
        std::vector<std::string> readers;
    };
    PanelServer& server_;
    ControlLink link_;
    bool by_token_ = false;
    bool admitted_ = false;
    bool full_ = false;
    std::int64_t retried_ms_ = 0;
    std::int64_t unix_offset_ns_ = 0;
    std::vector<Channel> channels_;  ///< channel id - 1
    std::map<std::uint32_t, std::size_t> subscriptions_;  ///< Foxglove's number -> channel
    std::vector<std::uint32_t> followed_;  ///< Foxglove's numbers, in the order of the values
    std::int64_t subscription_ = 0;  ///< of the control socket; 0: none
    std::vector<std::string> parameters_;  ///< all names
    /// names and id of get requests under way
    std::vector<std::pair<std::vector<std::string>, std::string>> asked_;
};

}  // namespace hal::tools
