// SPDX-License-Identifier: MIT
#include "base/source.hpp"

#include <algorithm>

namespace hal {

std::uint32_t Sources::add(std::string name, std::string text) {
    sources_.push_back({std::move(name), std::move(text)});
    return static_cast<std::uint32_t>(sources_.size());
}

const Sources::Source& Sources::get(std::uint32_t source) const {
    static const Source nowhere{"<runtime>", ""};
    return source == 0 || source > sources_.size() ? nowhere : sources_[source - 1];
}

std::string_view Sources::text(Span span) const {
    const std::string_view all = get(span.source).text;
    return span.begin <= span.end && span.end <= all.size() ? all.substr(span.begin, span.end - span.begin) : std::string_view{};
}

Place Sources::place(Span span) const {
    const std::string_view before = std::string_view(get(span.source).text).substr(0, span.begin);
    const auto start = before.rfind('\n');
    const std::string_view row = start == std::string_view::npos ? before : before.substr(start + 1);
    const auto characters = std::count_if(row.begin(), row.end(), [](char c) { return (c & 0xC0) != 0x80; });
    return {static_cast<std::uint32_t>(std::count(before.begin(), before.end(), '\n') + 1), static_cast<std::uint32_t>(characters + 1)};
}

std::string_view Sources::line(Span span) const {
    const std::string_view all = get(span.source).text;
    if (span.begin > all.size()) return {};
    const auto start = all.substr(0, span.begin).rfind('\n');
    const auto first = start == std::string_view::npos ? 0 : start + 1;
    auto row = all.substr(first, all.find('\n', first) - first);
    if (!row.empty() && row.back() == '\r') row.remove_suffix(1);
    return row;
}

std::string Sources::location(Span span, bool column) const {
    if (!span.known()) return get(0).name;
    const Place at = place(span);
    std::string text = get(span.source).name + ":" + std::to_string(at.line);
    return column ? text + ":" + std::to_string(at.column) : text;
}

}  // namespace hal
