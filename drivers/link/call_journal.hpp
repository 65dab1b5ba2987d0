// SPDX-License-Identifier: MIT
// What a link gives its user, in the journal of the program that uses it (docs/internals/journal.md).
// A call on a journaled link is recorded with its results; when the journal is executed again, it
// gets the same results, and nothing is opened.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

#include <pthread.h>

#include "hal/journal.hpp"

// Defined by a program with journals (runtime/machine/run/setup_journal.cpp), null in others, as those
// of hal/journal.hpp. [realtime] in a cycle
extern "C" {
/// The link has sent other frames than in the journal. The text outlives the cycle.
[[gnu::weak, gnu::visibility("default")]] void hal_journal_differs(const char* link) noexcept;
/// Not 0: clocks are read by a driver, whose results are recorded. Returns what it was before.
[[gnu::weak, gnu::visibility("default")]] int hal_journal_hide(int hidden) noexcept;
/// Notes that an ordered call begins; when executed again, waits for those before it.
[[gnu::weak, gnu::visibility("default")]] void hal_journal_order() noexcept;
/// Returns the thread of the machine whose cycle calls; 0: none.
[[gnu::weak, gnu::visibility("default")]] unsigned hal_journal_thread() noexcept;
}

namespace hal::link {

enum class JournalMode : std::uint8_t { none, records, executes_again };

/// Returns what the journal does with calls of the calling thread. [any]
inline JournalMode journal_mode() noexcept {
    return hal_journal_mode ? static_cast<JournalMode>(hal_journal_mode()) : JournalMode::none;
}

/// Returns what identifies the calling thread of the machine, also in a re-execution, which runs the
/// cycles of all threads on one. [any]
inline pthread_t calling_thread() noexcept {
    const unsigned thread = hal_journal_thread ? hal_journal_thread() : 0;
    return thread != 0 ? pthread_t{thread} : pthread_self();
}

/// The driver's own readings of clocks are not recorded while this exists.
class HiddenReadings {
public:
    HiddenReadings() noexcept : before_(hal_journal_hide ? hal_journal_hide(1) : 0) {}
    ~HiddenReadings() {
        if (hal_journal_hide) {
            hal_journal_hide(before_);
        }
    }
    HiddenReadings(const HiddenReadings&) = delete;

private:
    const int before_;
};

/// What is opened while this exists belongs to a journaled link. [setup]
class OpeningLink {
public:
    OpeningLink() noexcept {
        if (hal_journal_link) {
            hal_journal_link(1);
        }
    }
    ~OpeningLink() {
        if (hal_journal_link) {
            hal_journal_link(0);
        }
    }
    OpeningLink(const OpeningLink&) = delete;

private:
    const HiddenReadings hidden_;
};

/// The results of one call. Each member records its argument, or replaces it by the recorded value;
/// without a journal it does nothing. Numbers take as few bytes as they need.
class JournaledCall {
public:
    JournaledCall() noexcept : mode_(journal_mode()) {}
    ~JournaledCall() { flush(); }
    JournaledCall(const JournaledCall&) = delete;

    bool is_journaled() const noexcept { return mode_ != JournalMode::none; }
    bool is_repeated() const noexcept { return mode_ == JournalMode::executes_again; }

    template <class T>
    void number(T& value) noexcept {
        static_assert(std::is_integral_v<T> || std::is_enum_v<T>);
        if (is_repeated()) {
            value = static_cast<T>(get_number());
        } else if (is_journaled()) {
            put_number(static_cast<std::uint64_t>(value));
        }
    }
    /// A time near `base`, in ns.
    void time(std::int64_t& value, std::int64_t base) noexcept {
        const auto by = static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(base);
        std::uint64_t zigzag = (by << 1) ^ (by >> 63 != 0 ? ~std::uint64_t{0} : 0);
        number(zigzag);
        if (!is_repeated()) return;
        const std::uint64_t back = (zigzag >> 1) ^ ((zigzag & 1) != 0 ? ~std::uint64_t{0} : 0);
        value = static_cast<std::int64_t>(static_cast<std::uint64_t>(base) + back);
    }
    void bytes(void* to, std::size_t size) noexcept {
        if (is_repeated()) {
            if (hal_journal_get) {
                hal_journal_get(to, size);
            }
        } else if (is_journaled()) {
            put(to, size);
        }
    }
    void real(double& value) noexcept { bytes(&value, sizeof value); }
    /// At most `max` bytes. [setup]
    void text(std::string& value, std::size_t max = 4096) {
        std::size_t size = value.size() < max ? value.size() : max;
        number(size);
        value.resize(size < max ? size : max);
        bytes(value.data(), value.size());
    }
    /// A value that the user of `link` has computed: when it is another one, that is a difference.
    void compare(std::uint32_t value, const char* link) noexcept {
        const std::uint32_t computed = value;
        bytes(&value, sizeof value);
        if (value != computed && hal_journal_differs) {
            hal_journal_differs(link);
        }
    }
    enum class Sending : std::uint8_t { send = 0xa0, flush = 0xb0 };
    /// The result of a call that sends on `link`, below 16. Where the journal has another call,
    /// that is a difference.
    template <class T>
    void sent(Sending mark, T& value, const char* link) noexcept {
        const auto bits = static_cast<std::uint8_t>(mark);
        auto code = static_cast<std::uint8_t>(bits | static_cast<std::uint8_t>(value));
        bytes(&code, sizeof code);
        if (is_repeated() && (code & 0xf0) != bits && hal_journal_differs) {
            hal_journal_differs(link);
        }
        value = static_cast<T>(code & 0x0f);
    }
    /// Writes what was recorded by now.
    void flush() noexcept {
        if (used_ != 0 && hal_journal_put) {
            hal_journal_put(buffer_.data(), used_);
        }
        used_ = 0;
    }

private:
    void put(const void* from, std::size_t size) noexcept {
        if (size > buffer_.size() - used_) {
            flush();
        }
        if (size > buffer_.size()) {
            if (hal_journal_put) {
                hal_journal_put(from, size);
            }
            return;
        }
        if (size != 0) {
            std::memcpy(buffer_.data() + used_, from, size);
        }
        used_ += size;
    }
    void put_number(std::uint64_t value) noexcept {
        std::array<std::uint8_t, 10> coded;
        std::size_t size = 0;
        for (; value >= 0x80; value >>= 7) {
            coded[size++] = static_cast<std::uint8_t>(value | 0x80);
        }
        coded[size++] = static_cast<std::uint8_t>(value);
        put(coded.data(), size);
    }
    std::uint64_t get_number() noexcept {
        std::uint64_t value = 0;
        for (unsigned shift = 0; shift < 64; shift += 7) {
            std::uint8_t byte = 0;
            bytes(&byte, 1);
            value |= std::uint64_t{byte & 0x7fu} << shift;
            if (byte < 0x80) break;
        }
        return value;
    }

    const JournalMode mode_;
    std::size_t used_ = 0;
    std::array<std::uint8_t, 240> buffer_;
};

/// A checksum of what a link sends, over words of 64 bits.
class SentChecksum {
public:
    void add(std::uint64_t word) noexcept {
        constexpr std::uint64_t factor = 0x9E3779B97F4A7C15;
        value_ = (value_ ^ word) * factor;
        value_ ^= value_ >> 29;
    }
    void add(std::span<const std::uint8_t> bytes) noexcept {
        std::size_t at = 0;
        for (std::uint64_t word = 0; at + sizeof word <= bytes.size(); at += sizeof word) {
            std::memcpy(&word, bytes.data() + at, sizeof word);
            add(word);
        }
        std::uint64_t rest = bytes.size();
        for (; at < bytes.size(); ++at) {
            rest = rest << 8 | bytes[at];
        }
        add(rest);
    }
    std::uint32_t value() const noexcept {
        return static_cast<std::uint32_t>(value_ ^ (value_ >> 32));
    }

private:
    std::uint64_t value_ = 0;
};

}  // namespace hal::link
