// SPDX-License-Identifier: MIT
// The interface to the DDS engine. This header includes nothing of Fast DDS, so that it compiles
// fast and the library can be replaced. The implementation is in engine/, in libhalcyon_dds.so,
// which all plugins of a process share: participants with equal settings are one participant, and
// one thread of the process, never a real-time one, writes.
//
// Samples are XCDR1, little-endian, with the encapsulation header 00 01 00 00 before the fields
// (DDSI-RTPS 2.3, 10.2); see schema.hpp.
//
// Writing one field from an ordinary thread:
//
//     const Schema schema = Schema::of_fields("angle:float");
//     const auto participant = open({.domain = 3, .name = "arm"});
//     const auto writer = participant->writer({"arm/state", schema.type, schema.sample.size()}, {.reliable = false}, nullptr);
//     auto bytes = schema.sample;                       // header and alignment included
//     std::memcpy(bytes.data() + schema.places[0].offset, &angle, sizeof angle);
//     if (!writer->write(bytes)) …                      // the history of a reliable writer is full
//
// Every function is [setup] or for an ordinary thread, unless its comment names another. Errors are
// std::runtime_error with a message for the user: what failed, why, what to type.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hal/abi.h"

namespace hal::dds {

/// Settings of a participant: its identity and the network it uses.
struct Settings {
    int domain = 0;  ///< 0 to 232
    std::string name;  ///< shown to others; the first caller of open() decides
    /// addresses or names of interfaces, or "all"; empty: 127.0.0.1, nothing leaves the machine
    std::vector<std::string> interfaces;
    /// addresses to search for participants, in addition to multicast
    std::vector<std::string> peers;
    std::vector<std::string> servers;  ///< ADDRESS:PORT of discovery servers; replaces multicast
    /// in addition to UDP; segments of killed processes are removed
    bool shared_memory = false;
    /// FILE.xml or FILE.xml:PROFILE of Fast DDS: a participant profile, used as it is
    std::string profile;
    /// a folder: identity_ca.cert.pem cert.pem key.pem permissions_ca.cert.pem governance.p7s
    /// permissions.p7s
    std::string security;
    std::string user_data;  ///< announced with the participant; see Participant::known()
    bool operator==(const Settings&) const = default;
};

/// QoS of a writer (offered) or a reader (requested). They match when the offer satisfies the
/// request (DDS 1.4, 2.2.3).
struct Quality {
    bool reliable = true;  ///< lost samples are retransmitted
    bool last_value = false;  ///< TRANSIENT_LOCAL: late joiners receive the newest samples
    int depth = 1;  ///< samples kept until they are delivered, 1..100000
    std::int64_t deadline_ns = 0;  ///< maximum interval between samples, ns; 0: none
    std::int64_t latency_budget_ns = 0;  ///< ns, a hint to the library
    std::int64_t lease_ns = 0;  ///< liveliness lease of the writer, ns; 0: that of its participant
    bool operator==(const Quality&) const = default;
};

struct TopicType {
    std::string name;  ///< on the wire: "rt/hal/float" for ROS 2's /hal/float
    std::string type;  ///< on the wire: "std_msgs::msg::dds_::Float64_"; equal at both ends
    std::size_t max;  ///< bytes of the largest sample, header included
    std::string shown = {};  ///< in messages: "/hal/float", as ROS 2 names it
};

/// A received sample. Its bytes are valid during the callback.
struct Sample {
    std::span<const std::uint8_t> bytes;
    std::int64_t source_ns;  ///< CLOCK_REALTIME of the writer when it was written
    std::int64_t received_ns;  ///< CLOCK_REALTIME at reception
    std::int64_t monotonic_ns;  ///< CLOCK_MONOTONIC at reception
    std::uint64_t sequence;  ///< number of the writer's sample, from 1
    std::array<std::uint8_t, 16> writer;  ///< its GUID
};

enum class Event {
    matched,  ///< an endpoint matched; `count`: all that match now
    unmatched,  ///< an endpoint was lost; `count`: all that match now
    wrong_type,  ///< another participant uses this topic with another type; `text` names both
    wrong_quality,  ///< incompatible QoS; `text` names the policy
    deadline_missed,  ///< no sample for deadline_ns
    alive,  ///< a writer's liveliness was asserted; `count`: writers alive now
    not_alive,  ///< a writer's liveliness lease expired; `count`: writers alive now
};

/// Receives the samples and events of one writer or reader, in threads of the engine: never in a
/// cycle, and never concurrently.
class Listener {
public:
    virtual void on_sample(const Sample&) noexcept {}
    virtual void on_event(Event, int /*count*/, const std::string& /*text*/) noexcept {}

protected:
    ~Listener() = default;
};

/// A data writer. Its destructor removes it; the listener is not called after that.
class Writer {
public:
    virtual ~Writer() = default;
    /// Writes one sample with the source time `source_ns` (CLOCK_REALTIME; 0: now). Returns false
    /// when the history is full because a reliable reader does not keep up. May block for the
    /// max_blocking_time of 100 ms: never in a cycle.
    virtual bool write(std::span<const std::uint8_t> bytes,
                       std::int64_t source_ns = 0) noexcept = 0;
    virtual int matched() const noexcept = 0;  ///< matched readers [any]
    /// Waits until all matched readers have acknowledged all samples. Returns false after
    /// `timeout_ns`.
    virtual bool wait_for_acknowledgments(std::int64_t timeout_ns) noexcept = 0;
};

/// A data reader. Its destructor removes it; the listener is not called after that.
class Reader {
public:
    virtual ~Reader() = default;
    virtual int matched() const noexcept = 0;  ///< matched writers [any]
};

/// Another participant of the domain, as it announces itself.
struct Known {
    std::string name, user_data;
    std::array<std::uint8_t, 12> prefix;  ///< of its GUIDs
};

/// A participant of a domain (DDS 1.4, 2.2.2.2.1).
class Participant {
public:
    virtual ~Participant() = default;
    /// Creates a data writer. `listener` may be null and must outlive the writer. Throws when the
    /// topic is in use with another type, or when the library creates none.
    virtual std::unique_ptr<Writer> writer(const TopicType&, const Quality&, Listener*) = 0;
    /// Creates a data reader, likewise.
    virtual std::unique_ptr<Reader> reader(const TopicType&, const Quality&, Listener*) = 0;
    /// Returns the participants discovered so far.
    virtual std::vector<Known> known() const = 0;
    virtual const Settings& settings() const noexcept = 0;
};

/// Returns the participant of this process with these settings, which is deleted with its last
/// owner. Its threads have an ordinary scheduling policy, also when a real-time thread calls this.
/// Throws for an unusable setting and names it. [setup]
HAL_EXPORT std::shared_ptr<Participant> open(const Settings&);

/// An object that the DDS thread of the process serves.
class Served {
public:
    /// Does the pending work. Returns the time of the next call, CLOCK_MONOTONIC ns; a time in the
    /// past means immediately. [the DDS thread]
    virtual std::int64_t serve(std::int64_t now_ns) noexcept = 0;

protected:
    ~Served() = default;
};

/// Adds an object to the DDS thread, which is started when needed. Throws when it cannot be.
/// [setup]
HAL_EXPORT void serve(Served&);
/// Removes it; returns after the last call of serve() has ended. [setup]
HAL_EXPORT void withdraw(Served&) noexcept;

}  // namespace hal::dds
