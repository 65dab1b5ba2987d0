// SPDX-License-Identifier: MIT
#include "panel/foxglove.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "panel/clock.hpp"
#include "panel/event_log.hpp"
#include "panel/server.hpp"

namespace hal::tools {

using Json = nlohmann::json;

namespace {

constexpr std::size_t max_channels = 5000;
constexpr std::size_t max_subscriptions = 1000;

std::string text_of(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string schema_of(const std::string& type) {
    const char* name = type == "float" ? "number" : "integer";
    if (type == "bit") {
        name = "boolean";
    }
    return fmt::format(R"({{"type":"object","properties":{{"value":{{"type":"{}"}}}}}})", name);
}

/// Appends an integer, little-endian.
template <class T>
void put(std::string& to, T value) {
    for (std::size_t i = 0; i < sizeof value; ++i) {
        to += static_cast<char>(value >> (8 * i) & 255);
    }
}

}  // namespace

FoxgloveClient::FoxgloveClient(PanelServer& server, lws* wsi, bool browser,
                               const std::string& token)
    : WebClient(wsi), server_(server), link_(server.host(), server.instance(), *this) {
    by_token_ = !token.empty() && is_token(server.access(), token);
    admitted_ = by_token_ || (token.empty() && browser && server.access().open);
    if (!admitted_) {
        close(1008, token.empty() ? "add the token to the address: ws://HOST:PORT/?t=TOKEN"
                                  : "wrong token");
    }
}

void FoxgloveClient::tick(std::int64_t now) {
    if (!admitted_ || link_.up() || now - retried_ms_ < 500) return;
    if (retried_ms_ == 0 && !server_.admit(*this)) {
        return close(1013, "too many clients are connected");
    }
    retried_ms_ = now;
    link_.retry();
}

void FoxgloveClient::status(int level, std::string_view text) {
    send(text_of({{"op", "status"}, {"level", level}, {"message", text}}));
}

void FoxgloveClient::ask(std::string_view what, Json body) {
    body["id"] = what;
    link_.send(text_of(body));
}

void FoxgloveClient::machine_up(std::string_view hello) {
    const Json greeting = Json::parse(hello, nullptr, false);
    const std::int64_t pid = greeting.is_object() ? greeting.value("pid", std::int64_t{0}) : 0;
    send(text_of({{"op", "serverInfo"},
                  {"name", "Halcyon " + server_.instance()},
                  {"capabilities", {"time", "parameters", "connectionGraph"}},
                  {"supportedEncodings", {"json"}},
                  {"metadata", Json::object()},
                  {"sessionId", fmt::format("{}-{}", pid, now_ms())}}));
    channels_.clear();
    subscriptions_.clear();
    followed_.clear();
    subscription_ = 0;
    ask("signals", {{"describe", "sig"}});
    ask("pins", {{"describe", "pin"}});
    ask("parameters", {{"list", "param"}});
}

void FoxgloveClient::machine_down() {
    Json ids = Json::array();
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        ids.push_back(i + 1);
    }
    send(text_of({{"op", "unadvertise"}, {"channelIds", ids}}));
    status(2, fmt::format("machine '{}' is not running", server_.instance()));
}

void FoxgloveClient::machine_line(std::string_view line, std::string_view) {
    const Json reply = Json::parse(line, nullptr, false);
    if (!reply.is_object()) return;
    if (reply.value("event", "") == "values") return values(reply);
    const auto id = reply.find("id");
    if (id == reply.end() || !id->is_string()) return;
    const std::string& what = id->get_ref<const std::string&>();
    if (what == "read") return parameter_values(reply);
    if (!reply.value("ok", false)) return status(1, reply.value("error", ""));
    if (what == "signals") {
        advertise(reply.value("objects", Json::array()), true);
    } else if (what == "pins") {
        advertise(reply.value("objects", Json::array()), false);
    } else if (what == "parameters") {
        parameters_ = reply.value("names", std::vector<std::string>{});
    } else if (what == "subscribe") {
        subscription_ = reply.value("subscription", std::int64_t{0});
    }
}

void FoxgloveClient::advertise(const Json& objects, bool signals) {
    Json added = Json::array();
    for (const Json& object : objects) {
        if (channels_.size() >= max_channels) break;
        const std::string type = object.value("type", "");
        const std::string direction = object.value("dir", "");
        if (type == "port" || (!signals && (object.contains("signal") || direction == "IN"))) {
            continue;
        }
        channels_.push_back({object.value("name", ""), type, object.value("writer", ""),
                             object.value("pins", std::vector<std::string>{})});
        added.push_back({{"id", channels_.size()},
                         {"topic", "/" + channels_.back().name},
                         {"encoding", "json"},
                         {"schemaName", "halcyon." + type},
                         {"schema", schema_of(type)},
                         {"schemaEncoding", "jsonschema"}});
    }
    send(text_of({{"op", "advertise"}, {"channels", added}}));
}

void FoxgloveClient::message(std::string_view text, bool binary) {
    if (!admitted_ || binary) return;
    const Json request = Json::parse(text, nullptr, false);
    if (!request.is_object() || !request.contains("op") || !request["op"].is_string()) {
        return status(2, "a message is a JSON object with op");
    }
    const std::string& op = request["op"].get_ref<const std::string&>();
    try {
        if (op == "subscribe") {
            subscribe(request);
        } else if (op == "unsubscribe") {
            for (const Json& id : request.at("subscriptionIds")) {
                subscriptions_.erase(id.get<std::uint32_t>());
            }
            follow();
        } else if (op == "getParameters") {
            get_parameters(request);
        } else if (op == "setParameters") {
            set_parameters(request);
        } else if (op == "subscribeConnectionGraph") {
            graph();
        }
    } catch (const Json::exception&) {
        status(2, "invalid members in " + op.substr(0, 60));
    }
}

void FoxgloveClient::subscribe(const Json& request) {
    for (const Json& one : request.at("subscriptions")) {
        const auto channel = one.at("channelId").get<std::size_t>();
        if (channel < 1 || channel > channels_.size()) {
            status(1, fmt::format("unknown channel {}", channel));
        } else if (subscriptions_.size() >= max_subscriptions) {
            status(2, "a client has at most 1000 subscriptions");
        } else {
            subscriptions_[one.at("id").get<std::uint32_t>()] = channel - 1;
        }
    }
    follow();
}

/// One subscription of the control socket has all values, so that those of one thread are of one
/// cycle.
void FoxgloveClient::follow() {
    if (subscription_ != 0) {
        ask("unsubscribe", {{"unsubscribe", subscription_}});
    }
    subscription_ = 0;
    followed_.clear();
    Json names = Json::array();
    for (const auto& [id, channel] : subscriptions_) {
        followed_.push_back(id);
        names.push_back(channels_[channel].name);
    }
    if (!names.empty()) {
        ask("subscribe", {{"subscribe", names}, {"every_ms", 20}});
    }
}

void FoxgloveClient::values(const Json& event) {
    if (event.value("subscription", std::int64_t{-1}) != subscription_) return;
    const auto time = event.value("time_ns", std::int64_t{0});
    if (unix_offset_ns_ == 0) {
        unix_offset_ns_ =
            std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1) -
            time;
    }
    const auto stamp = static_cast<std::uint64_t>(time + unix_offset_ns_);
    std::string frame(1, '\2');  // the time of the data that follow
    put(frame, stamp);
    bool sent = send(frame, true, true);
    const Json all = event.value("values", Json::array());
    for (std::size_t i = 0; i < followed_.size() && i < all.size(); ++i) {
        frame.assign(1, '\1');
        put(frame, followed_[i]);
        put(frame, stamp);
        frame += fmt::format("{{\"value\":{}}}", all[i].is_string() ? "null" : text_of(all[i]));
        sent = send(frame, true, true) && sent;
    }
    if (!sent && !full_) {
        status(1, "Send buffer limit reached");
    }
    full_ = !sent;
}

void FoxgloveClient::get_parameters(const Json& request) {
    auto names = request.at("parameterNames").get<std::vector<std::string>>();
    if (names.empty()) {
        names = parameters_;
    }
    ask("read", {{"read", names}});
    asked_.emplace_back(std::move(names), request.value("id", ""));
}

void FoxgloveClient::set_parameters(const Json& request) {
    std::vector<std::string> names;
    Json values = Json::object();
    for (const Json& one : request.at("parameters")) {
        names.push_back(one.at("name").get<std::string>());
        values[names.back()] = one.at("value");
    }
    if (!server_.access().write || !by_token_) {
        status(1, "read-only: start hal panel with --write and add the token to the address");
    } else if (server_.controller(server_.instance())) {
        status(1, "read-only: a page has control");
    } else {
        ask("set", {{"set", values}});
        server_.log().add("write", "Foxglove: " + text_of(values));
    }
    if (!request.contains("id")) return;
    ask("read", {{"read", names}});
    asked_.emplace_back(std::move(names), request["id"].get<std::string>());
}

void FoxgloveClient::parameter_values(const Json& reply) {
    if (asked_.empty()) return;
    const auto [names, id] = std::move(asked_.front());
    asked_.erase(asked_.begin());
    Json parameters = Json::array();
    const Json values = reply.value("values", Json::array());

    const Json types = reply.value("types", Json::array());
    for (std::size_t i = 0; i < names.size() && i < values.size(); ++i) {
        if (values[i].is_null()) continue;
        parameters.push_back({{"name", names[i]}, {"value", values[i]}});
        if (types[i] == "float") {
            parameters.back()["type"] = "float64";
        }
    }
    Json answer{{"op", "parameterValues"}, {"parameters", parameters}};
    if (!id.empty()) {
        answer["id"] = id;
    }
    send(text_of(answer));
}

void FoxgloveClient::graph() {
    Json published = Json::array();
    Json subscribed = Json::array();
    const auto owner = [](const std::string& pin) { return pin.substr(0, pin.rfind('.')); };
    for (const Channel& channel : channels_) {
        Json readers = Json::array();
        for (const std::string& pin : channel.readers) {
            if (pin != channel.writer) {
                readers.push_back(owner(pin));
            }
        }
        if (!channel.writer.empty()) {
            published.push_back(
                {{"name", "/" + channel.name}, {"publisherIds", {owner(channel.writer)}}});
        }
        if (!readers.empty()) {
            subscribed.push_back({{"name", "/" + channel.name}, {"subscriberIds", readers}});
        }
    }
    send(text_of({{"op", "connectionGraphUpdate"},
                  {"publishedTopics", published},
                  {"subscribedTopics", subscribed},
                  {"advertisedServices", Json::array()},
                  {"removedTopics", Json::array()},
                  {"removedServices", Json::array()}}));
}

}  // namespace hal::tools
