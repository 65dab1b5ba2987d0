// SPDX-License-Identifier: MIT
// Modbus: any configuration is read, or rejected with a position; an accepted one is planned, and a
// master and emulated slaves work with it. Any bytes on the line are decoded or rejected, and both
// survive them.
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "components/modbus/device/slave_bus.hpp"
#include "components/modbus/master/local_master.hpp"
#include "tests/fuzz/driver/require.hpp"

namespace {

using namespace hal::modbus;
using hal::fuzz::require;

/// Any bytes as frames of each kind.
void decode_bytes(std::span<const std::uint8_t> bytes) {
    for (const Framing framing : {Framing::rtu, Framing::tcp}) {
        for (const Role role : {Role::answers, Role::requests}) {
            for (const bool huanyang : {false, true}) {
                Found found;
                if (scan(framing, role, huanyang, bytes, found) != Scan::valid) continue;
                require(found.length <= bytes.size(), "a frame is not longer than its bytes");
                decode(read_request(Function::read_holding, 0, 1), found.pdu, huanyang);
            }
        }
    }
}

/// A master and slaves of the configuration for some time, among the bytes.
void work(const Bus& bus, std::span<const std::uint8_t> bytes) {
    const Plan plan = make_plan(bus);
    load_of(plan, bus, Framing::rtu, 1'000'000);
    std::vector<std::byte> memory(Image::size_of(bus, plan) + 64);
    void* at = memory.data();
    std::size_t space = memory.size();
    const Image image(std::align(64, space - 64, at, space), bus, plan, true);
    LocalMaster master(bus, plan, image, hal::line::open("sim:fuzz-modbus", bus.line).line);
    const auto other = hal::line::open("sim:fuzz-modbus", bus.line);
    const auto noise = hal::line::open("sim:fuzz-modbus", bus.line);
    SlaveBus slaves(bus);
    slaves.attach(*other.line);
    image.header().outputs_valid.store(1);
    std::int64_t now = 1'000'000'000;
    for (int n = 0; n < 60; ++n, now += 3'000'000) {
        master.turn(now, false);
        slaves.work(now);
        if (n % 7 == 3) {
            noise.line->send(bytes.first(std::min<std::size_t>(bytes.size(), 64)), now);
        }
        if (n == 40) {
            image.stop(StopReason::estop);
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span bytes(data, size);
    decode_bytes(bytes);
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const ReadResult result = read(text, "fuzz.modbus");
    for (const auto& message : result.messages) {
        require(message.at.offset + message.at.length <= size + 1, "a message is in the file");
    }
    if (result.good() && result.bus.slaves.size() <= 40) {
        work(result.bus, bytes);
    }
    SlaveFault fault;
    parse_fault(text.substr(0, 100), fault);
    return 0;
}
