// SPDX-License-Identifier: MIT
// What an emulated card or the way to it does wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>

namespace hal::mesa {

enum class CardFaultKind : std::uint8_t {
    drop_request,   ///< the request is lost
    drop_reply,     ///< the request is executed, its reply is lost
    delay,          ///< the reply is `delay_ns` late
    duplicate,      ///< the reply is sent twice
    swap,           ///< the reply is sent after the next one
    wrong_length,   ///< the reply has a byte less
    wrong_cookie,   ///< the cookie of the firmware is wrong
    stuck_counter,  ///< the counter of received packets stands
    remote_lost,    ///< smart-serial devices do not answer
    bite,           ///< the watchdog bites, once
    reset,          ///< the card loses its power and gets it back, once
    quadrature_error,  ///< encoders see A and B change at the same time, once
    other_master,  ///< another master makes all pins inputs, once
};
inline constexpr const char* card_fault_names[] = {
    "drop-request", "drop-reply",       "delay",         "duplicate",   "swap",
    "wrong-length", "wrong-cookie",     "stuck-counter", "remote-lost", "bite",
    "reset",        "quadrature-error", "other-master"};
inline constexpr std::size_t card_fault_kinds = std::size(card_fault_names);

/// Whether a fault is an event, in place of something that lasts. [any]
constexpr bool happens_once(CardFaultKind kind) noexcept {
    return kind == CardFaultKind::bite || kind == CardFaultKind::reset ||
           kind == CardFaultKind::quadrature_error || kind == CardFaultKind::other_master;
}

struct CardFault {
    CardFaultKind kind = CardFaultKind::drop_request;
    std::uint32_t every = 1;  ///< each n-th request or reply
    std::int64_t from_ns = 0;
    std::int64_t until_ns = INT64_MAX;  ///< since the first request
    std::int64_t delay_ns = 2'000'000;
    std::uint64_t matches = 0;  ///< so far
    bool is_active = true;
    bool is_done = false;  ///< of those that happen once

    /// Whether it lasts at a time since the first request. [realtime]
    bool lasts(std::int64_t since_ns) const noexcept {
        return is_active && since_ns >= from_ns && since_ns < until_ns;
    }
    /// Counts a request or a reply. Returns whether the fault meets it. [realtime]
    bool hits(std::int64_t since_ns) noexcept { return lasts(since_ns) && ++matches % every == 0; }
};
/// Parses `delay:every=50:delay=2ms:from=1s:for=2s`. Returns the problem, or "". [setup]
std::string parse_card_fault(std::string_view text, CardFault& fault);

}  // namespace hal::mesa
