// SPDX-License-Identifier: MIT
#include "card_server.hpp"

#include <algorithm>

#include "bus/config/values.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::mesa {

namespace {

/// Applies an option of a fault. Returns the problem, or "".
std::string apply_option(std::string_view key, std::string_view value, CardFault& fault) {
    if (key == "every") {
        const auto number = parse_natural(value);
        if (!number || *number == 0 || *number > 1'000'000) return "write every=N, as in every=100";
        fault.every = static_cast<std::uint32_t>(*number);
        return {};
    }
    const auto time = bus::parse_time(value);
    if (!time || *time < 0) return "write a time, as in " + std::string(key) + "=2ms";
    if (key == "from") {
        fault.from_ns = *time;
    } else if (key == "for") {
        fault.until_ns = *time;
    } else if (key == "delay") {
        fault.delay_ns = *time;
    } else {
        return "unknown option " + quoted(key) + "; options are every, from, for, delay";
    }
    return {};
}

}  // namespace

std::string parse_card_fault(std::string_view text, CardFault& fault) {
    const std::string_view name = text.substr(0, text.find(':'));
    const auto found = std::ranges::find(card_fault_names, name);
    if (found == std::end(card_fault_names)) {
        std::string names;
        for (const char* one : card_fault_names) {
            names += (names.empty() ? "" : ", ") + std::string(one);
        }
        return "unknown fault " + quoted(name) + "; faults are " + names;
    }
    fault = {};
    fault.kind = static_cast<CardFaultKind>(found - std::begin(card_fault_names));
    std::string_view rest = text.substr(name.size());
    while (!rest.empty()) {
        rest.remove_prefix(1);
        const std::string_view option = rest.substr(0, rest.find(':'));
        rest.remove_prefix(option.size());
        const std::size_t equals = option.find('=');
        const std::string_view value =
            equals == option.npos ? std::string_view() : option.substr(equals + 1);
        if (const std::string problem = apply_option(option.substr(0, equals), value, fault);
            !problem.empty()) {
            return problem;
        }
    }
    if (fault.until_ns != INT64_MAX) {
        fault.until_ns += fault.from_ns;
    }
    return {};
}

void CardServer::strike(CardFaultKind kind) noexcept {
    switch (kind) {
    case CardFaultKind::bite: card_.bite(); break;
    case CardFaultKind::reset:
        card_.reset();
        held_size_ = 0;
        break;
    case CardFaultKind::quadrature_error: card_.fail_encoders(); break;
    case CardFaultKind::other_master: card_.make_inputs(); break;
    default: break;
    }
}

bool CardServer::lasts(CardFaultKind kind) const noexcept {
    return std::ranges::any_of(faults_, [&](const CardFault& fault) {
        return fault.kind == kind && fault.lasts(newest_ns_ - first_ns_);
    });
}

bool CardServer::hits(CardFaultKind kind) noexcept {
    bool is_hit = false;
    for (CardFault& fault : faults_) {
        if (fault.kind == kind && fault.hits(newest_ns_ - first_ns_)) {
            is_hit = true;
        }
    }
    return is_hit;
}

std::int64_t CardServer::delay() noexcept {
    std::int64_t longest = 0;
    for (CardFault& fault : faults_) {
        if (fault.kind == CardFaultKind::delay && fault.hits(newest_ns_ - first_ns_)) {
            longest = std::max(longest, fault.delay_ns);
        }
    }
    return longest;
}

/// A xorshift generator: the same losses in each run.
bool CardServer::is_lost_at_random() noexcept {
    if (!(loss_ > 0.0)) return false;
    random_ ^= random_ << 13;
    random_ ^= random_ >> 7;
    random_ ^= random_ << 17;
    return static_cast<double>(random_ >> 11) / 9007199254740992.0 < loss_;
}

void CardServer::advance(std::int64_t now_ns) noexcept {
    if (first_ns_ == datagram::unclocked) {
        first_ns_ = now_ns;
    }
    newest_ns_ = std::max(newest_ns_, now_ns);
    card_.advance(newest_ns_);
    card_.set_cookie_wrong(lasts(CardFaultKind::wrong_cookie));
    card_.set_counter_stuck(lasts(CardFaultKind::stuck_counter));
    card_.set_remotes_lost(lasts(CardFaultKind::remote_lost));
    for (CardFault& fault : faults_) {
        if (!happens_once(fault.kind) || fault.is_done) continue;
        if (!fault.lasts(newest_ns_ - first_ns_)) continue;
        fault.is_done = true;
        strike(fault.kind);
    }
}

void CardServer::reply(std::span<const std::uint8_t> bytes, datagram::Replies& replies) noexcept {
    const std::int64_t at = newest_ns_ + delay();
    if (held_size_ == 0 && hits(CardFaultKind::swap)) {
        std::ranges::copy(bytes, held_.begin());
        held_size_ = bytes.size();
        return;
    }
    replies.send(bytes, at);
    if (hits(CardFaultKind::duplicate)) {
        replies.send(bytes, at);
    }
    if (held_size_ != 0) {
        replies.send(std::span(held_).first(held_size_), at);
        held_size_ = 0;
    }
}

void CardServer::serve(std::span<const std::uint8_t> request, std::int64_t now_ns,
                       datagram::Replies& replies) noexcept {
    if (now_ns != datagram::unclocked) {
        advance(now_ns);
    }
    if (hits(CardFaultKind::drop_request) || is_lost_at_random()) {
        ++lost_;
        return;
    }
    std::size_t size = card_.execute(request, reply_);
    if (size == 0) return;
    if (hits(CardFaultKind::drop_reply) || is_lost_at_random()) {
        ++lost_;
        return;
    }
    if (hits(CardFaultKind::wrong_length)) {
        --size;
    }
    if (size != 0) {
        reply(std::span(reply_).first(size), replies);
    }
}

}  // namespace hal::mesa
