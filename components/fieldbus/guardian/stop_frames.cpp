// SPDX-License-Identifier: MIT
#include "fieldbus/guardian/stop_frames.hpp"

#include <algorithm>
#include <charconv>

#include "link/capture.hpp"
#include "link/ethernet.hpp"

namespace hal::guardian {

namespace {

/// Calls `parse(text)` for each part between commas until one returns a problem.
template <class Parse>
std::string for_each_part(std::string_view list, Parse&& parse) {
    std::size_t count = 0;
    while (true) {
        const std::size_t end = std::min(list.find(','), list.size());
        if (++count > max_frames) {
            return "more than " + std::to_string(max_frames) + " frames";
        }
        if (std::string problem = parse(list.substr(0, end)); !problem.empty()) return problem;
        if (end == list.size()) return {};
        list.remove_prefix(end + 1);
    }
}

std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

std::string parse_can_frame(std::string_view text, can::Frame& frame) {
    if (can::parse_log_line("(0) x " + std::string(text), frame) && frame.valid() && !frame.error) {
        frame.time_ns = 0;
        return {};
    }
    return "invalid frame " + quoted(text) +
           "; write IDENTIFIER#DATA in hexadecimal digits, as in 201#0000 (three digits of "
           "identifier, or eight for an extended one)";
}

std::string counted_bytes(std::size_t count) {
    return std::to_string(count) + (count == 1 ? " byte" : " bytes");
}

bool is_separator(char c) noexcept { return c == '.' || c == ':' || c == '-'; }

std::string parse_ethernet_frame(std::string_view text, std::vector<std::uint8_t>& frame) {
    for (std::size_t at = 0; at < text.size();) {
        if (is_separator(text[at])) {
            ++at;
            continue;
        }
        const char* const begin = text.data() + at;
        const char* const end = begin + std::min<std::size_t>(2, text.size() - at);
        std::uint8_t byte = 0;
        const auto [stop, error] = std::from_chars(begin, end, byte, 16);
        if (error != std::errc{} || stop != begin + 2) {
            return "invalid frame " + quoted(text) +
                   "; write Ethernet frames as bytes of two hexadecimal digits, and CAN frames "
                   "in quotes, as in \"201#0000\": outside of them a # begins a comment";
        }
        frame.push_back(byte);
        at += 2;
    }
    if (frame.size() >= ethernet::header_bytes && frame.size() <= ethernet::max_frame) return {};
    return "frame " + quoted(text) + " has " + counted_bytes(frame.size()) +
           "; write Ethernet frames of 14 to 1514 bytes (destination, source, type, payload), and "
           "CAN frames in quotes, as in \"201#0000\": outside of them a # begins a comment";
}

}  // namespace

std::string parse_can_frames(std::string_view list, std::vector<can::Frame>& frames) {
    return for_each_part(
        list, [&](std::string_view part) { return parse_can_frame(part, frames.emplace_back()); });
}

std::string parse(std::string_view frames, std::string_view confirmations, StopFrames& parsed) {
    for_each_part(frames, [&](std::string_view part) {
        parsed.texts.emplace_back(part);
        return std::string();
    });
    if (frames.find('#') == frames.npos) {
        if (!confirmations.empty()) return "confirmations of Ethernet frames are not supported";
        return for_each_part(frames, [&](std::string_view part) {
            return parse_ethernet_frame(part, parsed.ethernet.emplace_back());
        });
    }
    std::string problem = parse_can_frames(frames, parsed.can);
    if (problem.empty() && !confirmations.empty()) {
        problem = parse_can_frames(confirmations, parsed.confirmations);
    }
    return problem;
}

}  // namespace hal::guardian
