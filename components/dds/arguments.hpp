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
#include "schema.hpp"
#include "words.hpp"

namespace hal::dds {

/// Of the participant: who may meet. A member before the pins.
class ParticipantArguments {
public:
    explicit ParticipantArguments(hal::Component& c)
        : texts_(c),
          domain_(c, "domain", 0, "DDS domain", {.min = 0, .max = 232}),
          interfaces_(c, "interfaces", "", "addresses or names of interfaces, or all; without it nothing leaves this machine"),
          peers_(c, "peers", "", "addresses where others are looked for, besides multicast"),
          server_(c, "server", "", "discovery servers ADDRESS:PORT instead of multicast"),
          shared_memory_(c, "shared_memory", 0, "1: between processes of this machine too", {.min = 0, .max = 1}),
          profile_(c, "profile", "",
                   "participant profile of Fast DDS: FILE.xml:NAME; those of writers and readers named like the topic count where no "
                   "argument says"),
          security_(c, "security", "", "folder of certificates and permissions, as ROS 2's enclaves have it") {}

    /// In the component's constructor: files are looked for beside the netlist. [setup]
    Settings settings() const {
        Settings s;
        s.domain = static_cast<int>(domain_);
        s.name = "halcyon";
        s.interfaces = list_of(interfaces_.get());
        s.peers = list_of(peers_.get());
        s.servers = list_of(server_.get());
        s.shared_memory = shared_memory_ != 0;
        s.profile = profile_.get();
        if (const auto colon = s.profile.rfind(':'); colon != s.profile.npos)
            s.profile = texts_.find(s.profile.substr(0, colon)) + s.profile.substr(colon);
        else if (!s.profile.empty()) s.profile = texts_.find(s.profile);
        if (!security_.get().empty()) s.security = texts_.find(security_.get());
        return s;
    }
    /// False: the declarations are looked at, nobody loads this. [setup]
    bool loading() const { return texts_.offered(); }

private:
    hal::Texts        texts_;
    hal::Argument     domain_;
    hal::TextArgument interfaces_, peers_, server_;
    hal::Argument     shared_memory_;
    hal::TextArgument profile_, security_;
};

/// A member before the pins.
class Arguments {
public:
    explicit Arguments(hal::Component& c)
        : name(name_of(c)),

          topic_(c, "topic", "", "name of the topic; ROS 2's /arm/state is topic=/arm/state with ros=", {.per_instance = true}),
          fields_(c, "fields", "", "the group: NAME:TYPE, separated by commas, NAME:TYPE*N for a row; types bit float s32 u32 s64 u64"),
          type_(c, "type", "", "name of the type on the wire; without it one is made of the fields"),
          ros_(c, "ros", "",
               "instead of fields: a type of ROS 2, std_msgs/Float64 Bool Int32 UInt32 Int64 UInt64, geometry_msgs/Twist "
               "WrenchStamped, sensor_msgs/JointState Image"),
          joints_(c, "joints", "", "names of a JointState's joints"),
          frame_(c, "frame", "", "frame_id of a ROS header"),
          encoding_(c, "encoding", "bgr8", "of an Image"),
          reliable_(c, "reliable", 1, "1: what is lost is sent again; 0: best effort", {.min = 0, .max = 1}),
          depth_(c, "depth", 16, "samples kept for those who have not got them yet", {.min = 1, .max = 100'000}),
          deadline_(c, "deadline_ms", 0, "a sample at least so often: promised by publishers, asked for by subscribers; 0: none",
                    {.min = 0, .max = longest_ms}),
          budget_(c, "latency_ms", 0, "latency budget: a hint for the engine", {.min = 0, .max = longest_ms}),
          lease_(c, "lease_ms", 0, "liveliness: a publisher not heard of for so long counts as dead; 0: as its participant, 5000",
                 {.min = 0, .max = longest_ms}),
          participant(c) {}

    /// Throws hal::ArgumentError. [setup]
    Schema schema() const {
        if (!participant.loading() && fields_.get().empty() && ros_.get().empty()) return Schema::of_fields("value:float");
        if (topic_.get().empty()) throw std::invalid_argument("which topic? write topic=NAME");
        for (const auto& [argument, text] : {std::pair{"topic", &topic_.get()}, std::pair{"type", &type_.get()}})
            if (text->size() > longest_name)
                throw hal::ArgumentError(argument, std::string(argument) + "= has more than " + std::to_string(longest_name) +
                                            " letters; make it shorter");
        if (!ros_.get().empty() && (!fields_.get().empty() || !type_.get().empty()))
            throw hal::ArgumentError("ros", "ros= gives the fields and the type; leave fields= and type= out");
        if (ros_.get().empty() && fields_.get().empty())
            throw std::invalid_argument("which pins? write fields=angle:float,ready:bit or ros=std_msgs/Float64");
        return ros_.get().empty() ? Schema::of_fields(fields_.get(), type_.get())
                                  : Schema::of_ros(ros_.get(), list_of(joints_.get()), frame_.get(), encoding_.get());
    }
    TopicType topic(const Schema& schema) const {
        std::string wire = topic_.get();
        if (!schema.prefix.empty()) wire = schema.prefix + wire.substr(std::min(wire.find_first_not_of('/'), wire.size()));
        return {wire, schema.type,
                schema.ros == "sensor_msgs/JointState" || schema.ros == "sensor_msgs/Image" ? 65'536 : schema.sample.size()};
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
    std::int64_t       deadline_ms() const noexcept { return deadline_; }
    std::int64_t       depth() const noexcept { return depth_; }
    const std::string& said_topic() const noexcept { return topic_.get(); }
    /// A line on standard error, never in a cycle.
    void say(const std::string& sentence) const { log_.print(sentence); }
    /// Prints what say() only counted; several times a second. Never in a cycle.
    void flush_log() const { log_.flush(); }

    const std::string name;  ///< of the instance

private:
    mutable hal::MessageLog log_{name};

    static constexpr std::size_t  longest_name = 250;  // 255 in DDS, of which ROS 2 takes some
    static constexpr std::int64_t longest_ms = 86'400'000;

    static std::string name_of(hal::Component&) {
        const auto* naming = hal::extension<hal_naming>(HAL_NAMING);
        return naming != nullptr ? naming->name(hal::detail::creating) : "dds";
    }
    hal::TextArgument topic_, fields_, type_, ros_, joints_, frame_, encoding_;
    hal::Argument     reliable_, depth_, deadline_, budget_, lease_;

public:
    const ParticipantArguments participant;
};

}  // namespace hal::dds
