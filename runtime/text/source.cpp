// SPDX-License-Identifier: MIT
#include "text/source.hpp"

#include <algorithm>

namespace hal {

namespace {

/// A byte-order mark before the first line, which nobody sees or counts.
std::size_t mark_bytes(std::string_view text) { return text.starts_with("\xEF\xBB\xBF") ? 3 : 0; }

}  // namespace

std::uint32_t Sources::add(std::string name, std::string text, std::uint32_t first_line) {
    const std::size_t size = text.size();
    Source made{.name = std::move(name), .text = std::move(text), .first_line = first_line};
    std::uint32_t number = 0;
    if (free_.empty()) {
        sources_.push_back(std::move(made));
        number = static_cast<std::uint32_t>(sources_.size());
        // so that freeing a text never allocates
        if (free_.capacity() < sources_.size()) {
            free_.reserve(2 * sources_.size());
        }
    } else {
        number = free_.back();
        free_.pop_back();
        sources_[number - 1] = std::move(made);
    }
    bytes_ += size;
    return number;
}

void Sources::hold(std::uint32_t source) {
    if (source != 0) {
        ++sources_[source - 1].holders;
    }
}

void Sources::release(std::uint32_t source) {
    if (source != 0) {
        --sources_[source - 1].holders;
    }
}

void Sources::drop(std::uint32_t source) {
    if (source != 0 && sources_[source - 1].holders == 0) {
        free(source);
    }
}

bool Sources::worth_sweeping() const {
    constexpr std::size_t min_count = 1000;
    constexpr std::size_t min_bytes = std::size_t{1} << 20;
    return count() > 2 * swept_count_ + min_count || bytes_ > 2 * swept_bytes_ + min_bytes;
}

void Sources::sweep(const std::vector<bool>& in_use) {
    for (std::uint32_t number = 1; number <= sources_.size(); ++number) {
        const bool used = number < in_use.size() && in_use[number];
        if (!used && sources_[number - 1].holders == 0) {
            free(number);
        }
    }
    swept_count_ = count();
    swept_bytes_ = bytes_;
}

void Sources::free(std::uint32_t source) {
    Source& leaving = sources_[source - 1];
    if (leaving.free) return;
    bytes_ -= leaving.text.size();
    leaving = Source{};
    leaving.free = true;
    free_.push_back(source);
}

const Sources::Source& Sources::get(std::uint32_t source) const {
    static const Source nowhere{.name = "<runtime>", .text = "", .line_starts = {0}};
    return source == 0 || source > sources_.size() ? nowhere : sources_[source - 1];
}

std::string_view Sources::text(Span span) const {
    const std::string_view all = get(span.source).text;
    return span.begin <= span.end && span.end <= all.size()
               ? all.substr(span.begin, span.end - span.begin)
               : std::string_view{};
}

std::size_t Sources::line_index(const Source& source, std::uint32_t at) {
    auto& starts = source.line_starts;
    if (starts.empty()) {
        starts.push_back(0);
        for (auto stop = source.text.find('\n'); stop != std::string::npos;
             stop = source.text.find('\n', stop + 1)) {
            starts.push_back(static_cast<std::uint32_t>(stop + 1));
        }
    }
    return static_cast<std::size_t>(std::upper_bound(starts.begin(), starts.end(), at) -
                                    starts.begin()) -
           1;
}

Place Sources::place(Span span) const {
    const Source& source = get(span.source);
    const std::size_t line = line_index(source, span.begin);
    std::string_view row =
        std::string_view(source.text).substr(0, span.begin).substr(source.line_starts[line]);
    if (line == 0) {
        row.remove_prefix(mark_bytes(row));
    }
    const auto characters =
        std::count_if(row.begin(), row.end(), [](char c) { return (c & 0xC0) != 0x80; });
    return {source.first_line + static_cast<std::uint32_t>(line),
            static_cast<std::uint32_t>(characters + 1)};
}

std::string_view Sources::line(Span span) const {
    const Source& source = get(span.source);
    const std::string_view all = source.text;
    if (span.begin > all.size()) {
        return {};
    }
    const std::size_t first = source.line_starts[line_index(source, span.begin)];
    auto row = all.substr(first, all.find('\n', first) - first);
    if (first == 0) {
        row.remove_prefix(mark_bytes(row));
    }
    if (!row.empty() && row.back() == '\r') {
        row.remove_suffix(1);
    }
    return row;
}

std::string Sources::location(Span span, bool column) const {
    if (!span.known()) return get(0).name;
    const Place at = place(span);
    std::string text = get(span.source).name + ":" + std::to_string(at.line);
    return column ? text + ":" + std::to_string(at.column) : text;
}

}  // namespace hal
