// SPDX-License-Identifier: MIT
// Keyframes of a re-execution: copies of the whole process that wait, so that the execution can
// continue from an earlier cycle (docs/internals/journal.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <sys/types.h>
#include <type_traits>
#include <vector>

namespace hal {

/// How far a re-execution has come.
struct KeyframeMark {
    std::uint64_t cycles = 0;   ///< executed so far, of all threads
    std::uint64_t fastest = 0;  ///< number of the newest cycle of the fastest thread
    std::int64_t time_ns = 0;   ///< of the newest cycle
};

/// Has at most `capacity` copies. One process is the active one, which executes; the front is the
/// process that created this object, and starts the first active one:
///
///     active ----keep()---> active ---- resume() ends it, the errand is in the shared memory
///        \ fork                          | a byte in the pipe of the chosen keyframe
///         keyframe waits  <--------------'
///           \ fork: the keyframe stays
///            the new active process returns from keep() with true
///
/// A copy has the memory of the process and the calling thread only: what has a thread of its own
/// or a device cannot be copied. All processes end with the front. [setup] throughout.
class Keyframes {
public:
    static constexpr std::size_t capacity = 48;
    static constexpr std::size_t errand_bytes = 4096;

    /// Creates the shared memory and the pipes. Throws std::system_error.
    Keyframes();
    ~Keyframes();  ///< In the front: ends all other processes.
    Keyframes(const Keyframes&) = delete;

    // --- by the front ----------------------------------------------------------------------------
    /// Forks the first active process. Returns 0 in it, -1 when it cannot be created.
    pid_t start();
    /// Returns false when the active process has ended without an answer.
    bool alive();
    /// Asks the active process to end its errand soon. [any]
    void interrupt(bool on) noexcept;

    // --- by the active process -------------------------------------------------------------------
    /// Makes a keyframe of this moment, and drops another one when there are too many. Returns true
    /// in a process that continues from it: its errand is errand().
    bool keep(const KeyframeMark& mark);
    /// Continues from the keyframe with most cycles for which `suits` returns true. Ends this
    /// process; returns only when there is no such keyframe.
    void resume(const std::function<bool(const KeyframeMark&)>& suits);
    /// Returns the cycles of that keyframe.
    std::optional<std::uint64_t> newest(
        const std::function<bool(const KeyframeMark&)>& suits) const;
    /// Returns true when the front wants the errand to end. [any]
    bool interrupted() const noexcept;
    /// Returns false when the front has ended.
    bool front_lives() const;
    /// A descriptor that becomes readable when the front has ended.
    int life() const { return life_[0]; }

    /// Memory of all processes, for what the next active process does.
    template <class Errand>
    Errand& errand() {
        static_assert(std::is_trivially_copyable_v<Errand> && sizeof(Errand) <= errand_bytes);
        return *static_cast<Errand*>(errand_memory());
    }

private:
    struct Slot;
    struct Shared;
    struct Wakeup {
        int ends[2] = {-1, -1};
    };
    void* errand_memory() noexcept;
    std::size_t free_slot(std::uint64_t cycles);
    void drop(Slot& slot);
    void reap();
    bool wait_in(std::size_t slot);
    const Slot* find(const std::function<bool(const KeyframeMark&)>& suits) const;

    Shared* shared_ = nullptr;  // written by the active process, interrupt() by the front
    std::vector<Wakeup> wakeups_;  // by slot
    int life_[2] = {-1, -1};  // the front alone has the end that is written
    pid_t front_ = 0;
    std::vector<pid_t> dropped_;  // children that were ended and not waited for
};

}  // namespace hal
