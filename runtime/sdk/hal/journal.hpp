// SPDX-License-Identifier: MIT
// What a function takes in its cycle from a thread of its component's own, in the journal of the
// machine. When the journal is executed again, the thread does nothing, and the function gets what
// it got.
#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>

// Defined by a program with journals, null in others. They are about the calling thread: the
// function that its cycle runs, or the setup call of a component that it makes. [realtime] in a
// cycle
extern "C" {
/// 0: there is no journal; 1: results are recorded; 2: they are given back
[[gnu::weak, gnu::visibility("default")]] int hal_journal_mode() noexcept;
/// Appends the bytes of a result.
[[gnu::weak, gnu::visibility("default")]] void hal_journal_put(const void* bytes,
                                                               std::size_t size) noexcept;
/// Takes the bytes of a result. Returns 0, with zeros, when the journal has no more.
[[gnu::weak, gnu::visibility("default")]] int hal_journal_get(void* bytes,
                                                              std::size_t size) noexcept;
/// 1: a link is opened; 0: it is open. Its descriptors and threads are not the component's.
[[gnu::weak, gnu::visibility("default")]] void hal_journal_link(int begins) noexcept;
}

namespace hal {

/// Records values that a function has taken, or replaces them by the recorded ones. Without a
/// journal it does nothing. [realtime] in a cycle
template <class T>
void journaled(T* values, std::size_t count) noexcept {
    static_assert(std::is_trivially_copyable_v<T>);
    const int mode = hal_journal_mode ? hal_journal_mode() : 0;
    if (mode == 1 && hal_journal_put) {
        hal_journal_put(values, count * sizeof(T));
    } else if (mode == 2 && hal_journal_get) {
        hal_journal_get(values, count * sizeof(T));
    }
}

/// The same of one value. [realtime] in a cycle, or in start()
template <class T>
void journaled(T& value) noexcept {
    journaled(&value, 1);
}

/// Returns whether a journal is executed again: nothing outside of the process is to be opened.
/// [any]
inline bool is_executed_again() noexcept { return hal_journal_mode && hal_journal_mode() == 2; }

/// A value that changes seldom, recorded when it has changed.
template <class T>
class JournaledValue {
public:
    /// Returns `now`, or the recorded value. Called once in a cycle. [realtime]
    T operator()(T now) noexcept {
        bool has_changed = std::memcmp(&now, &last_, sizeof now) != 0;
        journaled(has_changed);
        if (has_changed) {
            journaled(now);
            last_ = now;
        }
        return last_;
    }

private:
    T last_{};
};

/// What a start() opens or creates while this exists gives its data to functions that journal all
/// of them: `hal replay --exact` does not name it. [setup]
class JournaledSource {
public:
    JournaledSource() noexcept { mark(1); }
    ~JournaledSource() { mark(0); }
    JournaledSource(const JournaledSource&) = delete;

private:
    static void mark(int begins) noexcept {
        if (hal_journal_link) {
            hal_journal_link(begins);
        }
    }
};

}  // namespace hal
