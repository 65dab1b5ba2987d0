// SPDX-License-Identifier: MIT
// Writes a trace as a Perfetto file (protobuf,
// https://perfetto.dev/docs/reference/trace-packet-proto), for ui.perfetto.dev and trace_processor.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "trace/protobuf.hpp"

namespace hal::tools {

/// One event of a thread, as the instance sends it (docs/protocol.md, "trace").
struct ThreadEvent {
    enum Kind : std::uint16_t {
        function = 1,
        cycle = 2,
        plan = 3,
        missed = 4,
        can_sent = 5,
        can_received = 6,
        ethernet_sent = 7,
        ethernet_received = 8
    };
    std::int64_t begin_ns, end_ns;
    std::uint64_t cycle_number;
    std::uint32_t id;
    std::uint16_t kind, bytes = 0;
};

struct TraceThread {
    std::string name;
    std::int64_t period_ns = 0;
    int tid = 0;
};

/// A switch of a CPU from one thread to another one, as the kernel reports it.
struct Switch {
    std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME
    int cpu = 0;
    std::string previous_name, next_name;
    int previous_tid = 0;
    int previous_priority = 0;
    int next_tid = 0;
    int next_priority = 0;
    std::int64_t previous_state = 0;  ///< 0: it could have continued
};

/// Clocks read at the same instant.
struct ClockReading {
    std::int64_t monotonic_ns = 0;
    std::int64_t realtime_ns = 0;
    std::int64_t boottime_ns = 0;
};

/// A number beside an event.
struct Annotation {
    const char* name;
    std::uint64_t value;
};

/// Turns events into packets. All packets belong to one sequence, which begins with begin().
class PerfettoWriter {
public:
    /// Returns the first packets: clocks, the process and a track for what is in the journal:
    /// faults, edits, commands, messages.
    std::string begin(const std::string& instance, std::int64_t pid, const ClockReading& clocks);
    /// Names a function of later events.
    void name(std::uint32_t function, const std::string& name) { functions_[function] = name; }
    /// Returns the packets of events of one thread, in the order of its ring: functions before
    /// their cycle.
    std::string events(const TraceThread& thread, const std::vector<ThreadEvent>& events,
                       std::uint64_t lost);
    /// Returns an instant: a fault, an edit or a command.
    std::string instant(std::int64_t time_ns, const std::string& kind, const std::string& text);
    /// Returns a value of a counter below the thread.
    std::string counter(const TraceThread& thread, const std::string& name, std::int64_t time_ns,
                        std::int64_t value, const char* unit = "ns");
    static std::string switches(const std::vector<Switch>& all);

private:
    std::uint64_t track(const TraceThread& thread, std::string& out);
    std::uint64_t interned(const std::string& name, Message& packet);
    void slice(std::string& out, std::uint64_t track, std::int64_t begin_ns,
               const std::string& name, const std::vector<Annotation>& annotations);
    static void end(std::string& out, std::uint64_t track, std::int64_t time_ns);
    void mark(std::string& out, std::uint64_t track, std::int64_t time_ns, const std::string& name,
              const std::vector<Annotation>& annotations, const std::string& text = "");

    std::int64_t pid_ = 0;
    std::map<std::uint32_t, std::string> functions_;
    std::map<std::string, std::uint64_t> names_;  ///< interned
    std::map<int, std::uint64_t> threads_;  ///< tracks by tid
    std::map<std::pair<int, std::string>, std::uint64_t> counters_;
    /// functions by tid whose cycle has not ended yet
    std::map<int, std::vector<ThreadEvent>> open_;
    std::uint64_t next_track_ = 16;
};

}  // namespace hal::tools
