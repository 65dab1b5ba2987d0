// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fmt/core.h>

#include "panel/pyvcp.hpp"

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

std::string css_colour(std::string_view name) {
    std::string text;
    for (const char c : name) {
        if (c == ' ') continue;
        const char low = c >= 'A' && c <= 'Z' ? static_cast<char>(c + ('a' - 'A')) : c;
        if (!((low >= 'a' && low <= 'z') || (low >= '0' && low <= '9') ||
              (low == '#' && text.empty()))) {
            return "";
        }
        text += low;
    }
    if (text.starts_with('#')) {  // #rrrrggggbbbb has 16 bits per colour
        if (text.size() == 13) {
            return "#" + text.substr(1, 2) + text.substr(5, 2) + text.substr(9, 2);
        }
        return text.size() == 4 || text.size() == 7 ? text : "";
    }
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
    const double least = real(options, "min_", low);
    const double most = real(options, "max_", high);

    const double wanted = real(options, "initval", 0);
    if (least > most) {
        return least;  // an inverted scale starts at its first end
    }
    return std::clamp(wanted, least, most);
}

std::string PyvcpPins::declare(std::string_view kind, const Json& options, Json& node) {
    problem_.clear();
    const auto disable = [&](const std::string& name) {
        if (truth(options.value("disable_pin", Json(false)))) {
            node["disable"] = add(name + ".disable", "bit", false);
        }
    };
    const auto counted = [&](const char* counter) {  // counts named ones, too
        const unsigned n = counts_[counter]++;
        return n;
    };
    const auto name_or = [&](std::string automatic) {
        const auto given = options.find("halpin");
        return given != options.end() && given->is_string() ? given->get<std::string>()
                                                            : std::move(automatic);
    };
    if (kind == "label") {
        if (truth(options.value("disable_pin", Json(false)))) {
            disable(base("label", options));
        }
    } else if (kind == "multilabel") {
        const std::string name = base("multilabel", options);
        const Json legends = options.value("legends", Json::array());
        const auto first = static_cast<std::size_t>(std::max(0.0, real(options, "initval", 0)));
        Json pins = Json::array();
        for (std::size_t i = 0; legends.is_array() && i < legends.size() && i < 6; ++i) {
            pins.push_back(add(fmt::format("{}.legend{}", name, i), "bit", false, i == first));
        }
        node["pins"] = pins;
        disable(name);
    } else if (kind == "led" || kind == "rectled") {
        const std::string name = base("led", options);
        node["pin"] = add(name, "bit", false);
        disable(name);
    } else if (kind == "button") {
        const std::string name = base("button", options);
        node["pin"] = add(name, "bit", true);
        layout_.pins.back().safe = false;  // a button is pressed as long as the page holds it
        disable(name);
    } else if (kind == "checkbutton") {
        const std::string name = name_or(fmt::format("checkbutton.{}", counted("checkbutton")));
        node["pin"] = add(name, "bit", true, real(options, "initval", 0) >= 0.5);
        node["change"] = add(name + ".changepin", "bit", false);
    } else if (kind == "radiobutton") {
        const std::string name = base("radiobutton", options);
        const Json choices = options.value("choices", Json::array());
        const auto first = static_cast<std::size_t>(std::max(0.0, real(options, "initval", 0)));
        Json pins = Json::array();
        for (std::size_t i = 0; choices.is_array() && i < choices.size(); ++i) {
            pins.push_back(add(
                name + "." +
                    (choices[i].is_string() ? choices[i].get<std::string>() : choices[i].dump()),
                "bit", true, i == first));
        }
        node["pins"] = pins;
    } else if (kind == "number" || kind == "u32" || kind == "s32") {
        node["pin"] = add(base("number", options),
                          kind == "number" ? "float"
                          : kind == "u32"  ? "u32"
                                           : "s32",
                          false);
    } else if (kind == "image_bit" || kind == "image_u32") {
        node["pin"] = add(base("number", options), kind == "image_bit" ? "bit" : "u32", false);
    } else if (kind == "timer") {
        const std::string name = base("timer", options);
        node["reset"] = add(name + ".reset", "bit", false);
        node["run"] = add(name + ".run", "bit", false);
    } else if (kind == "bar") {
        node["pin"] = add(base("bar", options), "float", false);
    } else if (kind == "meter") {
        node["pin"] = add(base("meter", options, ".value"), "float", false);
    } else if (kind == "spinbox") {
        const unsigned n = counted("spinbox");
        node["initial"] = limited(options, 0, 100);
        node["pin"] = add(name_or(fmt::format("spinbox.{}", n)), "float", true, node["initial"]);
        parameter(kind, n, options, node, false);
    } else if (kind == "scale") {
        const unsigned n = counted("scale");
        const std::string name = name_or(fmt::format("scale.{}", n));
        double initial = limited(options, 0, 10).get<double>();
        if (const double step = real(options, "resolution", 1); step > 0) {
            initial = std::round(initial / step) * step;
        }
        node["initial"] = initial;
        node["integer"] = add(name + "-i", "s32", true,
                              static_cast<std::int64_t>(std::clamp(initial, -2e9, 2e9)));
        node["pin"] = add(name + "-f", "float", true, initial);
        parameter(kind, n, options, node, false);
    } else if (kind == "dial") {
        const unsigned n = counted("dial");
        node["initial"] = limited(options, -1e300, 1e300);
        node["pin"] = add(name_or(fmt::format("dial.{}.out", n)), "float", true, node["initial"]);
        parameter(kind, n, options, node, true);
    } else if (kind == "jogwheel") {
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
    return problem_;
}

}  // namespace hal::tools
