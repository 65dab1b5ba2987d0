// SPDX-License-Identifier: MIT
// Which requests of the control protocol a page may send.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace hal::tools {

enum class RequestKind { rejected, reads, writes };

/// Checks a request of a page: exactly one verb that the page uses, its size and its rates. When it
/// is rejected sets `problem` to a sentence. Adjusts what must be limited.
RequestKind check_request(nlohmann::json& request, std::string& problem);

}  // namespace hal::tools
