// SPDX-License-Identifier: MIT
// What the panel server knows of one machine that a page can choose: its files, its process, whether
// its functions run.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panel/control_link.hpp"

struct lws_vhost;

namespace hal::tools {

class MachineWatch : ControlLink::User {
public:
    MachineWatch(lws_vhost* host, std::string name)
        : name_(std::move(name)), link_(host, name_, *this) {}

    const std::string& name() const { return name_; }
    /// Call it once a second. `present`: a living process has the name. `asks`: the machine is asked
    /// for its state; without it nobody needs that.
    void tick(std::int64_t now_ms, bool present, bool asks);
    /// Returns true once after the machine has answered something new.
    bool has_news() { return std::exchange(news_, false); }
    /// Whether the machine runs, as far as the last tick() knows.
    bool present() const { return present_; }
    /// Returns name, files, pid and state, as docs/internals/panel.md describes them.
    nlohmann::json summary() const;

private:
    enum class State { absent, ended, running, stopped, silent };
    State state() const;

    void machine_up(std::string_view hello) override;
    void machine_down() override;
    void machine_line(std::string_view line, std::string_view payload) override;

    static constexpr std::int64_t silence_ms = 3000;

    const std::string name_;
    ControlLink link_;
    std::vector<std::string> files_;
    std::int64_t pid_ = 0;
    std::int64_t now_ms_ = 0;
    std::int64_t heard_ms_ = 0;  ///< of the last answer, or when the machine was found
    bool present_ = false;
    bool was_present_ = false;   ///< at any time
    bool functions_run_ = true;
    bool news_ = false;
    bool waiting_ = false;       ///< for the answer to `status`
};

}  // namespace hal::tools
