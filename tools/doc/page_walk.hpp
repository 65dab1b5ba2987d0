// SPDX-License-Identifier: MIT
// What every form of a component's page has, in order. Internal to the pages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "doc/page.hpp"

namespace hal::tools {

/// One form: text, Markdown, troff, HTML.
class PageWriter {
public:
    virtual ~PageWriter() = default;
    virtual void heading(std::string_view title) = 0;
    virtual void code(const std::string& line) = 0;
    virtual void prose(const std::string& sentence) = 0;
    /// Rows of a name and what it is, or of name, type, direction and what it is.
    virtual void table(const std::vector<std::vector<std::string>>& rows) = 0;
    virtual void markdown(const std::string& doc) = 0;
    std::string text;
};

void walk(const Page& page, PageWriter& to);

/// "in", "out", "io", "rw" or "ro".
const char* direction(const Page::Pin& pin);

}  // namespace hal::tools
