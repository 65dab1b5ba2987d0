// SPDX-License-Identifier: MIT
// Messages of one instance on standard error, limited in rate: one line per subject and second,
// with a count. Never in a cycle: what a cycle has to report goes through hal/reporter.hpp, which
// prints by this.
#pragma once

#include <algorithm>
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

/// What a message is about. Messages of one kind differ in their detail only: an emergency of node
/// 5 is a kind, its error code the detail.
struct MessageSubject {
    std::string kind, detail = {};
};

/// How the lines of a log begin: "INSTANCE: ", or, in a program of its own, the time since its
/// start,
/// "    1.234 s  ".
class LinePrefix {
public:
    LinePrefix(std::string_view instance)
        : instance_(instance.empty() ? std::string() : std::string(instance) + ": ") {}
    LinePrefix(const std::string& instance) : LinePrefix(std::string_view(instance)) {}
    LinePrefix(const char* instance) : LinePrefix(std::string_view(instance)) {}
    static LinePrefix time_since(std::int64_t begin_ns) {
        LinePrefix prefix("");
        prefix.begin_ns_ = begin_ns;
        return prefix;
    }
    /// The beginning of the line about what happened at this time.
    std::string at(std::int64_t now_ns) const {
        if (begin_ns_ == no_time) return instance_;
        char text[32];
        std::snprintf(text, sizeof text, "%9.3f s  ",
                      static_cast<double>(now_ns - begin_ns_) * 1e-9);
        return text;
    }

private:
    static constexpr std::int64_t no_time = INT64_MIN;
    std::string instance_;
    std::int64_t begin_ns_ = no_time;
};

/// The first message about a subject is printed at once. Those that follow within a second are
/// counted, and flush() prints the newest of them with the count when the second is over, or before
/// the first message about another subject, so that lines come in the order of what happened. Of a
/// kind whose details differ every time, a few lines are printed, then one per second with the
/// number of those that are not shown, until there is a quiet second. Any thread that is not in a
/// cycle may call it.
class MessageLog {
public:
    static constexpr std::int64_t interval_ns = 1'000'000'000;
    /// of one kind that are printed individually in a second
    static constexpr std::size_t max_details = 8;
    /// of all kinds in a second; the messages about further ones are only counted
    static constexpr std::size_t max_subjects = 256;
    /// the same in the seconds after one with more
    static constexpr std::size_t max_subjects_of_a_storm = 16;
    using Sink = std::function<void(const std::string& line)>;

    /// Lines are the prefix and the message; `sink` gets them, with their newline, instead of
    /// standard error. [setup]
    explicit MessageLog(LinePrefix prefix, Sink sink = {})
        : prefix_(std::move(prefix)), sink_(std::move(sink)) {}
    /// Lines also go to the journal of the machine until it is called with nullptr. Not while
    /// another thread prints. [setup]
    void journal(const hal_messages* to) noexcept { journal_ = to; }
    MessageLog(const MessageLog&) = delete;
    MessageLog& operator=(const MessageLog&) = delete;
    ~MessageLog() { close(); }

    /// Prints or counts a message. [setup]
    void print(const MessageSubject& subject, const std::string& message,
               std::int64_t now_ns = monotonic_ns()) {
        const std::lock_guard lock(mutex_);
        flush_all(now_ns, false);
        const std::string line = prefix_.at(now_ns) + message;
        Kind* kind = find(subject.kind);
        if (kind != nullptr) {
            if (Entry* const known = find(*kind, subject.detail)) return known->hold(line);
            if (kind->storming || kind->entries.size() >= max_details) {
                return kind->hold_other(line, now_ns);
            }
        }
        if (subjects() >= (overflowed_ ? max_subjects_of_a_storm : max_subjects)) {
            if (suppressed_++ == 0) {
                suppressed_since_ns_ = now_ns;
            }
            overflowed_ = true;
            return;
        }
        print_held_early(now_ns);
        write(line);
        if (kind == nullptr) {
            kind = &kinds_.emplace_back(Kind{subject.kind, {}, {}, false});
        }
        kind->entries.push_back({subject.detail, {}, now_ns, 0, 0});
    }
    /// About a subject that is the only one of its kind. [setup]
    void print(const std::string& subject, const std::string& message,
               std::int64_t now_ns = monotonic_ns()) {
        print(MessageSubject{subject, ""}, message, now_ns);
    }
    /// About the subject that is the message without its numbers. [setup]
    void print(const std::string& message, std::int64_t now_ns = monotonic_ns()) {
        print(without_numbers(message), message, now_ns);
    }
    /// Prints what was counted in seconds that are over. To be called several times a second.
    /// [setup]
    void flush(std::int64_t now_ns = monotonic_ns()) {
        const std::lock_guard lock(mutex_);
        flush_all(now_ns, false);
    }
    /// Prints everything that was only counted so far. [setup]
    void close() noexcept {
        const std::lock_guard lock(mutex_);
        try {
            flush_all(last_ns_, true);
        } catch (...) {
        }  // no memory for a line
        kinds_.clear();
    }

    /// "0x1F of 02:00:5e comes after 1.5 s" as "# of #:#:# comes after # s".
    static std::string without_numbers(std::string_view message) {
        std::string text;
        for (std::size_t i = 0; i < message.size();) {
            const std::size_t end = end_of_number(message, i);
            if (end == i) {
                text += message[i++];
                continue;
            }
            text += '#';
            i = end;
        }
        return text;
    }

private:
    /// What was printed of a subject, and what was only counted since.
    struct Entry {
        std::string detail, newest;  // newest: with its prefix
        std::int64_t since_ns = 0;  // of the line printed last
        std::uint64_t held = 0;  // messages since then
        unsigned early = 0;  // lines in this second before it was over

        void hold(const std::string& line) {
            ++held;
            newest = line;
        }
        bool over(std::int64_t now_ns) const { return now_ns - since_ns >= interval_ns; }
    };
    struct Kind {
        std::string name;
        std::vector<Entry> entries;
        Entry others;  // further details, which have no entry of their own
        bool storming = false;  // there were such in this second or the one before

        void hold_other(const std::string& line, std::int64_t now_ns) {
            if (!storming) {
                others.since_ns = now_ns;
            }
            storming = true;
            others.hold(line);
        }
    };
    static constexpr unsigned max_early = 3;

    static bool is_digit(char c) { return c >= '0' && c <= '9'; }
    static bool is_hex_digit(char c) {
        return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
    }
    static bool is_word(char c) {
        return is_hex_digit(c) || (c >= 'g' && c <= 'z') || (c >= 'G' && c <= 'Z');
    }
    /// Returns whether a word is a hexadecimal number: 0x1F, or digits with at least one of 0 to 9.
    static bool is_hexadecimal(std::string_view word) {
        if (word.starts_with("0x") || word.starts_with("0X")) {
            word.remove_prefix(2);
        }
        return std::all_of(word.begin(), word.end(), is_hex_digit) &&
               std::any_of(word.begin(), word.end(), is_digit);
    }
    /// Returns the end of the number that begins at `at`, or `at`.
    static std::size_t end_of_number(std::string_view text, std::size_t at) {
        const auto holds = [&](std::size_t i, auto is) { return i < text.size() && is(text[i]); };
        std::size_t end = at;
        while (holds(end, is_digit) || (end > at && holds(end, [](char c) { return c == '.'; }) &&
                                        holds(end + 1, is_digit))) {
            ++end;
        }
        if (at != 0 && is_word(text[at - 1])) return end;
        std::size_t word = at;
        while (holds(word, is_word)) {
            ++word;
        }
        return word > end && is_hexadecimal(text.substr(at, word - at)) ? word : end;
    }

    Kind* find(const std::string& kind) {
        const auto at = std::find_if(kinds_.begin(), kinds_.end(),
                                     [&](const Kind& k) { return k.name == kind; });
        return at == kinds_.end() ? nullptr : &*at;
    }
    static Entry* find(Kind& kind, const std::string& detail) {
        const auto at = std::find_if(kind.entries.begin(), kind.entries.end(),
                                     [&](const Entry& e) { return e.detail == detail; });
        return at == kind.entries.end() ? nullptr : &*at;
    }
    std::size_t subjects() const {
        std::size_t sum = 0;
        for (const Kind& k : kinds_) {
            sum += k.entries.size();
        }
        return sum;
    }
    /// Prints what was counted before another subject's first message.
    void print_held_early(std::int64_t now_ns) {
        for (Kind& k : kinds_) {
            for (Entry& e : k.entries) {
                if (e.held != 0 && e.early < max_early) {
                    ++e.early;
                    write_held(e, now_ns);
                }
            }
        }
    }

    void flush_all(std::int64_t now_ns, bool all) {
        last_ns_ = now_ns;
        for (Kind& k : kinds_) {
            flush_kind(k, now_ns, all);
        }
        std::erase_if(kinds_, [](const Kind& k) { return k.entries.empty() && !k.storming; });
        if (overflowed_ && suppressed_ == 0 && now_ns - suppressed_since_ns_ >= interval_ns) {
            overflowed_ = false;
        }
        if (suppressed_ == 0 || !(all || now_ns - suppressed_since_ns_ >= interval_ns)) return;
        write(prefix_.at(now_ns) + std::to_string(suppressed_) +
              (suppressed_ == 1 ? " message" : " messages") + " about further subjects not shown");
        suppressed_ = 0;
        suppressed_since_ns_ = now_ns;
    }
    void flush_kind(Kind& k, std::int64_t now_ns, bool all) {
        if (k.storming && (all || k.others.over(now_ns))) {
            k.storming = k.others.held != 0;
            if (k.storming) {
                write_others(k, now_ns);
            }
        }
        std::erase_if(k.entries, [&](Entry& e) {
            if (!e.over(now_ns) && !all) return false;
            if (e.held == 0) {
                return true;  // the next message about it is printed at once
            }
            write_held(e, now_ns);
            e.early = 0;
            return false;
        });
    }
    void write_held(Entry& e, std::int64_t now_ns) const {
        write(e.held == 1 ? e.newest : e.newest + counted(e.held, now_ns - e.since_ns));
        e.since_ns = now_ns;
        e.held = 0;
    }
    /// Prints the newest of a storm with the number of all of it.
    void write_others(Kind& k, std::int64_t now_ns) const {
        Entry& others = k.others;
        for (Entry& e : k.entries) {
            others.held += std::exchange(e.held, 0);
        }
        const std::uint64_t hidden = others.held - 1;
        char text[96] = "";
        if (hidden != 0) {
            std::snprintf(text, sizeof text, " (%llu similar message%s in %.1f s not shown)",
                          static_cast<unsigned long long>(hidden), hidden == 1 ? "" : "s",
                          seconds(now_ns - others.since_ns));
        }
        write(others.newest + text);
        for (Entry& e : k.entries) {
            e.since_ns = now_ns;
        }
        others.since_ns = now_ns;
        others.held = 0;
    }
    static double seconds(std::int64_t in_ns) {
        return static_cast<double>(std::max<std::int64_t>(in_ns, 100'000'000)) * 1e-9;
    }
    static std::string counted(std::uint64_t times, std::int64_t in_ns) {
        char text[64];
        std::snprintf(text, sizeof text, " (%llu times in %.1f s)",
                      static_cast<unsigned long long>(times), seconds(in_ns));
        return text;
    }
    void write(std::string line) const {
        line += '\n';
        if (sink_) {
            sink_(line);
        } else {
            std::fputs(line.c_str(), stderr);
        }
        if (journal_) {
            journal_->add(journal_, line.data(), line.size() - 1);
        }
    }

    const LinePrefix prefix_;
    const Sink sink_;
    const hal_messages* journal_ = nullptr;
    std::mutex mutex_;  // of the rest
    std::vector<Kind> kinds_;
    std::uint64_t suppressed_ = 0;
    std::int64_t suppressed_since_ns_ = 0;
    std::int64_t last_ns_ = 0;
    // there were more than max_subjects, in this second or the one before
    bool overflowed_ = false;
};

}  // namespace hal
