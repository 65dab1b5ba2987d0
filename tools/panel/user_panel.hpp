// SPDX-License-Identifier: MIT
// The user panel of a server: its pins are a component of the machine, its values go to the pages.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "panel/control_link.hpp"
#include "panel/panel_layout.hpp"

namespace hal::tools {

class EventLog;

class UserPanel : ControlLink::User {
public:
    UserPanel(lws_vhost* host, const std::string& instance, PanelLayout layout, EventLog& log);

    std::int64_t timeout_ms() const { return layout_.timeout_ms; }
    /// Returns the layout as JSON, for the page.
    const std::string& layout() const { return text_; }
    /// Returns the event with all values.
    std::string values() const;
    /// Receives the event with the values that have changed.
    std::function<void(const std::string&)> on_values;

    /// Sets an output pin. Returns a sentence when the pin or the value is invalid.
    std::string write(std::string_view name, const nlohmann::json& value);
    /// Whether an exchange reports to the machine that the panel is alive.
    enum class Life { sign, unchanged };
    /// Sends what was written to the machine.
    void flush(Life life = Life::sign);
    /// A page with control is connected.
    void page_active();
    /// No page controls the panel: its outputs take their safe values.
    void page_lost();
    /// Exchanges values with the machine. Call it every 50 ms.
    void tick(std::int64_t now_ms);

private:
    void machine_up(std::string_view hello) override;
    void machine_down() override;
    void machine_line(std::string_view line, std::string_view payload) override;
    void inputs(const nlohmann::json& values);
    /// Adopts the machine's values of outputs without a safe value, which a panel that ended may
    /// have left, unless a page has set them since. The other outputs are written.
    void take_over(const nlohmann::json& current);
    bool is_changed(std::size_t pin) const;
    /// After a time without CPU that was longer than the timeout, the machine has set the safe
    /// values: they stay until a page writes. Call it before anything is written.
    void notice_stall(std::int64_t now_ms);

    PanelLayout layout_;
    std::string text_;
    EventLog& log_;
    ControlLink link_;
    std::vector<std::string> shown_;  ///< the newest value of each pin, as JSON
    std::vector<std::size_t> inputs_;  ///< the pins that exchange reads, in order
    std::vector<std::size_t> changed_;  ///< outputs that the machine does not have yet
    bool registered_ = false;
    bool waiting_ = false;
    bool active_ = false;
    bool begun_ = false;  ///< a page had control
    std::int64_t retried_ms_ = 0;
    std::int64_t noticed_ms_ = 0;  ///< when notice_stall() was called last; 0: never
};

}  // namespace hal::tools
