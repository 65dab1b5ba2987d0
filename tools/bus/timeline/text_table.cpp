// SPDX-License-Identifier: MIT
#include "bus/timeline/text_table.hpp"

#include <fmt/core.h>
#include <utility>

namespace hal::tools {

TextTable::TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {
    std::vector<std::string> titles;
    for (const Column& column : columns_) {
        titles.push_back(column.title);
    }
    add(titles);
}

void TextTable::add(const std::vector<std::string>& cells) {
    std::string line;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
        const std::string cell = i < cells.size() ? cells[i] : "";
        if (i > 0) {
            line += columns_[i].before;
        }
        line += columns_[i].to_the_left ? fmt::format("{:<{}}", cell, columns_[i].width)
                                        : fmt::format("{:>{}}", cell, columns_[i].width);
    }
    add_text(line);
}

void TextTable::add_text(const std::string& line) {
    text_ += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
}

}  // namespace hal::tools
