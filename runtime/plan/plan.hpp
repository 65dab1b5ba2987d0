// SPDX-License-Identifier: MIT
// The execution plan: what one real-time thread runs, as plain data. Made by the compiler
// (model/compile), taken by a thread (execute) at a cycle boundary, immutable after that but for
// the values in its image. No names, no strings.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "hal/abi.h"
#include "plan/probe.hpp"
#include "plan/shared_state.hpp"

namespace hal::plan {

/// The one call of the cycle's inner loop.
using Step = hal_call;

/// Steps that are run by one call of their plugin, or (`run` is nullptr) one by one. Rows cover all
/// of Plan::steps, in order.
struct Row {
    hal_row run;
    std::uint32_t end;  ///< in Plan::steps
    static constexpr std::uint32_t worth = 4;  ///< fewer steps are not worth a row of their own
};

/// Times of one HAL function. The pins are linkable like any other; written by the function's
/// thread when it samples.
struct FunctionTimes {
    hal_pin time{};  ///< s32 out: last duration, ns
    hal_pin tmax{};  ///< s32 param: longest duration, ns; setp 0 restarts it
    hal_pin tmax_increased{};  ///< bit out: the last sample raised tmax
    /// written by the thread, read by the session
    std::atomic<std::uint64_t> samples{0};
    std::atomic<std::uint64_t> total_ns{0};
    FunctionTimes() = default;
};

/// One HAL function of a thread: its row of steps (a shared function has one per instance, a finite
/// check adds one).
struct Function {
    std::uint32_t begin, end;  ///< in Plan::steps
    std::uint32_t id;  ///< the model's number of the function, for fault records
    FunctionTimes* times;
};

/// `self` of the step that follows a function with a declared-finite output.
struct FiniteCheck {
    hal_pin* pin;
    hal_value instead;  ///< written when the value is NaN or infinite
    std::uint32_t pin_id;  ///< the model's number of the pin
    void* sink;  ///< the core of the thread
    bool bad = false;  ///< a row of bad values is one fault
};

/// A triple buffer of values from one thread to another. Written at the end of the writer's cycle,
/// taken at the start of the reader's; the reader sees whole finished cycles only.
///
/// `middle` holds the index of the buffer that is nobody's, plus `fresh` when the writer has put a
/// newer one there.
///   1. writer fills back       2. writer swaps back <-> middle|fresh       (release)
///   3. reader sees fresh       4. reader swaps front <-> middle            (acquire)
/// If 2 happens again between 3 and 4, the reader gets the newer buffer; writer and reader never
/// hold the same one.
struct Channel {
    static constexpr std::uint32_t fresh = 4;
    explicit Channel(std::size_t values) : size(values) {
        for (auto& buffer : buffers) {
            buffer = std::make_unique<hal_value[]>(values);
        }
    }
    std::size_t size;
    std::unique_ptr<hal_value[]> buffers[3];
    std::uint32_t back = 0;  ///< writer only
    std::uint32_t front = 1;  ///< reader only
    std::atomic<std::uint32_t> middle{2};
    /// of the values in each buffer, counted by the writer from 1: which of its finished cycles
    std::uint64_t sequences[3]{};
    std::uint64_t published = 0;  ///< writer only
    /// In a re-execution: what the reader has not taken yet, oldest first, and its sequence. A
    /// thread that reads an older cycle than the newest finds it here.
    struct History {
        std::deque<std::pair<std::uint64_t, std::vector<hal_value>>> entries;
    };
    std::unique_ptr<History> history;  ///< nullptr: live
};

struct Export {
    std::shared_ptr<Channel> channel;
    std::vector<const hal_value*> from;
};

struct Import {
    std::shared_ptr<Channel> channel;
    std::vector<hal_value*> to;
};

/// A value copied from a cell that several threads write (I/O pins across threads) into a reader's
/// slot.
struct CellImport {
    hal_value* to;
    const hal_value* cell;
};

/// Done once, when the plan is taken: `*to = from ? *from : value`. All reads happen before all
/// writes.
struct Carry {
    hal_value* to;
    const hal_value* from;
    hal_value value;
};

struct Rebind {
    hal_pin* pin;
    hal_value* slot;
};

/// The second pointer to a pin's slot that its component declared.
struct Pointer {
    hal_value** to;
    hal_value* slot;
};

/// A declared safe value of an output.
struct Safe {
    hal_pin* pin;
    hal_value value;
};

/// What all gates of a machine share.
struct GateCounters {
    std::atomic<std::uint64_t> tickets{0};
    std::atomic<std::uint32_t> inside{0};  ///< functions between their two steps
};

/// `self` of the steps before and after a function that shares state with a function of another
/// thread: with a journal, the order in which they ran is noted, and their state when they ran at
/// the same time.
struct Gate {
    GateCounters* counters = nullptr;
    const std::uint64_t* progress = nullptr;  ///< of the supervisor
    std::uint64_t* seen_progress = nullptr;  ///< what components see of it
    void* core = nullptr;
    SharedState state = {};
    std::uint64_t entered = 0;  ///< ticket with which the function began
};

/// A value that the checksum of a journaled cycle covers.
struct Checked {
    const hal_value* value;
    std::uint64_t mask;  ///< the bits that its type has
};

/// State that an instance takes over from the one it replaces. Done once, when the plan is taken.
struct Handover {
    void* to;
    const void* from;
    std::size_t bytes;
};

/// Records for the session that the state of an instance was handed over. Written by the thread
/// when it takes the plan; read by the session after that.
struct Handed {
    bool* to;
    bool value;
};

/// A plan of another thread that must be taken before this one.
struct Precedence {
    const std::atomic<std::uint64_t>* taken;
    std::uint64_t epoch;
};

/// Bytes in a row that the cycle works on.
struct Memory {
    const void* begin;
    std::size_t bytes;
};

struct Plan {
    std::uint64_t epoch = 0;
    std::vector<Step> steps;
    std::vector<Row> rows;
    std::vector<Function> functions;
    /// run once, in a cycle of their own, before the first cyclic pass
    std::vector<Function> init;
    std::vector<Step> init_steps;
    std::vector<Import> imports;
    std::vector<CellImport> cell_imports;
    std::vector<Export> exports;
    std::vector<Carry> carries;
    std::vector<Rebind> rebinds;
    std::vector<Pointer> pointers;
    std::vector<Handover> handovers;
    std::vector<Handed> handed;
    /// until all of these are taken, the thread continues with its old plan
    std::vector<Precedence> after;
    std::vector<Safe> safe;
    /// made safe by a call: instances of this thread with a hal::Emergency
    std::vector<Step> emergency;
    std::unique_ptr<FiniteCheck[]> finite_checks;
    std::vector<std::unique_ptr<Gate>> gates;  ///< one per gated function
    /// the slots of this thread's signals, in order of first use
    std::unique_ptr<hal_value[]> image;
    std::size_t image_size = 0;
    /// steps, image, code, instances in the order of their steps: see Core::warm
    std::vector<Memory> working_set;
    /// values of the thread, in order of the model; empty: it has no journal
    std::vector<Checked> checked;
    /// what must outlive the plan: cells shared between threads
    std::vector<std::shared_ptr<void>> keep;
    /// nullptr: nothing is probed. The session replaces it when a newer one has been taken
    std::unique_ptr<ProbeSet> probes;
    /// buffer for the values carried over, so that taking the plan allocates nothing
    std::vector<std::uint64_t> scratch;
};

}  // namespace hal::plan
