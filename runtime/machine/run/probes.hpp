// SPDX-License-Identifier: MIT
// Probes of a session: values sampled at the end of every n-th cycle of their threads, for
// observers that may come and go. Nothing of the netlist changes; a thread only gets a list of
// places to copy from (plan/probe.hpp).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/abi.h"
#include "machine/run/live_values.hpp"

namespace hal {

struct Compiled;
struct SessionState;
struct LiveProbe;
struct RingGroup;

struct ProbeRequest {
    std::vector<std::string> names;      ///< pins, parameters, signals
    std::uint32_t every = 1;             ///< cycles of each thread from one row to the next
    std::int64_t buffer_ns = 2'000'000'000;  ///< capacity of each thread's ring
    std::size_t buffer_rows = 0;             ///< in place of buffer_ns where it is not 0
    /// The end of the problem when the rings need too much memory.
    std::string advice = "name fewer";
};

struct ProbeColumn {
    std::string name;
    hal_type type = HAL_TYPE_BIT;
    std::string unit;
};

/// The columns whose values one thread owns, or reads while no thread owns them.
struct ProbeGroup {
    /// empty: no thread reads them; they are looked at when the probe is attached and when rows
    /// are taken
    std::string thread;
    std::int64_t period_ns = 0;          ///< between two rows; 0: a row when a value has changed
    std::vector<std::size_t> columns;
};

struct ProbeLayout {
    /// counts from 1; another one after an edit that moves or removes a value
    std::uint64_t number = 0;
    std::vector<ProbeGroup> groups;
};

/// Rows as docs/protocol.md has them.
struct ProbeRows {
    struct Part {
        std::size_t group, rows;
        std::uint64_t lost;              ///< rows that did not fit since the part before
    };
    std::optional<ProbeLayout> layout;   ///< when it is not that of the rows before
    std::uint64_t layout_number = 0;
    /// all rows of earlier cycles are in this or in an earlier result
    std::int64_t until_ns = 0;
    std::vector<Part> parts;
    std::string bytes;
};

/// Part of a Session. [setup]
class Probes {
public:
    static constexpr std::size_t max_names = 4096;
    static constexpr std::size_t max_bytes = std::size_t{64} << 20;  ///< of the rings of one probe
    explicit Probes(SessionState& state);
    ~Probes();

    /// Begins to sample. Returns nullptr and sets `problem` when a name is unknown or a limit is
    /// exceeded.
    std::shared_ptr<LiveProbe> attach(const ProbeRequest& request, std::string& problem);
    /// Ends it. Rows that were not taken are discarded.
    void detach(const std::shared_ptr<LiveProbe>& probe);
    static const std::vector<ProbeColumn>& columns(const LiveProbe& probe);
    static const ProbeLayout& layout(const LiveProbe& probe);
    /// Returns how many rows did not fit since the probe was attached.
    static std::uint64_t lost(const LiveProbe& probe);
    /// What happens to rows after the newest cycle of the slowest thread, which may still add an
    /// earlier row: they stay while threads run, and are taken when none does.
    enum class Rest { stays, taken };
    /// Takes the rows that have come, at most so many bytes in each result. There is one result per
    /// layout in force since the last call.
    std::vector<ProbeRows> take(LiveProbe& probe, std::size_t max_bytes = max_at_once,
                                Rest rest = Rest::stays);
    static constexpr std::size_t max_at_once = std::size_t{1} << 18;

    /// For the compiler's result that threads are going to take: gives each plan its probes.
    void enter(Compiled& compiled);

private:
    void offer();
    void take_values(LiveProbe&, std::size_t number, ProbeRows& to) const;
    std::vector<std::uint64_t> look_at(const LiveProbe&, const RingGroup&) const;

    SessionState& state_;
    std::vector<std::shared_ptr<LiveProbe>> live_;
    std::uint64_t epoch_ = 0;
};

}  // namespace hal
