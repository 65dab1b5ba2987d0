// SPDX-License-Identifier: MIT
// A component's page: what it declares about itself, in several forms.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "machine/load/declared.hpp"

namespace hal::tools {

using Page = Declared;

/// Returns the page of `threads`, which the runtime provides itself.
Page threads_page();

std::string as_text(const Page& page);
std::string as_markdown(const Page& page);
std::string as_json(const Page& page);
std::string as_man(const Page& page);
/// Returns a whole page; `home` is the address of the index, or empty.
std::string as_html(const Page& page, std::string_view home);
/// Returns the index: each group with its components, and a search box for names and summaries.
struct IndexGroup {
    std::string name;
    std::vector<const Page*> pages;
};
std::string as_html_index(const std::vector<IndexGroup>& groups);

}  // namespace hal::tools
