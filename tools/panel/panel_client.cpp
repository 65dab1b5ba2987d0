// SPDX-License-Identifier: MIT
#include "panel/panel_client.hpp"

#include <charconv>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "machine/processes/address.hpp"
#include "panel/clock.hpp"
#include "panel/machine_list.hpp"
#include "panel/requests.hpp"
#include "panel/server.hpp"
#include "panel/user_panel.hpp"
#include "text/typed_command.hpp"

namespace hal::tools {

using Json = nlohmann::json;

namespace {

constexpr std::int64_t retry_ms = 500;
constexpr std::int64_t hello_ms = 10'000;
constexpr std::size_t pause_above = 256 << 10;
constexpr std::size_t max_writes = 100;  // requests under way

std::string text_of(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

PanelClient::PanelClient(PanelServer& server, lws* wsi, bool browser, std::uint64_t number)
    : WebClient(wsi),
      server_(server),
      link_(server.host(), server.instance(), *this),
      browser_(browser),
      number_(number),
      opened_ms_(now_ms()) {}

PanelClient::~PanelClient() { server_.release(*this); }

std::string PanelClient::title() const {
    const std::string name = fmt::format("client {}", number_);
    return instance() == server_.instance() ? name
                                            : fmt::format("{} at '{}'", name, instance());
}

UserPanel* PanelClient::panel() const {
    return instance() == server_.instance() ? server_.panel() : nullptr;
}

void PanelClient::tick(std::int64_t now) {
    if (!welcome_) {
        if (now - opened_ms_ > hello_ms) {
            close(1008, "no hello");
        }
        return;
    }
    if (beat_ms_ != 0 && panel() && now - beat_ms_ > panel()->timeout_ms()) {
        beat_ms_ = 0;
        panel()->page_lost();
    }
    if (link_.up() || now - retried_ms_ < retry_ms) return;
    retried_ms_ = now;
    if (!link_.retry() && !down_sent_) {
        machine_down();
    }
}

void PanelClient::machine_up(std::string_view hello) {
    down_sent_ = false;
    link_.send(R"({"id":"panel:options","options":{"json":true}})");
    link_.send(R"({"id":"panel:journal","journal":true})");
    send(fmt::format(R"({{"event":"machine","up":true,"hello":{}}})", hello));
}

void PanelClient::machine_down() {
    down_sent_ = true;
    writes_.clear();
    send(R"({"event":"machine","up":false})");
}

void PanelClient::machine_line(std::string_view line, std::string_view payload) {
    if (own_reply(line)) return;
    if (!writes_.empty()) {
        finish_write(line);
    }
    send(line);
    if (!payload.empty()) {
        send(payload, true);
    }
    if (waiting() > pause_above) {
        link_.pause(true);
    }
}

bool PanelClient::own_reply(std::string_view line) {
    constexpr std::string_view own = R"({"id":"panel:)";
    if (!line.starts_with(own)) return false;
    const Json reply = Json::parse(line, nullptr, false);
    if (line.substr(own.size()).starts_with("old:") && !writes_.empty() && reply.is_object()) {
        for (const Json& value : reply.value("values", Json::array())) {
            writes_.back().before.push_back(text_of(value));
        }
    }
    return true;
}

void PanelClient::finish_write(std::string_view line) {
    if (!line.starts_with(fmt::format("{{\"id\":{},", writes_.front().id))) return;
    const Write write = std::move(writes_.front());
    writes_.pop_front();
    const Json reply = Json::parse(line, nullptr, false);
    const bool good = reply.is_object() && reply.value("ok", false);
    const std::string unknown = "?";
    for (std::size_t i = 0; i < write.names.size(); ++i) {
        const std::string& before = i < write.before.size() ? write.before[i] : unknown;
        server_.log().add("write",
                          fmt::format("{}: {}: {} -> {}{}", title(), write.names[i], before,
                                      write.values[i], good ? "" : " failed"),
                          instance());
    }
}

void PanelClient::reject(const Json& request, std::string_view problem) {
    send(text_of({{"id", request.contains("id") ? request["id"] : Json()},
                  {"ok", false},
                  {"error", problem}}));
}

void PanelClient::message(std::string_view text, bool binary) {
    Json request = binary ? Json() : Json::parse(text, nullptr, false);
    if (!request.is_object()) return close(1007, "a message is a JSON object");
    if (request.contains("hello")) return greet(request["hello"]);
    if (!welcome_) return close(1008, "the first message must be hello");
    if (request.contains("take")) return server_.take_control(*this);
    if (request.contains("release")) return server_.release(*this);
    if (request.contains("panel")) return panel_request(request);
    if (request.contains("recording")) return send_recording(request);
    std::string problem;
    const RequestKind kind = check_request(request, problem);
    if (kind == RequestKind::rejected) return reject(request, problem);
    if (kind == RequestKind::writes) {
        if (!server_.access().write) {
            return reject(request, "read-only: the panel was started without --write");
        }
        if (!by_token_) {
            return reject(request,
                          "read-only: open the address with the token that hal panel printed");
        }
        if (!server_.controls(*this)) {
            return reject(request, "read-only: another page has control; take control first");
        }
        if (request.contains("set")) return write(std::move(request));
        server_.log().add("write", fmt::format("{}: {}", title(), text_of(request["run"])),
                          instance());
    }
    if (!link_.send(text_of(request))) {
        reject(request,
               link_.up() ? "too many requests are waiting" : "the machine is not running");
    }
}

void PanelClient::greet(const Json& hello) {
    if (welcome_ || !hello.is_object()) return close(1008, "invalid hello");
    const Json token = hello.value("token", Json());
    if (token.is_string()) {
        if (!is_token(server_.access(), token.get_ref<const std::string&>())) {
            return close(1008, "wrong token");
        }
        by_token_ = true;
    }
    if (!by_token_ && (!browser_ || !server_.access().open)) {
        return close(1008, "this connection needs the token that hal panel printed");
    }
    if (const std::string problem = choose_machine(hello); !problem.empty()) {
        return close(1008, problem);
    }
    if (!server_.admit(*this)) return close(1013, "too many pages are connected");
    welcome_ = true;
    Json answer{{"event", "welcome"},
                {"instance", instance()},
                {"own", server_.instance()},
                {"hal", started_as()},
                {"write", server_.access().write},
                {"token", by_token_},
                {"client", number_},
                {"recordings", server_.recordings().list()}};
    if (panel()) {
        answer["panel"] = Json::parse(panel()->layout());
    }
    send(text_of(answer));
    for (const EventLog::Entry& entry : server_.log().entries()) {
        if (entry.instance == instance()) {
            send(entry.event);
        }
    }
    if (by_token_ && server_.access().write) {
        server_.offer_control(*this);
    }
    send_control();
    if (panel()) {
        send(panel()->values());
    }
    if (server_.machines() && !server_.machines()->event().empty()) {
        send(server_.machines()->event());
    }
    server_.log().add("client", title() + " connected" + (by_token_ ? " with the token" : ""),
                      instance());
    tick(now_ms());
}

std::string PanelClient::choose_machine(const Json& hello) {
    const Json wanted = hello.value("machine", Json());
    if (wanted.is_null() || wanted == server_.instance()) return "";
    if (!server_.machines()) {
        return fmt::format("this hal panel shows '{}' only", server_.instance());
    }
    if (!wanted.is_string() || !good_instance_name(wanted.get_ref<const std::string&>())) {
        return "invalid name of a machine";
    }
    link_.choose(wanted.get<std::string>());
    return "";
}

void PanelClient::send_control() {
    const PanelClient* const holder = server_.controller(instance());
    send(text_of({{"event", "control"},
                  {"held", holder == this},
                  {"holder", holder ? Json(holder->number()) : Json()}}));
}

void PanelClient::write(Json request) {
    const Json& values = request["set"];
    if (!values.is_object() || values.size() > 100 || !request.contains("id")) {
        return reject(request, "set needs an id and an object of at most 100 values");
    }
    if (writes_.size() >= max_writes) return reject(request, "too many requests are waiting");
    Write write{request["id"].get<std::uint64_t>(), {}, {}, {}};
    for (const auto& [name, value] : values.items()) {
        write.names.push_back(name);
        write.values.push_back(text_of(value));
    }
    const std::string read =
        text_of({{"id", fmt::format("panel:old:{}", write.id)}, {"read", write.names}});
    if (!link_.send(read) || !link_.send(text_of(request))) {
        return reject(request, "the machine is not running");
    }
    writes_.push_back(std::move(write));
}

void PanelClient::send_recording(const Json& request) {
    constexpr std::size_t busy_above = 1 << 20;
    if (waiting() > busy_above) {
        return reject(request,
                      "the connection is slow: more than 1 MiB sent before has not arrived; "
                      "choose the recording again in a few seconds");
    }
    const Recordings::Answer answer = server_.recordings().answer(request, ++recordings_sent_);
    if (!answer.problem.empty()) return reject(request, answer.problem);
    send(answer.reply);
    send(answer.event);
    send(answer.rows, true);
}

void PanelClient::panel_request(const Json& request) {
    UserPanel* const panel = this->panel();
    if (!panel) return reject(request, "no user panel is loaded");
    if (!server_.controls(*this)) {
        return reject(request, "read-only: this page does not have control");
    }
    const Json& body = request["panel"];
    if (!body.is_object()) return reject(request, "panel must be an object");
    beat_ms_ = now_ms();
    panel->page_active();
    const Json values = body.value("write", Json::object());
    if (!values.is_object()) return reject(request, "write must be an object");
    for (const auto& [name, value] : values.items()) {
        if (const std::string problem = panel->write(name, value); !problem.empty()) {
            return reject(request, problem);
        }
    }
    panel->flush();
}

}  // namespace hal::tools
