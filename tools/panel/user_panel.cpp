// SPDX-License-Identifier: MIT
#include "panel/user_panel.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <utility>

#include "panel/clock.hpp"
#include "panel/event_log.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

using Json = nlohmann::json;

namespace {

constexpr std::int64_t exchange_ms = 50;
constexpr std::int64_t retry_ms = 500;

std::string text_of(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json zero_of(const PanelPin& pin) {
    if (pin.type == "bit") return Json(false);
    if (pin.type == "float") return Json(0.0);
    return Json(0);
}

/// Converts a value to the type of a pin. Returns false when it does not fit.
bool convert(const PanelPin& pin, const Json& value, Json& to) {
    if (pin.type == "bit") {
        if (!value.is_boolean()) return false;
        to = value;
        return true;
    }
    if (!value.is_number() || !std::isfinite(value.get<double>())) return false;
    const double real = value.get<double>();
    if (pin.type == "float") {
        to = real;
    } else if (pin.type == "s32" && std::abs(real) < 2147483648.0) {
        to = static_cast<std::int64_t>(real);
    } else if (pin.type == "u32" && real >= 0 && real < 4294967296.0) {
        to = static_cast<std::uint64_t>(real);
    } else {
        return false;
    }
    return true;
}

/// Returns what a widget shows before its pin has a value.
Json first_value_of(const PanelPin& pin) {
    if (pin.output && !pin.safe.is_null()) return pin.safe;
    return pin.initial.is_null() ? zero_of(pin) : pin.initial;
}

}  // namespace

UserPanel::UserPanel(lws_vhost* host, const std::string& instance, PanelLayout layout,
                     EventLog& log)
    : layout_(std::move(layout)), log_(log), link_(host, instance, *this) {
    Json pins = Json::object();
    for (std::size_t i = 0; i < layout_.pins.size(); ++i) {
        const PanelPin& pin = layout_.pins[i];
        shown_.push_back(text_of(first_value_of(pin)));
        if (!pin.output) {
            inputs_.push_back(i);
        }
        pins[pin.name] = {{"type", pin.type},
                          {"output", pin.output},
                          {"unit", pin.unit},
                          {"doc", pin.doc},
                          {"value", Json::parse(shown_.back())}};
    }
    text_ = text_of({{"component", layout_.component},
                     {"timeout_ms", layout_.timeout_ms},
                     {"pins", pins},
                     {"root", layout_.root}});
}

std::string UserPanel::values() const {
    std::string text = "{\"event\":\"panel\",\"ready\":";
    text += registered_ ? "true,\"values\":{" : "false,\"values\":{";
    for (std::size_t i = 0; i < shown_.size(); ++i) {
        text += fmt::format("{}{}:{}", i == 0 ? "" : ",", text_of(layout_.pins[i].name), shown_[i]);
    }
    return text + "}}";
}

std::string UserPanel::write(std::string_view name, const Json& value) {
    notice_stall(now_ms());
    const auto at = std::find_if(layout_.pins.begin(), layout_.pins.end(),
                                 [&](const PanelPin& pin) { return pin.name == name; });
    Json converted;
    if (at == layout_.pins.end() || !at->output) {
        return fmt::format("'{}' is not an output pin of the panel", name.substr(0, 60));
    }
    if (!convert(*at, value, converted)) {
        return fmt::format("the value of '{}' is not a {}", name, at->type);
    }
    if (converted.is_number() &&
        !(converted.get<double>() >= at->min && converted.get<double>() <= at->max)) {
        return fmt::format("the value of '{}' is outside {:g}..{:g}", name, at->min, at->max);
    }
    const auto i = static_cast<std::size_t>(at - layout_.pins.begin());
    shown_[i] = text_of(converted);
    if (!is_changed(i)) {
        changed_.push_back(i);
    }
    return "";
}

bool UserPanel::is_changed(std::size_t pin) const {
    return std::ranges::find(changed_, pin) != changed_.end();
}

void UserPanel::page_active() {
    active_ = true;
    if (std::exchange(begun_, true)) return;
    bool any = false;
    for (const PanelPin& pin : layout_.pins) {  // until now they had their safe values
        if (!pin.output || pin.safe.is_null() || pin.initial.is_null()) continue;
        write(pin.name, pin.initial);
        any = true;
    }
    if (any && on_values) {
        on_values(values());
    }
}

void UserPanel::page_lost() {
    if (!active_) return;
    active_ = false;
    for (std::size_t i = 0; i < layout_.pins.size(); ++i) {
        const PanelPin& pin = layout_.pins[i];
        if (pin.output && !pin.safe.is_null()) {
            write(pin.name, pin.safe);
        }
    }
    flush(Life::unchanged);
    log_.add("panel", "no page controls the panel; its pins are set to their safe values");
    if (on_values) {
        on_values(values());
    }
}

void UserPanel::notice_stall(std::int64_t now) {
    const bool stalled = noticed_ms_ != 0 && now - noticed_ms_ > layout_.timeout_ms;
    noticed_ms_ = now;
    if (stalled) {
        page_lost();
    }
}

void UserPanel::flush(Life life) {
    if (!registered_ || changed_.empty()) return;
    std::string request =
        fmt::format("{{\"id\":2,\"exchange\":{},\"write\":[", text_of(layout_.component));
    for (std::size_t i = 0; i < changed_.size(); ++i) {
        request += fmt::format("{}{},{}", i == 0 ? "" : ",", changed_[i], shown_[changed_[i]]);
    }
    request += life == Life::sign ? "]}" : "],\"alive\":false}";
    if (link_.send(request)) {
        changed_.clear();
    }
}

void UserPanel::tick(std::int64_t now) {
    notice_stall(now);
    if (!link_.up()) {
        if (now - retried_ms_ < retry_ms) return;
        retried_ms_ = now;
        link_.retry();
        return;
    }
    if (!registered_ || waiting_) return;
    flush();
    waiting_ = link_.send(
        fmt::format("{{\"id\":3,\"exchange\":{},\"read\":true}}", text_of(layout_.component)));
}

void UserPanel::machine_up(std::string_view) {
    registered_ = waiting_ = false;
    Json pins = Json::array();
    for (std::size_t i = 0; i < layout_.pins.size(); ++i) {
        const PanelPin& pin = layout_.pins[i];
        Json one{{"name", pin.name},
                 {"type", pin.type},
                 {"dir", pin.output ? "out" : "in"},
                 {"value", Json::parse(shown_[i])}};
        if (!pin.safe.is_null()) {
            one["safe"] = pin.safe;
        }
        if (!pin.unit.empty()) {
            one["unit"] = pin.unit;
        }
        if (!pin.doc.empty()) {
            one["doc"] = pin.doc;
        }
        pins.push_back(std::move(one));
    }
    link_.send(text_of({{"id", 1},
                        {"component", layout_.component},
                        {"ready", true},
                        {"timeout_ms", layout_.timeout_ms},
                        {"every_ms", 4 * exchange_ms},
                        {"pins", pins}}));
}

void UserPanel::machine_down() {
    registered_ = waiting_ = false;
    if (on_values) {
        on_values(values());
    }
}

void UserPanel::machine_line(std::string_view line, std::string_view) {
    const Json reply = Json::parse(line, nullptr, false);
    if (!reply.is_object() || !reply.contains("id")) return;
    const bool good = reply.value("ok", false);
    if (!good) {
        log_.add("panel", "the machine rejects the panel's component: " + reply.value("error", ""));
    }
    if (reply["id"] == 1 && good) {
        registered_ = true;
        take_over(reply.value("values", Json::array()));
        if (on_values) {
            on_values(values());
        }
    }
    if (reply["id"] == 3) {
        waiting_ = false;
        if (good) {
            inputs(reply.value("values", Json::array()));
        }
    }
}

void UserPanel::take_over(const Json& current) {
    for (std::size_t i = 0; i < layout_.pins.size(); ++i) {
        const PanelPin& pin = layout_.pins[i];
        if (!pin.output || is_changed(i)) continue;
        if (!pin.safe.is_null()) {
            changed_.push_back(i);
            continue;
        }
        Json kept;
        if (i < current.size() && convert(pin, current[i], kept)) {
            shown_[i] = text_of(kept);
        }
    }
}

void UserPanel::inputs(const Json& values) {
    std::string event;
    for (std::size_t k = 0; k < inputs_.size() && k < values.size(); ++k) {
        std::string& shown = shown_[inputs_[k]];
        std::string now = text_of(values[k]);
        if (now == shown) continue;
        shown = std::move(now);
        append_item(event, fmt::format("{}:{}", text_of(layout_.pins[inputs_[k]].name), shown),
                    ",");
    }
    if (!event.empty() && on_values) {
        on_values("{\"event\":\"panel\",\"ready\":true,\"values\":{" + event + "}}");
    }
}

}  // namespace hal::tools
