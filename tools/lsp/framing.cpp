// SPDX-License-Identifier: MIT
#include "lsp/framing.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "text/characters.hpp"
#include "text/glyphs.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

constexpr std::string_view end_of_line = "\r\n";
constexpr std::string_view end_of_header = "\r\n\r\n";
constexpr std::string_view length_field = "content-length";
constexpr std::size_t drop_threshold = 65536;

bool equal_but_for_case(std::string_view text, std::string_view lower_case) {
    if (text.size() != lower_case.size()) return false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (lower(text[i]) != lower_case[i]) return false;
    }
    return true;
}

}  // namespace

void MessageReader::feed(std::string_view bytes) {
    if (failed()) return;
    drop_consumed();
    pending_.append(bytes);
}

/// Frees what was consumed, not at each message: a client sends many small ones at once.
void MessageReader::drop_consumed() {
    if (at_ < drop_threshold && at_ < pending_.size()) return;
    pending_.erase(0, at_);
    at_ = 0;
}

std::optional<std::string> MessageReader::next() {
    if (failed()) return std::nullopt;
    if (!body_size_ && !read_header()) return std::nullopt;
    if (pending_.size() - at_ < *body_size_) return std::nullopt;
    std::string body = pending_.substr(at_, *body_size_);
    at_ += *body_size_;
    body_size_.reset();
    return body;
}

/// Reads a header that is complete. Returns whether the size of a body is known.
bool MessageReader::read_header() {
    const std::string_view rest = std::string_view(pending_).substr(at_);
    const auto end = rest.substr(0, max_header + end_of_header.size()).find(end_of_header);
    if (end == rest.npos) {
        if (rest.size() > max_header) {
            problem_ = fmt::format("a header is longer than {} bytes", max_header);
        }
        return false;
    }
    const std::string_view header = rest.substr(0, end);
    for (std::size_t at = 0; at <= header.size() && !failed();) {
        const auto stop = std::min(header.find(end_of_line, at), header.size());
        read_line(header.substr(at, stop - at));
        at = stop + end_of_line.size();
    }
    if (!failed() && !body_size_) {
        problem_ = "a header has no Content-Length";
    }
    at_ += end + end_of_header.size();
    return !failed();
}

void MessageReader::read_line(std::string_view line) {
    const auto colon = line.find(':');
    if (colon == line.npos) {
        problem_ = fmt::format("invalid header line '{}'", printable(line.substr(0, 80)));
        return;
    }
    if (!equal_but_for_case(trimmed(line.substr(0, colon)), length_field)) return;
    const auto size = parse_natural(trimmed(line.substr(colon + 1)));
    if (!size || *size > max_body) {
        problem_ = fmt::format("invalid Content-Length '{}' (at most {} bytes)",
                               printable(trimmed(line.substr(colon + 1)).substr(0, 80)), max_body);
        return;
    }
    body_size_ = static_cast<std::size_t>(*size);
}

std::string framed(std::string_view body) {
    return fmt::format("Content-Length: {}\r\n\r\n{}", body.size(), body);
}

}  // namespace hal::tools
