// SPDX-License-Identifier: MIT
// Configurations of CANopen networks: any file is read, or rejected with a position, and what was
// read can be used.
#include <cstdint>
#include <string>
#include <string_view>

#include "components/canopen/master/config/bus_schedule.hpp"
#include "components/canopen/master/cycle/master_node.hpp"
#include "tests/fuzz/driver/require.hpp"

namespace {

using hal::fuzz::require;

constexpr std::string_view description = R"([DeviceInfo]
VendorNumber=1
[MandatoryObjects]
SupportedObjects=1
1=0x1000
[1000]
ParameterName=Device type
DataType=0x0007
AccessType=ro
[ManufacturerObjects]
SupportedObjects=1
1=0x2000
[2000]
ParameterName=Value
DataType=0x0003
AccessType=rww
PDOMapping=1
)";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace hal::canopen;
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const auto file = [](const std::string&, std::string& bytes) {
        bytes = description;
        return true;
    };
    const config::ReadResult reading = config::read(text, "folder/net.canopen", file);
    for (const config::Message& m : reading.messages) {
        require(m.at.offset + std::size_t{m.at.length} <= size, "a place lies in the text");
        require(!m.sentence.empty(), "a message is not empty");
    }
    if (!reading.good()) return 0;
    std::size_t pdos = 0;
    for (const config::Node& n : reading.config.nodes) {
        pdos += n.pdos.size();
        for (const config::Pdo& p : n.pdos) {
            require((p.multiplexed() || p.bits() <= 64) && p.cob != 0,
                    "a PDO fits into a frame and has an identifier");
        }
    }
    require(problems_of(reading.config.setup()).empty(), "a master can be made of it");
    const OwnNode own = own_node(reading.config);
    require(own.sent.size() + own.received.size() <= pdos, "a PDO of ours for each of a node");
    if (reading.config.nodes.size() + reading.config.foreign.size() < 40) {
        config::schedule_of(reading.config, millisecond);
    }
    return 0;
}
