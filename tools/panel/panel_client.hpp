// SPDX-License-Identifier: MIT
// A page in a browser: its requests to the control socket, its role.
#pragma once

#include <cstdint>
#include <deque>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "panel/control_link.hpp"
#include "panel/web_client.hpp"

namespace hal::tools {

class PanelServer;
class UserPanel;

class PanelClient : public WebClient, ControlLink::User {
public:
    /// `browser`: the connection has the origin of our own page; another program needs the token.
    PanelClient(PanelServer& server, lws* wsi, bool browser, std::uint64_t number);
    ~PanelClient() override;

    void tick(std::int64_t now_ms) override;
    bool by_token() const override { return by_token_; }
    bool admitted() const override { return welcome_; }
    std::uint64_t number() const { return number_; }
    /// The machine that the page shows: it has chosen one, or that of the command line.
    const std::string& instance() const { return link_.instance(); }
    /// Returns how the log names the page: with the machine when that is another one.
    std::string title() const;
    /// Reports who controls the machine.
    void send_control();

protected:
    void message(std::string_view text, bool binary) override;
    void drained() override { link_.pause(false); }

private:
    void machine_up(std::string_view hello) override;
    void machine_down() override;
    void machine_line(std::string_view line, std::string_view payload) override;

    void greet(const nlohmann::json& hello);
    /// Shows the machine that `hello` names. Returns a sentence when that cannot be.
    std::string choose_machine(const nlohmann::json& hello);
    /// The user panel, when it belongs to the machine that the page shows.
    UserPanel* panel() const;
    void write(nlohmann::json request);
    void panel_request(const nlohmann::json& request);
    void send_recording(const nlohmann::json& request);
    void reject(const nlohmann::json& request, std::string_view problem);
    /// Handles a reply to a request of this class itself. Returns false for one of the page.
    bool own_reply(std::string_view line);
    void finish_write(std::string_view line);

    /// A request to set values that is under way.
    struct Write {
        std::uint64_t id;
        std::vector<std::string> names, values, before;
    };

    PanelServer& server_;
    ControlLink link_;
    bool browser_, welcome_ = false, by_token_ = false;
    std::uint64_t number_;
    std::int64_t opened_ms_, retried_ms_ = 0, beat_ms_ = 0;
    bool down_sent_ = false;
    std::uint64_t recordings_sent_ = 0;
    std::deque<Write> writes_;
};

}  // namespace hal::tools
