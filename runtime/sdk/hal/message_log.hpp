// SPDX-License-Identifier: MIT
// Messages of one instance on standard error, limited in rate: one line per subject and second, with a count. Never in a cycle: what a
// cycle has to report goes through hal/reporter.hpp, which prints by this.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <time.h>
#include <utility>
#include <vector>

#include "hal/clock.hpp"
#include "hal/messages.h"

namespace hal {

/// The first message about a subject is printed at once. Those that follow within a second are counted, and flush() prints the newest of
/// them with the count when the second is over, or before the first message about another subject, so that lines come in the order of what
/// happened. Any thread that is not in a cycle may call it.
class MessageLog {
public:
    static constexpr std::int64_t interval_ns = 1'000'000'000;
    static constexpr std::size_t  most_subjects = 256;  ///< in one second; the messages about further ones are only counted
    using Sink = std::function<void(const std::string& line)>;

    /// Lines are "INSTANCE: MESSAGE", or the message alone without an instance; `sink` gets them, with their newline, instead of standard error. [setup]
    explicit MessageLog(const std::string& instance, Sink sink = {})
        : prefix_(instance.empty() ? instance : instance + ": "), sink_(std::move(sink)) {}
    /// Lines also go to the journal of the machine until it is called with nullptr. Not while another thread prints. [setup]
    void journal(const hal_messages* to) noexcept { journal_ = to; }
    MessageLog(const MessageLog&) = delete;
    MessageLog& operator=(const MessageLog&) = delete;
    ~MessageLog() { close(); }

    /// `subject` identifies what the message is about: the node and the code of an emergency, for example. [setup]
    void print(const std::string& subject, const std::string& message, std::int64_t now_ns = monotonic_ns()) {
        const std::lock_guard lock(mutex_);
        flush_all(now_ns, false);
        for (Entry& e : entries_)
            if (e.subject == subject) {
                ++e.held, e.newest = message;
                return;
            }
        if (entries_.size() >= most_subjects) {
            if (suppressed_++ == 0) suppressed_since_ns_ = now_ns;
            return;
        }
        for (Entry& e : entries_)
            if (e.held != 0 && e.early < most_early) ++e.early, write_held(e, now_ns);
        write(message);
        entries_.push_back({subject, {}, now_ns, 0, 0});
    }
    /// About the subject that is the message without its numbers. [setup]
    void print(const std::string& message, std::int64_t now_ns = monotonic_ns()) { print(without_numbers(message), message, now_ns); }
    /// Prints what was counted in seconds that are over. To be called several times a second. [setup]
    void flush(std::int64_t now_ns = monotonic_ns()) {
        const std::lock_guard lock(mutex_);
        flush_all(now_ns, false);
    }
    /// Prints everything that was only counted so far. [setup]
    void close() noexcept {
        const std::lock_guard lock(mutex_);
        try {
            flush_all(last_ns_, true);
        } catch (...) {}  // no memory for a line
        entries_.clear();
    }

    /// "frames come after 1.5 s" as "frames come after # s".
    static std::string without_numbers(std::string_view message) {
        std::string text;
        for (std::size_t i = 0; i < message.size();) {
            const auto digit = [&](std::size_t at) { return at < message.size() && message[at] >= '0' && message[at] <= '9'; };
            if (!digit(i)) {
                text += message[i++];
                continue;
            }
            while (digit(i) || (i < message.size() && message[i] == '.' && digit(i + 1))) ++i;
            text += '#';
        }
        return text;
    }

private:
    struct Entry {
        std::string   subject, newest;
        std::int64_t  since_ns = 0;  // of the line printed last
        std::uint64_t held = 0;      // messages since then
        unsigned      early = 0;     // lines in this second before it was over
    };
    static constexpr unsigned most_early = 3;

    void flush_all(std::int64_t now_ns, bool all) {
        last_ns_ = now_ns;
        std::size_t kept = 0;
        for (std::size_t i = 0; i < entries_.size(); ++i) {
            Entry& e = entries_[i];
            if (const bool over = now_ns - e.since_ns >= interval_ns; over || all) {
                if (e.held == 0) continue;  // the next message about it is printed at once
                write_held(e, now_ns);
                e.early = 0;
            }
            if (kept != i) entries_[kept] = std::move(e);
            ++kept;
        }
        entries_.resize(kept);
        if (suppressed_ != 0 && (all || now_ns - suppressed_since_ns_ >= interval_ns)) {
            write(std::to_string(suppressed_) + (suppressed_ == 1 ? " message" : " messages") + " about further subjects not shown");
            suppressed_ = 0;
        }
    }
    void write_held(Entry& e, std::int64_t now_ns) const {
        write(e.held == 1 ? e.newest : e.newest + counted(e.held, now_ns - e.since_ns));
        e.since_ns = now_ns, e.held = 0;
    }
    static std::string counted(std::uint64_t times, std::int64_t in_ns) {
        char text[64];
        std::snprintf(text, sizeof text, " (%llu times in %.1f s)", static_cast<unsigned long long>(times),
                      static_cast<double>(in_ns < 100'000'000 ? 100'000'000 : in_ns) * 1e-9);
        return text;
    }
    void write(const std::string& message) const {
        const std::string line = prefix_ + message + "\n";
        if (sink_) sink_(line);
        else std::fputs(line.c_str(), stderr);
        if (journal_) journal_->add(journal_, line.data(), line.size() - 1);
    }

    const std::string  prefix_;
    const Sink         sink_;
    const hal_messages* journal_ = nullptr;
    std::mutex         mutex_;  // of the rest
    std::vector<Entry> entries_;
    std::uint64_t      suppressed_ = 0;
    std::int64_t       suppressed_since_ns_ = 0, last_ns_ = 0;
};

}  // namespace hal
