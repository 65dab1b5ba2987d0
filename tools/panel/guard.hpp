// SPDX-License-Identifier: MIT
// Who may talk to the panel server: host names, origins, the token.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hal::tools {

struct Access {
    /// names in lower case, without port, that a request may be addressed to
    std::vector<std::string> hosts;
    bool any_address = false;          ///< numeric addresses, too: with --listen
    /// origins of other pages that may connect as Foxglove clients, in lower case
    std::vector<std::string> origins;
    std::string token;
    bool open = true;                  ///< values are readable without the token: on loopback
    bool write = false;                ///< clients with the token may set values
};

/// Returns true when the request is addressed to this server. Rejects the names of other hosts,
/// which a page uses for DNS rebinding.
bool host_allowed(const Access& access, std::string_view host);

/// Returns true when the origin is the page that this server itself served to `host`: same scheme,
/// name and port.
bool own_origin(std::string_view origin, std::string_view host);

/// Compares with the token in a time that does not depend on the position of the first difference.
bool is_token(const Access& access, std::string_view typed);

/// Returns 128 random bits as 32 hexadecimal digits.
std::string random_token();

}  // namespace hal::tools
