// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace hal {

/// Returns a hash of the content of a file: 64 bits of FNV-1a as 16 hexadecimal digits; "" when it
/// cannot be read. It distinguishes versions of a program and protects against nothing. [setup]
std::string file_hash(const std::string& path);
/// Returns the hash of a file with this content. [setup]
std::string text_hash(std::string_view bytes);

}  // namespace hal
