// SPDX-License-Identifier: MIT
// Load arguments that dds_publish and dds_subscribe have in common.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine.hpp"
#include "hal/component.hpp"
#include "hal/message_log.hpp"
#include "hal/naming.hpp"
#include "hal/texts.hpp"
#include "links/links.hpp"
#include "schema.hpp"
#include "status_text.hpp"

namespace hal::dds {

/// The load arguments of a participant: domain, network, security. Declared before the pins.
class ParticipantArguments {
public:
    explicit ParticipantArguments(hal::Component& c)
        : texts_(c),
          domain_(c, "domain", 0, "DDS domain", {.min = 0, .max = 232}),
          interfaces_(c, "interfaces", "",
                      "network interfaces by address or name, or all; default: loopback only"),
          peers_(c, "peers", "",
                 "addresses to search for other participants, in addition to multicast"),
          server_(c, "server", "", "discovery servers ADDRESS:PORT; replaces multicast"),
          shared_memory_(c, "shared_memory", 0,
                         "1: also use shared memory between processes of this machine",
                         {.min = 0, .max = 1}),
          profile_(c, "profile", "",
                   "Fast DDS participant profile, FILE.xml:NAME; writer and reader profiles named "
                   "like the topic supply defaults"),
          security_(c, "security", "", "folder of certificates and permissions (a ROS 2 enclave)") {
    }

    /// Returns the settings, with files resolved relative to the netlist. For the component's
    /// constructor. [setup]
    Settings settings() const {
        Settings s;
        s.domain = static_cast<int>(domain_);
        s.name = "halcyon";
        s.interfaces = list_of(interfaces_.get());
        s.peers = list_of(peers_.get());
        s.servers = list_of(server_.get());
        s.shared_memory = shared_memory_ != 0;
        s.profile = profile_.get();
        if (const auto colon = s.profile.rfind(':'); colon != s.profile.npos) {
            s.profile = texts_.find(s.profile.substr(0, colon)) + s.profile.substr(colon);
        } else if (!s.profile.empty()) {
            s.profile = texts_.find(s.profile);
        }
        if (!security_.get().empty()) {
            s.security = texts_.find(security_.get());
        }
        return s;
    }
    /// Returns false when the component is constructed for its declarations only (`hal doc`).
    /// [setup]
    bool loading() const { return texts_.offered(); }

private:
    hal::Texts texts_;
    hal::Argument domain_;
    hal::TextArgument interfaces_, peers_, server_;
    hal::Argument shared_memory_;
    hal::TextArgument profile_, security_;
};

/// The load arguments that dds_publish and dds_subscribe share. Declared before the pins.
class Arguments {
public:
    explicit Arguments(hal::Component& c)
        : name(name_of(c)),
          topic_(c, argument::topic, "", "topic name; with ros= the ROS 2 topic of this name",
                 {.per_instance = true}),
          fields_(c, argument::fields, "",
                  "fields NAME:TYPE, comma-separated, NAME:TYPE*N for N of them; types bit float "
                  "s32 u32 s64 u64"),
          type_(c, argument::type, "", "type name on the wire; default: derived from the fields"),
          ros_(c, "ros", "",
               "ROS 2 message type instead of fields: std_msgs/Float64 Bool Int32 UInt32 Int64 "
               "UInt64, geometry_msgs/Twist "
               "WrenchStamped, sensor_msgs/JointState Image"),
          joints_(c, "joints", "", "joint names of a JointState"),
          frame_(c, "frame", "", "frame_id of the ROS header"),
          encoding_(c, "encoding", "bgr8", "pixel encoding of an Image"),
          reliable_(c, argument::reliable, 1, "1: lost samples are retransmitted; 0: best effort",
                    {.min = 0, .max = 1}),
          depth_(c, "depth", 16, "samples kept until they are delivered",
                 {.min = 1, .max = 100'000}),
          deadline_(c, "deadline_ms", 0,
                    "DDS deadline, maximum sample interval (ms): offered by publishers, requested "
                    "by subscribers; 0: none",
                    {.min = 0, .max = max_ms}),
          budget_(c, "latency_ms", 0, "DDS latency budget (ms), a hint to the library",
                  {.min = 0, .max = max_ms}),
          lease_(c, "lease_ms", 0,
                 "liveliness lease of the publisher (ms); 0: that of its participant, 5000",
                 {.min = 0, .max = max_ms}),
          participant(c) {}

    /// Returns the type of the topic. Throws hal::ArgumentError or std::invalid_argument. [setup]
    Schema schema() const {
        if (!participant.loading() && fields_.get().empty() && ros_.get().empty()) {
            return Schema::of_fields("value:float");
        }
        if (topic_.get().empty()) {
            throw std::invalid_argument("missing topic name; write topic=NAME");
        }
        for (const auto& [argument, text] :
             {std::pair{"topic", &topic_.get()}, std::pair{"type", &type_.get()}}) {
            if (text->size() > longest_name) {
                throw hal::ArgumentError(
                    argument, std::string(argument) + "= has " + std::to_string(text->size()) +
                                  " characters (limit " + std::to_string(longest_name) + ")");
            }
        }
        if (!ros_.get().empty() && (!fields_.get().empty() || !type_.get().empty())) {
            throw hal::ArgumentError("ros",
                                     "ros= cannot be combined with fields= or type=; remove them");
        }
        if (ros_.get().empty() && fields_.get().empty()) {
            throw std::invalid_argument(
                "missing fields; write fields=angle:float,ready:bit or ros=std_msgs/Float64");
        }
        return ros_.get().empty() ? Schema::of_fields(fields_.get(), type_.get())
                                  : Schema::of_ros(ros_.get(), list_of(joints_.get()), frame_.get(),
                                                   encoding_.get());
    }
    TopicType topic(const Schema& schema) const {
        std::string wire = topic_.get();
        std::string shown = wire;
        if (!schema.prefix.empty()) {
            const std::string plain =
                wire.substr(std::min(wire.find_first_not_of('/'), wire.size()));
            wire = schema.prefix + plain;
            shown = "/" + plain;
        }
        return {wire, schema.type,
                schema.ros == "sensor_msgs/JointState" || schema.ros == "sensor_msgs/Image"
                    ? 65'536
                    : schema.sample.size(),
                shown};
    }
    Quality quality() const {
        constexpr std::int64_t ms = 1'000'000;
        return {.reliable = reliable_ != 0,
                .last_value = false,
                .depth = static_cast<int>(depth_),
                .deadline_ns = deadline_ * ms,
                .latency_budget_ns = budget_ * ms,
                .lease_ns = lease_ * ms};
    }
    std::int64_t deadline_ms() const noexcept { return deadline_; }
    std::int64_t depth() const noexcept { return depth_; }
    /// Prints a line on standard error. Never in a cycle.
    void log(const std::string& sentence) const { log_.print(sentence); }
    /// Prints the repetitions that log() only counted; called several times a second. Never in a
    /// cycle.
    void flush_log() const { log_.flush(); }

    const std::string name;  ///< of the instance

private:
    mutable hal::MessageLog log_{name};

    static constexpr std::size_t longest_name = 250;  // 255 in DDS, of which ROS 2 takes some
    static constexpr std::int64_t max_ms = 86'400'000;

    static std::string name_of(hal::Component&) {
        const auto* naming = hal::extension<hal_naming>(HAL_NAMING);
        return naming != nullptr ? naming->name(hal::detail::creating) : "dds";
    }
    hal::TextArgument topic_, fields_, type_, ros_, joints_, frame_, encoding_;
    hal::Argument reliable_, depth_, deadline_, budget_, lease_;

public:
    const ParticipantArguments participant;
};

}  // namespace hal::dds
