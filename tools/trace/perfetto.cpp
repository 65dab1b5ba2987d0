// SPDX-License-Identifier: MIT
#include "trace/perfetto.hpp"

#include <algorithm>
#include <fmt/core.h>

namespace hal::tools {

namespace {

// Numbers of fields, by message.
namespace trace {
constexpr unsigned packet = 1;
}
namespace packet {
constexpr unsigned ftrace_events = 1;
constexpr unsigned clock_snapshot = 6;
constexpr unsigned timestamp = 8;
constexpr unsigned sequence = 10;

constexpr unsigned track_event = 11;
constexpr unsigned interned_data = 12;
constexpr unsigned sequence_flags = 13;
constexpr unsigned timestamp_clock = 58;

constexpr unsigned defaults = 59;
constexpr unsigned track_descriptor = 60;
}  // namespace packet
namespace snapshot {
constexpr unsigned clocks = 1;
constexpr unsigned primary = 2;
constexpr unsigned clock_id = 1;
constexpr unsigned clock_timestamp = 2;
}  // namespace snapshot
namespace descriptor {
constexpr unsigned uuid = 1;
constexpr unsigned name = 2;
constexpr unsigned process = 3;
constexpr unsigned thread = 4;
constexpr unsigned parent = 5;
constexpr unsigned counter = 8;
constexpr unsigned process_pid = 1;
constexpr unsigned process_name = 6;
constexpr unsigned thread_pid = 1;
constexpr unsigned thread_tid = 2;

constexpr unsigned thread_name = 5;
constexpr unsigned counter_unit = 3;
constexpr unsigned counter_unit_name = 6;
}  // namespace descriptor
namespace event {
constexpr unsigned annotations = 4;
constexpr unsigned type = 9;
constexpr unsigned name_iid = 10;
constexpr unsigned track = 11;
constexpr unsigned name = 23;

constexpr unsigned counter_value = 30;
}  // namespace event
namespace annotation {
constexpr unsigned uint = 3;
constexpr unsigned string = 6;
constexpr unsigned name = 10;
}  // namespace annotation
namespace bundle {
constexpr unsigned cpu = 1;
constexpr unsigned event = 2;
constexpr unsigned event_timestamp = 1;
constexpr unsigned event_pid = 2;
constexpr unsigned sched_switch = 4;
constexpr unsigned prev_comm = 1;
constexpr unsigned prev_pid = 2;
constexpr unsigned prev_prio = 3;
constexpr unsigned prev_state = 4;
constexpr unsigned next_comm = 5;

constexpr unsigned next_pid = 6;
constexpr unsigned next_prio = 7;
}  // namespace bundle

constexpr std::uint64_t realtime = 1;
constexpr std::uint64_t monotonic = 3;
constexpr std::uint64_t boottime = 6;                    // clocks
// types of events
constexpr std::uint64_t slice_begin = 1;
constexpr std::uint64_t slice_end = 2;
constexpr std::uint64_t instant_event = 3;
constexpr std::uint64_t counter_event = 4;
// sequence flags
constexpr std::uint64_t state_cleared = 1;
constexpr std::uint64_t needs_state = 2;
constexpr std::uint64_t process_track = 1;
constexpr std::uint64_t journal_track = 2;
constexpr std::uint64_t own_sequence = 1;

std::string packed(const Message& message) {
    return Message().message(trace::packet, message).bytes();
}

Message packet_at(std::int64_t time_ns) {
    Message message;
    message.number(packet::timestamp, static_cast<std::uint64_t>(time_ns))
        .number(packet::sequence, own_sequence)
        .number(packet::sequence_flags, needs_state);
    return message;
}

Message clock_at(std::uint64_t id, std::int64_t time_ns) {
    Message clock;
    clock.number(snapshot::clock_id, id)
        .number(snapshot::clock_timestamp, static_cast<std::uint64_t>(time_ns));
    return clock;
}

std::string described(const Message& descriptor) {
    Message message;
    message.number(packet::sequence, own_sequence).message(packet::track_descriptor, descriptor);
    return packed(message);
}

Message event_of(std::uint64_t type, std::uint64_t interned_name, std::uint64_t track,
                 const std::vector<Annotation>& annotations) {
    Message event;
    event.number(event::type, type)
        .number(event::name_iid, interned_name)
        .number(event::track, track);
    for (const auto& one : annotations) {
        Message annotation;
        annotation.text(annotation::name, one.name).number(annotation::uint, one.value);
        event.message(event::annotations, annotation);
    }
    return event;
}

std::string frame_name(const ThreadEvent& frame) {
    const bool sent =
        frame.kind == ThreadEvent::can_sent || frame.kind == ThreadEvent::ethernet_sent;
    const std::string what = sent ? "send " : "receive ";
    if (frame.kind >= ThreadEvent::ethernet_sent) {
        return what + fmt::format("Ethernet {:04X}h", frame.id);
    }
    constexpr std::uint32_t extended = 0x80000000U;
    return what + (frame.id & extended ? fmt::format("CAN {:08X}h", frame.id & ~extended)
                                       : fmt::format("CAN {:03X}h", frame.id));
}

}  // namespace

std::string PerfettoWriter::begin(const std::string& instance, std::int64_t pid,
                                  const ClockReading& clocks) {
    pid_ = pid;
    Message snapshot;
    snapshot.message(snapshot::clocks, clock_at(realtime, clocks.realtime_ns))
        .message(snapshot::clocks, clock_at(monotonic, clocks.monotonic_ns))
        .message(snapshot::clocks, clock_at(boottime, clocks.boottime_ns))
        .number(snapshot::primary, monotonic);
    Message first;
    first.message(packet::clock_snapshot, snapshot).number(packet::sequence, own_sequence);
    Message defaults;
    defaults.number(packet::timestamp_clock, monotonic);
    Message second;
    second.number(packet::sequence, own_sequence)
        .number(packet::sequence_flags, state_cleared)
        .message(packet::defaults, defaults);
    Message process;
    process.number(descriptor::process_pid, static_cast<std::uint64_t>(pid))
        .text(descriptor::process_name, "hal " + instance);
    Message whole, journal;
    whole.number(descriptor::uuid, process_track).message(descriptor::process, process);
    journal.number(descriptor::uuid, journal_track)
        .text(descriptor::name, "faults, edits, messages")
        .number(descriptor::parent, process_track);
    return packed(first) + packed(second) + described(whole) + described(journal);
}

std::uint64_t PerfettoWriter::track(const TraceThread& thread, std::string& out) {
    const auto [at, fresh] = threads_.emplace(thread.tid, next_track_);
    if (!fresh) return at->second;
    ++next_track_;
    Message about, whole;
    about.number(descriptor::thread_pid, static_cast<std::uint64_t>(pid_))
        .number(descriptor::thread_tid, static_cast<std::uint64_t>(thread.tid))
        .text(descriptor::thread_name, thread.name);
    whole.number(descriptor::uuid, at->second)
        .number(descriptor::parent, process_track)
        .message(descriptor::thread, about);
    out += described(whole);
    return at->second;
}

/// A name that is new goes into the packet that uses it first.
std::uint64_t PerfettoWriter::interned(const std::string& name, Message& to) {
    const auto [at, fresh] = names_.emplace(name, names_.size() + 1);
    if (fresh) {
        Message entry, data;
        entry.number(1, at->second).text(2, name);
        data.message(2, entry);
        to.message(packet::interned_data, data);
    }
    return at->second;
}

void PerfettoWriter::slice(std::string& out, std::uint64_t track, std::int64_t begin_ns,
                           const std::string& name, const std::vector<Annotation>& annotations) {
    Message message = packet_at(begin_ns);
    const Message event = event_of(slice_begin, interned(name, message), track, annotations);
    out += packed(message.message(packet::track_event, event));
}

void PerfettoWriter::end(std::string& out, std::uint64_t track, std::int64_t time_ns) {
    Message message = packet_at(time_ns), event;
    event.number(event::type, slice_end).number(event::track, track);
    out += packed(message.message(packet::track_event, event));
}

void PerfettoWriter::mark(std::string& out, std::uint64_t track, std::int64_t time_ns,
                          const std::string& name, const std::vector<Annotation>& annotations,
                          const std::string& text) {
    Message message = packet_at(time_ns);
    Message event = event_of(instant_event, interned(name, message), track, annotations);
    if (!text.empty()) {
        Message annotation;
        annotation.text(annotation::name, "text").text(annotation::string, text);
        event.message(event::annotations, annotation);
    }
    out += packed(message.message(packet::track_event, event));
}

std::string PerfettoWriter::events(const TraceThread& thread,
                                   const std::vector<ThreadEvent>& events, std::uint64_t lost) {
    std::string out;
    const std::uint64_t to = track(thread, out);
    std::vector<ThreadEvent>& open = open_[thread.tid];
    const auto inner = [&](const ThreadEvent& one) {
        if (one.kind >= ThreadEvent::can_sent) {
            return mark(out, to, one.begin_ns, frame_name(one), {{"bytes", one.bytes}});
        }
        const auto named = functions_.find(one.id);
        const std::string function =
            named != functions_.end() ? named->second : fmt::format("function {}", one.id);
        const bool is_plan = one.kind == ThreadEvent::plan;
        slice(out, to, one.begin_ns, is_plan ? "take new plan" : function, {});
        end(out, to, one.end_ns);
    };
    for (const ThreadEvent& one : events) {
        if (one.kind == ThreadEvent::missed) {
            mark(out, to, one.begin_ns, "missed periods",
                 {{"periods", one.id}, {"next_cycle", one.cycle_number}});
        } else if (one.kind != ThreadEvent::cycle) {
            open.push_back(one);
        } else {
            // What ended before the cycle began (a plan taken between two cycles) stands for
            // itself.
            const auto within = std::stable_partition(
                open.begin(), open.end(),
                [&](const ThreadEvent& other) { return other.begin_ns < one.begin_ns; });
            std::for_each(open.begin(), within, inner);
            slice(out, to, one.begin_ns, "cycle",
                  {{"cycle", one.cycle_number}, {"latency_ns", one.id}});
            std::for_each(within, open.end(), inner);
            end(out, to, one.end_ns);
            const std::int64_t took_ns = one.end_ns - one.begin_ns;
            if (took_ns + one.id > thread.period_ns) {
                mark(out, to, one.end_ns, "overrun",
                     {{"cycle", one.cycle_number},
                      {"latency_ns", one.id},
                      {"execution_ns", static_cast<std::uint64_t>(took_ns)}});
            }
            out += counter(thread, "wake-up latency", one.begin_ns, one.id);
            out += counter(thread, "execution time", one.begin_ns, took_ns);
            open.clear();
        }
    }
    if (lost > 0 && !events.empty()) {
        mark(out, to, events.back().end_ns, "lost events", {{"events", lost}});
    }
    return out;
}

std::string PerfettoWriter::instant(std::int64_t time_ns, const std::string& kind,
                                    const std::string& text) {
    std::string out;
    mark(out, journal_track, time_ns, kind, {}, text);
    return out;
}

std::string PerfettoWriter::counter(const TraceThread& thread, const std::string& name,
                                    std::int64_t time_ns, std::int64_t value, const char* unit) {
    std::string out;
    const auto [at, fresh] = counters_.emplace(std::pair(thread.tid, name), next_track_);
    if (fresh) {
        ++next_track_;
        Message about, whole;
        about.text(descriptor::counter_unit_name, unit);
        if (std::string_view(unit) == "ns") {
            about.number(descriptor::counter_unit, 1);
        }
        whole.number(descriptor::uuid, at->second)
            .text(descriptor::name, thread.name + " " + name)
            .number(descriptor::parent, process_track)
            .message(descriptor::counter, about);
        out += described(whole);
    }
    Message message = packet_at(time_ns), event;
    event.number(event::type, counter_event)
        .number(event::track, at->second)
        .number(event::counter_value, static_cast<std::uint64_t>(value));
    return out + packed(message.message(packet::track_event, event));
}

std::string PerfettoWriter::switches(const std::vector<Switch>& all) {
    std::map<int, Message> bundles;
    for (const Switch& one : all) {
        Message change, event;
        change.text(bundle::prev_comm, one.previous_name)
            .number(bundle::prev_pid, static_cast<std::uint64_t>(one.previous_tid))
            .number(bundle::prev_prio, static_cast<std::uint64_t>(one.previous_priority))
            .number(bundle::prev_state, static_cast<std::uint64_t>(one.previous_state))
            .text(bundle::next_comm, one.next_name)
            .number(bundle::next_pid, static_cast<std::uint64_t>(one.next_tid))
            .number(bundle::next_prio, static_cast<std::uint64_t>(one.next_priority));
        event.number(bundle::event_timestamp, static_cast<std::uint64_t>(one.time_ns))
            .number(bundle::event_pid, static_cast<std::uint64_t>(one.previous_tid))
            .message(bundle::sched_switch, change);
        Message& bundle = bundles[one.cpu];
        if (bundle.bytes().empty()) {
            bundle.number(bundle::cpu, static_cast<std::uint64_t>(one.cpu));
        }
        bundle.message(bundle::event, event);
    }
    std::string out;
    for (const auto& [cpu, bundle] : bundles) {
        Message message;
        message.message(packet::ftrace_events, bundle).number(packet::sequence, own_sequence + 1);
        out += packed(message);
    }
    return out;
}

}  // namespace hal::tools
