// SPDX-License-Identifier: MIT
// What a program that loads dds_publish, dds_subscribe and node gives them: the names of their
// arguments and pins, which the components declare from here, and the arguments of one instance as
// a struct.
//
//     PublishLink link{{.instance = "node-out", .topic = "halcyon/cell/robot/servo", .type = "…", .fields = {{"speed", "float"}}}, 100};
//     link.arguments("dds_publish")   // loadrt dds_publish names=node-out topic=… type=… fields=speed:float rate=100 reliable=0
//
// All of it is [setup] and allocates.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hal::dds {

/// Names of load arguments.
namespace argument {
inline constexpr const char *topic = "topic", *type = "type", *fields = "fields",
                            *reliable = "reliable", *rate = "rate", *timeout_ms = "timeout_ms",
                            *cell = "cell", *node = "node", *others = "others", *offers = "offers",
                            *wants = "wants";
}  // namespace argument

/// Names of pins that are linked between dds_subscribe and node. Those of node are prefixed by the
/// other node and its thread: `node.robot.servo.heard`.
namespace pin {
inline constexpr const char *valid = "valid", *age_ms = "age-ms", *heard = "heard",
                            *heard_age_ms = "heard-age-ms";
}  // namespace pin

/// A field of a topic.
struct LinkField {
    std::string name, type;
    /// value of a subscriber's pin while the topic is not valid; empty: the pin keeps its value
    std::string safe = {};
};

/// What both ends of a topic are given alike.
struct TopicLink {
    std::string instance, topic, type;
    std::vector<LinkField> fields = {};

    /// Returns `loadrt COMPONENT` and its arguments, a word each. Links are best effort: a newer
    /// sample replaces a lost one.
    std::vector<std::string> arguments(std::string_view component) const {
        std::string list;
        for (const LinkField& f : fields) {
            list += (list.empty() ? "" : ",") + f.name + ":" + f.type +
                    (f.safe.empty() ? "" : "=" + f.safe);
        }
        return {"loadrt",
                std::string(component),
                "names=" + instance,
                word(argument::topic, topic),
                word(argument::type, type),
                word(argument::fields, list),
                word(argument::reliable, "0")};
    }
    static std::string word(const char* name, const std::string& value) {
        return std::string(name) + "=" + value;
    }
};

/// An instance of dds_publish.
struct PublishLink : TopicLink {
    double rate_hz = 0;  ///< samples per second; 0: every cycle

    std::vector<std::string> arguments() const {
        auto words = TopicLink::arguments("dds_publish");
        char shortest[32] = {};
        std::to_chars(shortest, shortest + sizeof shortest - 1, rate_hz);
        words.push_back(word(argument::rate, shortest));
        return words;
    }
};

/// An instance of dds_subscribe.
struct SubscribeLink : TopicLink {
    std::int64_t timeout_ms = 0;  ///< without a sample for longer than this the topic is not valid

    std::vector<std::string> arguments() const {
        auto words = TopicLink::arguments("dds_subscribe");
        words.push_back(word(argument::timeout_ms, std::to_string(timeout_ms)));
        return words;
    }
};

/// The one instance of node.
struct NodeLink {
    std::string cell, node;
    std::vector<std::string> others;  ///< all other nodes
    /// topics sent and taken: NODE/THREAD=SIGNAL:TYPE,...;
    std::string offers, wants;

    std::vector<std::string> arguments() const {
        std::vector<std::string> words{"loadrt", "node", TopicLink::word(argument::cell, cell),
                                       TopicLink::word(argument::node, node)};
        std::string names;
        for (const std::string& other : others) {
            names += (names.empty() ? "" : ",") + other;
        }
        const std::pair<const char*, const std::string*> lists[] = {
            {argument::others, &names}, {argument::offers, &offers}, {argument::wants, &wants}};
        for (const auto& [name, value] : lists) {
            if (!value->empty()) {
                words.push_back(TopicLink::word(name, *value));
            }
        }
        return words;
    }
    /// Returns the name of a pin of a topic ROBOT/THREAD that this node receives, without that of
    /// the component: "robot.servo.heard".
    static std::string heard(const std::string& topic, const char* name) {
        std::string prefix = topic;
        std::replace(prefix.begin(), prefix.end(), '/', '.');
        return prefix + "." + name;
    }
};

}  // namespace hal::dds
