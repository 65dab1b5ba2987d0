// SPDX-License-Identifier: MIT
#include "commands/json_text.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace hal {

std::string json_text(const nlohmann::ordered_json& document) {
    return document.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

nlohmann::ordered_json to_json(hal_type type, const hal_value& value) {
    switch (type) {
    case HAL_TYPE_BIT: return value.bit;
    case HAL_TYPE_FLOAT:
        if (std::isfinite(value.real)) return value.real;
        if (std::isnan(value.real)) return "nan";
        if (value.real > 0) return "inf";
        return "-inf";
    case HAL_TYPE_S32: return value.s32;
    case HAL_TYPE_U32: return value.u32;
    case HAL_TYPE_S64: return value.s64;
    case HAL_TYPE_U64: return value.u64;
    case HAL_TYPE_PORT: return value.port == nullptr ? 0 : value.port->capacity;
    }
    return nullptr;
}

void json_quote(std::string& to, std::string_view text) {
    to += nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void json_value(std::string& to, hal_type type, const hal_value& value) {
    if (type == HAL_TYPE_BIT) {
        to += value.bit ? "true" : "false";
    } else if (type == HAL_TYPE_FLOAT && !std::isfinite(value.real)) {
        if (std::isnan(value.real)) {
            to += "\"nan\"";
        } else if (value.real > 0) {
            to += "\"inf\"";
        } else {
            to += "\"-inf\"";
        }
    } else {
        to += format_exact(type, value);
    }
}

}  // namespace hal
