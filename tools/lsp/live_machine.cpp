// SPDX-License-Identifier: MIT
#include "lsp/live_machine.hpp"

#include <chrono>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>

namespace hal::tools {

using Json = nlohmann::json;

namespace {

constexpr std::int64_t retry_ms = 1000;
constexpr int value_timeout_ms = 100;
constexpr int apply_timeout_ms = 10'000;  // components are constructed meanwhile

std::int64_t now_ms() {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

std::string value_text(const Json& value) {
    if (value.is_boolean()) return value.get<bool>() ? "TRUE" : "FALSE";
    if (value.is_number_float()) return fmt::format("{:.7g}", value.get<double>());
    if (value.is_string()) return value.get<std::string>();
    return value.dump();
}

}  // namespace

void LiveMachine::set_name(const std::string& name) {
    if (name == name_) return;
    name_ = name;
    client_.reset();
    last_attempt_ms_ = -retry_ms;
}

bool LiveMachine::connect() {
    if (client_ && client_->look()) return true;
    client_.reset();
    if (now_ms() - last_attempt_ms_ < retry_ms) return false;
    last_attempt_ms_ = now_ms();
    std::string problem;
    client_ = Client::connect(instance_wanted(name_), problem);
    if (!client_) return false;
    Client::Options options;
    options.json = true;
    if (!client_->set_options(options)) {
        client_.reset();
    }
    return client_ != nullptr;
}

std::string LiveMachine::instance() const { return client_ ? client_->instance() : ""; }

Json LiveMachine::ask(Json request, int timeout_ms) {
    if (!connect()) return nullptr;
    const std::uint64_t id = client_->send(std::move(request));
    pollfd waiting{client_->fd(), POLLIN, 0};
    if (::poll(&waiting, 1, timeout_ms) <= 0) {
        client_.reset();  // it does not answer: its reply would belong to a later request
        return nullptr;
    }
    return client_->wait(id);
}

std::map<std::string, std::string> LiveMachine::values(const std::vector<std::string>& names) {
    std::map<std::string, std::string> found;
    if (names.empty()) return found;
    const Json reply = ask({{"read", names}}, value_timeout_ms);
    if (!reply.is_object() || !reply.contains("values")) return found;
    const Json& values = reply["values"];
    for (std::size_t i = 0; i < names.size() && i < values.size(); ++i) {
        if (!values[i].is_null()) {
            found[names[i]] = value_text(values[i]);
        }
    }
    return found;
}

std::vector<LiveMachine::Fault> LiveMachine::faults() {
    std::vector<Fault> found;
    const Json reply = ask({{"run", {"show", "fault"}}}, value_timeout_ms);
    if (!reply.is_object() || !reply.contains("out")) return found;
    const Json rows = Json::parse(reply["out"].get<std::string>(), nullptr, false);
    if (!rows.is_array()) return found;
    for (const Json& row : rows) {
        found.push_back({row.value("thread", ""), row.value("sentence", "")});
    }
    return found;
}

LiveMachine::Applied LiveMachine::apply(const std::vector<Part>& parts, const Ini& ini,
                                        const std::string& directory) {
    if (!connect()) {
        return {false, fmt::format("no machine '{}' is running", instance_wanted(name_))};
    }
    Client::Options options;
    options.directory = directory;
    for (const Ini::Entry& entry : ini.entries()) {
        options.ini.push_back({entry.section, entry.key, entry.value, entry.place});
    }
    client_->set_options(options);
    Applied applied{true, ""};
    const auto run = [&](Json request) {
        const Json reply = ask(std::move(request), apply_timeout_ms);
        if (!reply.is_object()) {
            applied = {false, applied.text + "the machine does not answer"};
            return;
        }
        applied.text += reply.value("err", "") + reply.value("error", "");
        applied.good = applied.good && reply.value("ok", false) && reply.value("status", 1) == 0;
    };
    run({{"run", "begin"}});
    for (const Part& part : parts) {
        if (applied.good) {
            run({{"script", part.text}, {"name", part.name}});
        }
    }
    if (applied.good) {
        run({{"run", "commit"}});
    } else if (client_) {
        ask({{"run", "abort"}}, apply_timeout_ms);
    }
    if (client_) {
        Client::Options plain;
        plain.json = true;
        client_->set_options(plain);
    }
    return applied;
}

}  // namespace hal::tools
