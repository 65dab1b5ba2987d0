// SPDX-License-Identifier: MIT
#include "bus/json_text.hpp"

#include <nlohmann/json.hpp>

namespace hal::tools {

std::string json_text(std::string_view text) {
    return nlohmann::json(std::string(text))
        .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace hal::tools
