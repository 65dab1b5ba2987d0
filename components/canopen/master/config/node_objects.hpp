// SPDX-License-Identifier: MIT
// How the objects of a node become pins: OBJECT.scale, .offset, .unit, .type, .bits, .name, .safe.
// [setup]
#pragma once

#include "node_reader.hpp"

namespace hal::canopen::config {

class NodeObjects {
public:
    explicit NodeObjects(const NodeInput& input)
        : in_(input), keys_(input.keys), report_(input.report), node_(input.node) {}
    void read();

private:
    /// An option of an object, and what it applies to.
    struct Option {
        Object* object;
        std::string property;
        const Line* line;
    };
    std::vector<Option> options();
    std::vector<Object*> objects_named(const std::string& name, const Word& word);
    void report_unmapped(const std::string& name, const Line& line);
    void complete();
    void name_feedback();
    void check_pins();

    const NodeInput& in_;
    Keys& keys_;
    Report& report_;
    Node& node_;
};

/// Converts the value of a pin to the bits of its object, limited to the range of the object's
/// type. [setup]
std::uint64_t raw_of(const Object&, double pin_value);

}  // namespace hal::canopen::config
