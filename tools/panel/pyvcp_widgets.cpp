// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fmt/core.h>
#include <utility>

#include "panel/pyvcp.hpp"
#include "text/characters.hpp"

namespace hal::tools {

using Json = nlohmann::json;

namespace {

constexpr std::array<std::string_view, 20> widgets{
    "label",  "multilabel", "led",      "rectled",   "button",    "checkbutton", "radiobutton",
    "number", "u32",        "s32",      "timer",     "bar",       "meter",       "spinbox",
    "scale",  "dial",       "jogwheel", "image_bit", "image_u32", "axis_image"};

bool truth(const Json& value) {
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_number()) return value.get<double>() != 0;
    return !value.is_null() && !value.empty();
}

double real(const Json& options, const char* key, double otherwise) {
    const auto at = options.find(key);
    return at != options.end() && at->is_number() ? at->get<double>() : otherwise;
}

}  // namespace

bool is_pyvcp_widget(std::string_view name) {
    return name != "axis_image" && std::find(widgets.begin(), widgets.end(), name) != widgets.end();
}

namespace {

/// Returns the name without blanks, in lower case; empty for other characters than letters, digits
/// and a leading #.
std::string colour_name(std::string_view name) {
    std::string text;
    for (const char c : name) {
        if (c == ' ') continue;
        const char low = lower(c);
        const bool begins = low == '#' && text.empty();
        if (!is_alphanumeric(low) && !begins) return "";
        text += low;
    }
    return text;
}

/// `#rgb`, `#rrggbb`, and `#rrrrggggbbbb`, which has 16 bits per colour.
std::string hexadecimal_colour(const std::string& text) {
    switch (text.size()) {
    case 4:
    case 7: return text;
    case 13: return "#" + text.substr(1, 2) + text.substr(5, 2) + text.substr(9, 2);
    default: return "";
    }
}

}  // namespace

std::string css_colour(std::string_view name) {
    const std::string text = colour_name(name);
    if (text.starts_with('#')) return hexadecimal_colour(text);
    const std::size_t digit = text.find_first_of("0123456789");
    if (digit == text.npos) return text;
    int number = 0;
    std::from_chars(text.data() + digit, text.data() + text.size(), number);
    const std::string colour = text.substr(0, digit);
    if (colour == "gray" || colour == "grey") {
        return number <= 100 ? fmt::format("rgb({0},{0},{0})", std::lround(number * 2.55)) : "";
    }
    constexpr std::array shares{100.0, 93.2, 80.4, 54.5};  // red1 … red4
    if (number < 1 || number > 4) return "";
    return fmt::format("color-mix(in srgb, {} {}%, black)", colour,
                       shares[static_cast<std::size_t>(number - 1)]);
}

std::string PyvcpPins::add(const std::string& name, const char* type, bool output, Json initial) {
    PanelPin pin;
    pin.name = prefix + name;
    pin.type = type;
    pin.output = output;
    pin.initial = std::move(initial);
    if (std::any_of(layout_.pins.begin(), layout_.pins.end(),
                    [&](const PanelPin& other) { return other.name == pin.name; })) {
        problem_ = fmt::format("duplicate pin '{}'", pin.name);
    }
    layout_.pins.push_back(std::move(pin));
    return layout_.pins.back().name;
}

std::string PyvcpPins::base(std::string_view counter, const Json& options, std::string_view end) {
    const auto given = options.find("halpin");
    if (given != options.end() && given->is_string()) return given->get<std::string>();
    auto at = counts_.find(counter);
    if (at == counts_.end()) {
        at = counts_.emplace(std::string(counter), 0).first;
    }
    return fmt::format("{}.{}{}", counter, at->second++, end);
}

void PyvcpPins::parameter(std::string_view kind, unsigned n, const Json& options, Json& node,
                          bool always) {
    const auto name = options.find("halparam");
    const bool named = name != options.end() && name->is_string();
    if (!always && !truth(options.value("param_pin", Json(0)))) return;
    node["param"] = add(named ? name->get<std::string>() : fmt::format("{}.{}.param_pin", kind, n),
                        "float", false, node.value("initial", 0.0));
}

Json PyvcpPins::limited(const Json& options, double low, double high) const {
    const double min = real(options, "min_", low);
    const double max = real(options, "max_", high);

    const double wanted = real(options, "initval", 0);
    if (min > max) {
        return min;  // an inverted scale starts at its first end
    }
    return std::clamp(wanted, min, max);
}

void PyvcpPins::disable(const std::string& name, const Json& options, Json& node) {
    if (truth(options.value("disable_pin", Json(false)))) {
        node["disable"] = add(name + ".disable", "bit", false);
    }
}

std::string PyvcpPins::name_or(std::string automatic, const Json& options) {
    const auto given = options.find("halpin");
    const bool named = given != options.end() && given->is_string();
    return named ? given->get<std::string>() : std::move(automatic);
}

void PyvcpPins::label(std::string_view, const Json& options, Json& node) {
    if (truth(options.value("disable_pin", Json(false)))) {
        disable(base("label", options), options, node);
    }
}

void PyvcpPins::multilabel(std::string_view, const Json& options, Json& node) {
    constexpr std::size_t max_legends = 6;
    const std::string name = base("multilabel", options);
    const Json legends = options.value("legends", Json::array());
    const std::size_t count = legends.is_array() ? std::min(legends.size(), max_legends) : 0;
    const auto first = static_cast<std::size_t>(std::max(0.0, real(options, "initval", 0)));
    Json pins = Json::array();
    for (std::size_t i = 0; i < count; ++i) {
        pins.push_back(add(fmt::format("{}.legend{}", name, i), "bit", false, i == first));
    }
    node["pins"] = pins;
    disable(name, options, node);
}

void PyvcpPins::led(std::string_view, const Json& options, Json& node) {
    const std::string name = base("led", options);
    node["pin"] = add(name, "bit", false);
    disable(name, options, node);
}

void PyvcpPins::button(std::string_view, const Json& options, Json& node) {
    const std::string name = base("button", options);
    node["pin"] = add(name, "bit", true);
    layout_.pins.back().safe = false;  // a button is pressed as long as the page holds it
    disable(name, options, node);
}

void PyvcpPins::checkbutton(std::string_view kind, const Json& options, Json& node) {
    const std::string name = name_or(fmt::format("checkbutton.{}", count(kind)), options);
    node["pin"] = add(name, "bit", true, real(options, "initval", 0) >= 0.5);
    node["change"] = add(name + ".changepin", "bit", false);
}

void PyvcpPins::radiobutton(std::string_view, const Json& options, Json& node) {
    const std::string name = base("radiobutton", options);
    const Json choices = options.value("choices", Json::array());
    const std::size_t count = choices.is_array() ? choices.size() : 0;
    const auto first = static_cast<std::size_t>(std::max(0.0, real(options, "initval", 0)));
    Json pins = Json::array();
    for (std::size_t i = 0; i < count; ++i) {
        const Json& choice = choices[i];
        const std::string text = choice.is_string() ? choice.get<std::string>() : choice.dump();
        pins.push_back(add(name + "." + text, "bit", true, i == first));
    }
    node["pins"] = pins;
}

void PyvcpPins::number(std::string_view kind, const Json& options, Json& node) {
    static constexpr std::pair<std::string_view, const char*> types[] = {{"number", "float"},
                                                                         {"u32", "u32"},
                                                                         {"s32", "s32"},
                                                                         {"image_bit", "bit"},
                                                                         {"image_u32", "u32"}};
    const auto type =
        std::ranges::find(types, kind, &std::pair<std::string_view, const char*>::first);
    node["pin"] = add(base("number", options), type->second, false);
}

void PyvcpPins::timer(std::string_view, const Json& options, Json& node) {
    const std::string name = base("timer", options);
    node["reset"] = add(name + ".reset", "bit", false);
    node["run"] = add(name + ".run", "bit", false);
}

void PyvcpPins::bar(std::string_view, const Json& options, Json& node) {
    node["pin"] = add(base("bar", options), "float", false);
}

void PyvcpPins::meter(std::string_view, const Json& options, Json& node) {
    node["pin"] = add(base("meter", options, ".value"), "float", false);
}

void PyvcpPins::spinbox(std::string_view kind, const Json& options, Json& node) {
    const unsigned n = count(kind);
    node["initial"] = limited(options, 0, 100);
    const std::string name = name_or(fmt::format("spinbox.{}", n), options);
    node["pin"] = add(name, "float", true, node["initial"]);
    parameter(kind, n, options, node, false);
}

void PyvcpPins::scale(std::string_view kind, const Json& options, Json& node) {
    const unsigned n = count(kind);
    const std::string name = name_or(fmt::format("scale.{}", n), options);
    double initial = limited(options, 0, 10).get<double>();
    if (const double step = real(options, "resolution", 1); step > 0) {
        initial = std::round(initial / step) * step;
    }
    node["initial"] = initial;
    const auto integer = static_cast<std::int64_t>(std::clamp(initial, -2e9, 2e9));
    node["integer"] = add(name + "-i", "s32", true, integer);
    node["pin"] = add(name + "-f", "float", true, initial);
    parameter(kind, n, options, node, false);
}

void PyvcpPins::dial(std::string_view kind, const Json& options, Json& node) {
    const unsigned n = count(kind);
    node["initial"] = limited(options, -1e300, 1e300);
    const std::string name = name_or(fmt::format("dial.{}.out", n), options);
    node["pin"] = add(name, "float", true, node["initial"]);
    parameter(kind, n, options, node, true);
}

void PyvcpPins::jogwheel(std::string_view, const Json& options, Json& node) {
    const bool named = options.contains("halpin");
    const std::string name = base("jogwheel", options);
    node["pin"] = add(named ? name : name + ".count", "float", true);
    if (truth(options.value("clear_pin", Json(0)))) {
        node["reset"] = add(name + ".reset", "bit", false);
    }
    if (truth(options.value("scale_pin", Json(0)))) {
        node["scale"] = add(name + ".scale", "float", false, 1.0);
    }
}

std::string PyvcpPins::declare(std::string_view kind, const Json& options, Json& node) {
    struct Row {
        std::string_view kind;
        void (PyvcpPins::*declare)(std::string_view kind, const Json& options, Json& node);
    };
    static constexpr Row rows[] = {
        {"label", &PyvcpPins::label},
        {"multilabel", &PyvcpPins::multilabel},
        {"led", &PyvcpPins::led},
        {"rectled", &PyvcpPins::led},
        {"button", &PyvcpPins::button},
        {"checkbutton", &PyvcpPins::checkbutton},
        {"radiobutton", &PyvcpPins::radiobutton},
        {"number", &PyvcpPins::number},
        {"u32", &PyvcpPins::number},
        {"s32", &PyvcpPins::number},
        {"image_bit", &PyvcpPins::number},
        {"image_u32", &PyvcpPins::number},
        {"timer", &PyvcpPins::timer},
        {"bar", &PyvcpPins::bar},
        {"meter", &PyvcpPins::meter},
        {"spinbox", &PyvcpPins::spinbox},
        {"scale", &PyvcpPins::scale},
        {"dial", &PyvcpPins::dial},
        {"jogwheel", &PyvcpPins::jogwheel},
    };
    problem_.clear();
    const auto row = std::ranges::find(rows, kind, &Row::kind);
    if (row != std::end(rows)) {
        (this->*row->declare)(kind, options, node);
    }
    return problem_;
}

}  // namespace hal::tools
