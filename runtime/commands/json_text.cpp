// SPDX-License-Identifier: MIT
#include "commands/json_text.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace hal {

void json_quote(std::string& to, std::string_view text) {
    to += nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void json_value(std::string& to, hal_type type, const hal_value& value) {
    if (type == HAL_TYPE_BIT) {
        to += value.bit ? "true" : "false";
    } else if (type == HAL_TYPE_FLOAT && !std::isfinite(value.real)) {
        to += std::isnan(value.real) ? "\"nan\"" : value.real > 0 ? "\"inf\"" : "\"-inf\"";
    } else {
        to += format_exact(type, value);
    }
}

}  // namespace hal
