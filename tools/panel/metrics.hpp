// SPDX-License-Identifier: MIT
// /metrics: the threads of the machine in the text format 0.0.4 of Prometheus.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "panel/control_link.hpp"

namespace hal::tools {

struct HttpAnswer;

class Metrics : ControlLink::User {
public:
    Metrics(lws_vhost* host, std::string instance) : link_(host, std::move(instance), *this) {}

    /// Begins an answer, which is sent when the machine has answered. Returns the value for the
    /// library's callback.
    int ask(lws* wsi, HttpAnswer& answer);
    /// The connection is closed.
    void forget(lws* wsi);
    void tick(std::int64_t now_ms);

private:
    void machine_up(std::string_view) override;
    void machine_down() override;
    void machine_line(std::string_view line, std::string_view payload) override;
    void request(std::uint64_t id);

    struct Waiting {
        lws* wsi;
        HttpAnswer* answer;
        std::int64_t since_ms;
    };
    ControlLink link_;
    std::map<std::uint64_t, Waiting> waiting_;
    std::uint64_t next_ = 1;
};

/// Returns the text for a reply to `describe thread` with histograms. `up`: the machine answers.
std::string metrics_text(const nlohmann::json& reply, bool up);

}  // namespace hal::tools
