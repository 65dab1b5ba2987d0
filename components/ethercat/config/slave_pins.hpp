// SPDX-License-Identifier: MIT
// The pins of a slave's process data: their names, and OBJECT.scale, .offset, .unit, .type, .name.
// Everything here is [setup].
#pragma once

#include <set>

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

class SlavePins {
public:
    explicit SlavePins(SlaveInput in) : in_(in) {}
    /// Names the pins and reads the options of the objects.
    void read();

private:
    /// Calls `use(entry)` for each entry with a pin.
    template <class Use>
    void for_each_entry(Use use);
    void name_pins();
    master::Entry* find(const Word& object);
    PinInfo& info_of(const master::Entry& entry);
    void option(const Line& line);

    SlaveInput in_;
    std::set<const master::Entry*> typed_;  // those with a type of their own
};

}  // namespace hal::ethercat::config
