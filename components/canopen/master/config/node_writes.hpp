// SPDX-License-Identifier: MIT
// What is written to a node before it starts: `write` and `command` lines, the values of a DCF, and
// the SYNC settings of the bus. [setup]
#pragma once

#include "node_reader.hpp"

namespace hal::canopen::config {

class NodeWrites {
public:
    NodeWrites(const NodeInput& input, Descriptions& descriptions)
        : keys_(input.keys),
          report_(input.report),
          bus_(input.bus),
          node_(input.node),
          in_(input),
          descriptions_(descriptions) {}
    void read();

private:
    void share_sync_settings();
    bool dcf_fits(const Word& file);
    void values_of_dcf();
    void download_files(const Word& file);
    void download(const Word& file, std::uint16_t index, const eds::Entry& entry,
                  std::string about);
    void write_one(Line& line);
    void encode(const Line& line, const ObjectAddress& object, Type type, std::string about,
                bool always);

    Keys& keys_;
    Report& report_;
    const MasterConfig& bus_;
    Node& node_;
    const NodeInput& in_;
    Descriptions& descriptions_;
};

}  // namespace hal::canopen::config
