// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace hal::tools {

/// A table of fixed columns as text. A cell that is wider than its column moves what follows.
class TextTable {
public:
    struct Column {
        std::string title;
        std::size_t width = 0;
        bool to_the_left = false;   ///< the text is at the left edge: of names, not of numbers
        std::string before = "  ";  ///< between it and the column before it
    };

    explicit TextTable(std::vector<Column> columns);
    /// Adds a line. Cells that are missing are empty.
    void add(const std::vector<std::string>& cells);
    /// Adds a line as it is, as a second line of titles.
    void add_text(const std::string& line);
    /// Returns the lines, without spaces at their ends. [setup]
    const std::string& text() const { return text_; }

private:
    std::vector<Column> columns_;
    std::string text_;
};

}  // namespace hal::tools
