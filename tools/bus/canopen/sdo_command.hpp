// SPDX-License-Identifier: MIT
// `hal can sdo`: reads or writes objects of a node by their types.
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct SdoOptions : Options {
    std::string eds;   ///< names and types of the objects
    std::string type;  ///< empty: not given
    bool block = false;
    bool segmented = false;
    std::int64_t timeout_ns = 0;  ///< of one response; 0: not given

protected:
    void declare_transfer(OptionSet& set) {
        declare_eds(set, eds);
        set.value("--type", type, "TYPE",
                  "type of the value: u8 … u64, i8 … i64, r32, r64, bool, visible_string, "
                  "octet_string, domain");
        set.flag("--block", block, "use block transfer, if the node supports it");
        set.flag("--segmented", segmented, "do not use block transfer");
        declare_timeout(set, timeout_ns);
    }
};

struct SdoReadOptions : SdoOptions {
    std::string output;  ///< a file for the bytes; empty: not given
    bool json = false;

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE OBJECT",
                  "the bus; node ID 1..127; objects: INDEX:SUB in hex (6041, 1018:1) or names of "
                  "the EDS");
        declare_transfer(set);
        set.value("-o,--output", output, "FILE", "write the raw bytes to this file");
        set.flag("--json", json, "print JSON, a line per object");
    }
};

struct SdoWriteOptions : SdoOptions {
    std::string input;  ///< --from FILE

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE OBJECT VALUE",
                  "the bus; node ID 1..127; INDEX:SUB in hex or a name of the EDS; a number, 0x…, "
                  "text, or hex bytes");
        declare_transfer(set);
        set.value("--from", input, "FILE", "write the bytes of this file instead of a value");
    }
};

/// `hal can sdo read`. Returns the exit code.
int run_can_sdo_read(const SdoReadOptions&);

/// `hal can sdo write`. Returns the exit code.
int run_can_sdo_write(const SdoWriteOptions&);

}  // namespace hal::tools
