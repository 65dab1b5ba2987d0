// SPDX-License-Identifier: MIT
#include "lsp/text_document.hpp"

#include <algorithm>

namespace hal::tools {

namespace {

/// Returns the number of bytes of the character at the beginning of `text`, which is not empty.
std::size_t character_size(std::string_view text) {
    const auto first = static_cast<unsigned char>(text.front());
    std::size_t size = 1;
    if (first >= 0xF0) {
        size = 4;
    } else if (first >= 0xE0) {
        size = 3;
    } else if (first >= 0xC0) {
        size = 2;
    }
    if (size > text.size()) return 1;
    for (std::size_t i = 1; i < size; ++i) {
        if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) return 1;
    }
    return size;
}

constexpr std::uint32_t units_of_size(std::size_t bytes) {
    return bytes == 4 ? 2 : 1;  // a surrogate pair
}

}  // namespace

TextDocument::TextDocument(std::string text) : text_(std::move(text)) { find_lines(); }

void TextDocument::find_lines() {
    line_starts_.assign(1, 0);
    for (std::size_t at = 0; at < text_.size(); ++at) {
        if (text_[at] != '\n' && text_[at] != '\r') continue;
        const bool pair = text_[at] == '\r' && at + 1 < text_.size() && text_[at + 1] == '\n';
        at += pair ? 1 : 0;
        line_starts_.push_back(at + 1);
    }
}

std::size_t TextDocument::line_start(std::uint32_t number) const {
    return number < line_starts_.size() ? line_starts_[number] : text_.size();
}

std::string_view TextDocument::line(std::uint32_t number) const {
    const std::size_t begin = line_start(number);
    std::size_t end = line_start(number + 1);
    while (end > begin && (text_[end - 1] == '\n' || text_[end - 1] == '\r')) {
        --end;
    }
    return std::string_view(text_).substr(begin, end - begin);
}

std::size_t TextDocument::offset(TextPosition at) const {
    std::string_view rest = line(at.line);
    std::size_t offset = line_start(at.line);
    std::uint32_t units = 0;
    while (!rest.empty()) {
        const std::size_t size = character_size(rest);
        units += units_of_size(size);
        if (units > at.character) break;
        offset += size;
        rest.remove_prefix(size);
    }
    return offset;
}

TextPosition TextDocument::position(std::size_t offset) const {
    offset = std::min(offset, text_.size());
    const auto next = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
    const auto line = static_cast<std::uint32_t>(next - line_starts_.begin() - 1);
    std::string_view rest = this->line(line);
    std::size_t at = line_starts_[line];
    std::uint32_t units = 0;
    while (!rest.empty()) {
        const std::size_t size = character_size(rest);
        if (at + size > offset) break;
        at += size;
        units += units_of_size(size);
        rest.remove_prefix(size);
    }
    return {line, units};
}

void TextDocument::replace(TextRange range, std::string_view text) {
    const std::size_t begin = offset(range.begin);
    const std::size_t end = std::max(begin, offset(range.end));
    text_.replace(begin, end - begin, text);
    find_lines();
}

}  // namespace hal::tools
