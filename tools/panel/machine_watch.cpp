// SPDX-License-Identifier: MIT
#include "panel/machine_watch.hpp"

#include <nlohmann/json.hpp>

namespace hal::tools {

using Json = nlohmann::json;

namespace {

/// Returns whether the functions run, by the reply to `status`; true when that is unknown.
bool runs(const Json& reply) {
    const auto out = reply.find("out");
    if (out == reply.end() || !out->is_string()) return true;
    const Json status = Json::parse(out->get_ref<const std::string&>(), nullptr, false);
    const Json* const running =
        status.is_object() && status.contains("running") ? &status["running"] : nullptr;
    return !running || !running->is_boolean() || running->get<bool>();
}

}  // namespace

void MachineWatch::tick(std::int64_t now, bool present, bool asks) {
    const bool was_asked = now - now_ms_ < silence_ms;
    if (!asks || !was_asked || (present && !present_)) {
        heard_ms_ = now;
    }
    now_ms_ = now;
    present_ = present;
    was_present_ = was_present_ || present;
    if (!present || !asks) return;
    if (!link_.up()) {
        link_.retry();
    } else if (!waiting_) {
        waiting_ = link_.send(R"({"id":"status","run":["status"]})");
    }
}

MachineWatch::State MachineWatch::state() const {
    if (!present_) return was_present_ ? State::ended : State::absent;
    if (now_ms_ - heard_ms_ > silence_ms) return State::silent;
    return functions_run_ ? State::running : State::stopped;
}

Json MachineWatch::summary() const {
    constexpr const char* names[] = {"absent", "ended", "running", "stopped", "silent"};
    return {{"name", name_},
            {"files", files_},
            {"pid", pid_},
            {"state", names[static_cast<std::size_t>(state())]}};
}

void MachineWatch::machine_up(std::string_view text) {
    const Json hello = Json::parse(text, nullptr, false);
    files_.clear();
    pid_ = 0;
    if (hello.is_object()) {
        const Json pid = hello.value("pid", Json());
        pid_ = pid.is_number_integer() ? pid.get<std::int64_t>() : 0;
        for (const Json& file : hello.value("files", Json::array())) {
            if (file.is_string()) {
                files_.push_back(file.get<std::string>());
            }
        }
    }
    heard_ms_ = now_ms_;
    functions_run_ = true;
    news_ = true;
    link_.send(R"({"id":"options","options":{"json":true}})");
    waiting_ = link_.send(R"({"id":"status","run":["status"]})");
}

void MachineWatch::machine_down() { waiting_ = false; }

void MachineWatch::machine_line(std::string_view line, std::string_view) {
    const Json reply = Json::parse(line, nullptr, false);
    if (!reply.is_object()) return;
    heard_ms_ = now_ms_;
    if (reply.value("id", Json()) != "status") return;
    waiting_ = false;
    news_ = news_ || functions_run_ != runs(reply);
    functions_run_ = runs(reply);
}

}  // namespace hal::tools
