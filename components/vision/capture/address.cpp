// SPDX-License-Identifier: MIT
#include "vision/capture/address.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "hal/rejection.hpp"
#include "text/quoting.hpp"

namespace hal::vision {
namespace {
std::string plain(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.10g", value);
    return text;
}
}  // namespace

Address::Address(std::string_view text) : text_(text) {
    const auto colon = text.find(':');
    if (colon == std::string_view::npos || colon == 0 || colon + 1 == text.size()) {
        throw hal::ArgumentError(
            "source", "source=" + text_ +
                          " names no source; write v4l2:/dev/video0, frames:FOLDER or sim:SCENE");
    }
    driver_ = text.substr(0, colon);
    const auto question = text.find('?', colon);
    place_ = text.substr(colon + 1,
                         question == std::string_view::npos ? question : question - colon - 1);
    for (auto at = question; at != std::string_view::npos;) {
        const auto end = text.find('&', at + 1);
        const std::string_view part =
            text.substr(at + 1, end == std::string_view::npos ? end : end - at - 1);
        const auto equals = part.find('=');
        if (!part.empty()) {
            options_.push_back(
                {std::string(part.substr(0, equals)),
                 std::string(equals == std::string_view::npos ? "" : part.substr(equals + 1)),
                 equals != std::string_view::npos});
        }
        at = end;
    }
}

Address::Option* Address::find(const char* name) {
    known_.emplace_back(name);
    Option* found = nullptr;
    for (Option& option : options_) {
        if (option.name != name) continue;
        if (found) {
            throw hal::ArgumentError(
                "source", "source=" + text_ + " has '" + name + "' twice; delete one of them");
        }
        option.asked = true;
        found = &option;
    }
    return found;
}

bool Address::has(const char* name) const {
    return std::any_of(options_.begin(), options_.end(),
                       [name](const Option& option) { return option.name == name; });
}

double Address::number(const char* name, double fallback, double min, double max) {
    const Option* const option = find(name);
    if (!option) return fallback;
    char* end = nullptr;
    const double value = std::strtod(option->value.c_str(), &end);
    if (option->value.empty() || *end != '\0' || !std::isfinite(value)) {
        throw hal::ArgumentError("source", "source=" + text_ + ": '" + option->value +
                                               "' is not a number; write " + name + "=" +
                                               plain(fallback));
    }
    if (value < min || value > max) {
        throw hal::ArgumentError("source", "source=" + text_ + ": " + name + "=" + option->value +
                                               " is outside " + plain(min) + " to " + plain(max));
    }
    return value;
}

int Address::whole(const char* name, int fallback, int min, int max) {
    const double value = number(name, fallback, min, max);
    if (value != std::floor(value)) {
        throw hal::ArgumentError("source", "source=" + text_ + ": " + name + "=" + plain(value) +
                                               " is not a whole number; write " + name + "=" +
                                               std::to_string(fallback));
    }
    return static_cast<int>(value);
}

bool Address::flag(const char* name) {
    const Option* const option = find(name);
    if (!option) return false;
    if (option->has_value && option->value != "0" && option->value != "1") {
        throw hal::ArgumentError("source", "source=" + text_ + ": '" + name + "=" + option->value +
                                               "' is neither 0 nor 1; write " + name + " alone");
    }
    return option->value != "0";
}

std::string Address::word(const char* name, const char* fallback) {
    const Option* const option = find(name);
    return option ? option->value : fallback;
}

void Address::finish() const {
    for (const Option& option : options_) {
        if (option.asked) continue;
        std::string names;
        for (const std::string& name : known_) {
            append_item(names, name);
        }
        throw hal::ArgumentError("source", "source=" + text_ + ": " + driver_ +
                                               ": has no option '" + option.name + "'; it has " +
                                               (names.empty() ? "none" : names));
    }
}

}  // namespace hal::vision
