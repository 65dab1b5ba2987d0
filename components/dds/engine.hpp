// SPDX-License-Identifier: MIT
// The seam to the DDS engine. Nothing of Fast DDS is in this header: what includes it compiles fast, and another engine could stand behind
// it. The one behind it is Fast DDS, in engine/, in libhalcyon_dds.so, which all plugins of a process share: participants of equal settings
// are one participant, and one thread of the process, never a real-time one, writes.
//
// Bytes are XCDR1, little-endian, with the header of four bytes 00 01 00 00 before the fields (DDSI-RTPS 2.3, 10.2); see schema.hpp.
// Everything here is [setup] or an ordinary thread, unless it says otherwise; errors are std::runtime_error with a sentence and what to type.
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

/// Of a participant: who we are and whom we reach.
struct Settings {
    int                      domain = 0;  ///< 0 to 232
    std::string              name;  ///< as others see it; of the first that opens the participant
    std::vector<std::string> interfaces;  ///< addresses or names of interfaces, or "all"; empty: 127.0.0.1, nothing leaves the machine
    std::vector<std::string> peers;  ///< addresses where participants are looked for beside the multicast group
    std::vector<std::string> servers;  ///< ADDRESS:PORT of discovery servers; then nothing is multicast
    bool                     shared_memory = false;  ///< beside UDP; what a killed process leaves in /dev/shm the next one removes
    std::string              profile;  ///< FILE.xml or FILE.xml:PROFILE of Fast DDS: a participant profile, used as it is
    std::string security;  ///< a folder: identity_ca.cert.pem cert.pem key.pem permissions_ca.cert.pem governance.p7s permissions.p7s
    std::string user_data;  ///< announced with the participant; see Participant::known()
    bool        operator==(const Settings&) const = default;
};

/// Of a writer or a reader. A reader asks, a writer offers; what is offered must be as good as what is asked.
struct Quality {
    bool         reliable = true;  ///< lost packets are sent again
    bool         last_value = false;  ///< TRANSIENT_LOCAL: who comes later gets the newest samples too
    int          depth = 1;  ///< samples kept for those who have not got them yet
    std::int64_t deadline_ns = 0;  ///< a sample at least so often; 0: no promise
    std::int64_t latency_budget_ns = 0;  ///< a hint
    std::int64_t lease_ns = 0;  ///< liveliness: a writer that is not heard of for so long is dead; 0: as long as its participant is alive
    bool         operator==(const Quality&) const = default;
};

struct TopicType {
    std::string name;  ///< on the wire: "rt/hal/float" for ROS 2's /hal/float
    std::string type;  ///< on the wire: "std_msgs::msg::dds_::Float64_"; equal in all that meet
    std::size_t largest;  ///< bytes of the largest sample, header included
};

/// One sample as it came. Its bytes are valid during the call.
struct Sample {
    std::span<const std::uint8_t> bytes;
    std::int64_t                  source_ns;  ///< the writer's CLOCK_REALTIME when it was written
    std::int64_t                  received_ns;  ///< our CLOCK_REALTIME when it came
    std::int64_t                  monotonic_ns;  ///< our CLOCK_MONOTONIC when it came
    std::uint64_t                 sequence;  ///< counts this writer's samples from 1
    std::array<std::uint8_t, 16>  writer;  ///< its GUID
};

enum class Event {
    matched,  ///< `count` matched now, one more than before
    unmatched,  ///< `count` matched now, one less
    wrong_type,  ///< somebody has this topic with another type; `words` names both
    wrong_quality,  ///< the other side offers less than is asked; `words` says of which policy
    deadline_missed,  ///< no sample for deadline_ns
    alive,
    not_alive  ///< of a reader: liveliness of `count` writers now
};

/// What a writer or reader says, in threads of the engine: never in a cycle, and never two calls at once for one writer or reader.
class Listener {
public:
    virtual void on_sample(const Sample&) noexcept {}
    virtual void on_event(Event, int /*count*/, const std::string& /*words*/) noexcept {}

protected:
    ~Listener() = default;
};

/// Ends, and calls its listener no more, when it is destroyed.
class Writer {
public:
    virtual ~Writer() = default;
    /// Writes one sample with the time `source_ns` (CLOCK_REALTIME; 0: now). False when it was refused (a reliable reader does not keep
    /// up and the history is full). May block for the max_blocking_time of 100 ms: never in a cycle.
    virtual bool write(std::span<const std::uint8_t> bytes, std::int64_t source_ns = 0) noexcept = 0;
    virtual int  matched() const noexcept = 0;  ///< readers [any]
    /// Readers have all samples; false when `timeout_ns` was over before.
    virtual bool wait_for_acknowledgments(std::int64_t timeout_ns) noexcept = 0;
};

class Reader {
public:
    virtual ~Reader() = default;
    virtual int matched() const noexcept = 0;  ///< writers [any]
};

/// Another participant of the domain, as it announced itself.
struct Known {
    std::string                  name, user_data;
    std::array<std::uint8_t, 12> prefix;  ///< of its GUIDs
};

class Participant {
public:
    virtual ~Participant() = default;
    /// The listener outlives the writer or reader.
    virtual std::unique_ptr<Writer> writer(const TopicType&, const Quality&, Listener*) = 0;
    virtual std::unique_ptr<Reader> reader(const TopicType&, const Quality&, Listener*) = 0;
    virtual std::vector<Known>      known() const = 0;
    virtual const Settings&         settings() const noexcept = 0;
};

/// The participant of this process with these settings; it ends with its last owner. Its threads have the policy, priority and affinity
/// of an ordinary thread, whoever calls this.
HAL_EXPORT std::shared_ptr<Participant> open(const Settings&);

/// What the DDS thread of the process looks after.
class Served {
public:
    /// Does what waits. Returns when it wants to be called again, CLOCK_MONOTONIC ns: at once when that is past. [the DDS thread]
    virtual std::int64_t serve(std::int64_t now_ns) noexcept = 0;

protected:
    ~Served() = default;
};

HAL_EXPORT void serve(Served&);  ///< from now on [setup]
HAL_EXPORT void withdraw(Served&) noexcept;  ///< it is not being called, and never will be, when this returns [setup]
}  // namespace hal::dds
