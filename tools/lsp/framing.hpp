// SPDX-License-Identifier: MIT
// The base protocol of the Language Server Protocol 3.17: a header with `Content-Length`, an empty
// line, a body of so many bytes.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace hal::tools {

/// Cuts a stream of bytes into messages. [setup]
class MessageReader {
public:
    static constexpr std::size_t max_header = 4096;
    static constexpr std::size_t max_body = std::size_t{256} << 20;

    /// Appends bytes of the stream.
    void feed(std::string_view bytes);
    /// Returns the next complete body; nothing until more bytes have come, or after failed().
    std::optional<std::string> next();
    /// True once a header is invalid or longer than max_header, or a body is longer than max_body:
    /// the beginning of the next message is unknown.
    bool failed() const { return !problem_.empty(); }
    /// Returns one sentence about the invalid header.
    const std::string& problem() const { return problem_; }

private:
    bool read_header();
    void read_line(std::string_view line);
    void drop_consumed();

    std::string pending_;
    std::size_t at_ = 0;  // bytes of pending_ that were consumed
    std::optional<std::size_t> body_size_;
    std::string problem_;
};

/// Returns a body with its header.
std::string framed(std::string_view body);

}  // namespace hal::tools
