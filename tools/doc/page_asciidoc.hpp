// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "doc/page.hpp"

namespace hal::tools {

/// Returns the page in the form of a manual page, for asciidoctor.
std::string as_asciidoc(const Page& page);

}  // namespace hal::tools
