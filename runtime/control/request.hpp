// SPDX-License-Identifier: MIT
// What the verbs of the control protocol share: reading a request and rejecting it. Internal to the
// shell.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace hal {

/// Why a request cannot be executed; becomes {"ok":false,"error":…}.
struct RequestError {
    std::string sentence;
};

/// The member of that name, or null.
inline const nlohmann::json& member(const nlohmann::json& body, const char* key) {
    static const nlohmann::json none;
    const auto at = body.find(key);
    return at == body.end() ? none : *at;
}

inline const std::string& text_of(const nlohmann::json& value, const char* what) {
    if (!value.is_string()) {
        throw RequestError{std::string(what) + " must be a string"};
    }
    return value.get_ref<const std::string&>();
}

inline std::vector<std::string> names_in(const nlohmann::json& value, const char* what) {
    constexpr std::size_t max = 100'000;
    if (!value.is_array()) {
        throw RequestError{std::string(what) + " must be an array of names"};
    }
    if (value.size() > max) {
        throw RequestError{std::string(what) + " has more than " + std::to_string(max) + " names"};
    }
    std::vector<std::string> names;
    for (const nlohmann::json& name : value) {
        names.push_back(text_of(name, "a name"));
    }
    return names;
}

inline std::int64_t whole(const nlohmann::json& value, const char* what, std::int64_t min,
                          std::int64_t max) {
    if (!value.is_number_integer() || value < min || value > max) {
        throw RequestError{std::string(what) + " must be a whole number from " +
                           std::to_string(min) + " to " + std::to_string(max)};
    }
    return value.get<std::int64_t>();
}

/// A value as setp and sets read it; empty when it is not a value.
inline std::string value_word(const nlohmann::json& value) {
    if (value.is_boolean()) return value.get<bool>() ? "TRUE" : "FALSE";
    if (value.is_string()) return value.get<std::string>();
    return value.is_number() ? value.dump() : "";
}

}  // namespace hal
