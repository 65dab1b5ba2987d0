// SPDX-License-Identifier: MIT
// LBP16 and HostMot2: any bytes are read as a request, as descriptors and as records, or rejected;
// what was decoded is encoded to the same bytes.
#include <algorithm>
#include <cstdint>
#include <span>

#include "components/mesa/hostmot2/idrom.hpp"
#include "components/mesa/hostmot2/module.hpp"
#include "components/mesa/hostmot2/pin.hpp"
#include "components/mesa/hostmot2/smart_serial.hpp"
#include "components/mesa/lbp16/packet.hpp"
#include "components/mesa/lbp16/spaces.hpp"
#include "tests/fuzz/driver/require.hpp"

namespace {

using namespace hal::mesa;
using hal::fuzz::require;

/// The commands of a request, and the same request made of them.
void read_request(std::span<const std::uint8_t> bytes) {
    RequestReader reader(bytes);
    Command command;
    std::span<const std::uint8_t> data;
    std::size_t length = 0;
    auto next = reader.next(command, data);
    for (; next == RequestReader::Next::command; next = reader.next(command, data)) {
        require(data.size() == (command.is_write ? command.data_size() : 0), "data of a write");
        require(command_of(word_of(command)).count == command.count, "a word is decoded to itself");
        length += command.head_size() + data.size();
        require(length <= bytes.size(), "commands are in the request");
        Request request;
        if (command.is_write) {
            request.write(command.space, command.address, command.unit, data, command.advances);
        } else {
            request.read(command.space, command.address, command.unit, command.count,
                         command.advances);
        }
        require(request.size() <= max_datagram, "a request fits a datagram");
    }
    require(next != RequestReader::Next::end || length == bytes.size(), "the whole request");
    require(reader.next(command, data) != RequestReader::Next::command, "the end stays");
}

template <class T>
void same_again(std::span<const std::uint8_t> bytes) {
    const auto value = T::decode(bytes);
    require(value.has_value() == (bytes.size() >= T::size), "only too few bytes are rejected");
    if (!value) return;
    const auto again = value->encode();
    require(std::equal(again.begin(), again.end(), bytes.begin()),
            "encoding is the inverse of decoding");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span bytes(data, size);
    read_request(bytes);
    same_again<ModuleDescriptor>(bytes);
    if (const auto rom = Idrom::decode(bytes)) {
        fault_of(*rom, usual_idrom_address);
        if (const auto module = ModuleDescriptor::decode(bytes)) {
            if (const ModuleKind* kind = kind_of(module->tag)) {
                fault_of(*module, *kind, *rom);
            }
        }
    }
    if (const auto area = Information::decode(bytes)) {
        require(Information::decode(area->encode()) == area,
                "an information area is decoded to itself");
        require(area->name_text().size() <= 8, "its name is in its field");
    }
    if (size >= 4) {
        const auto word = load<std::uint32_t>(data);
        require(PinDescriptor::decode(word).encode() == word, "a pin is decoded to itself");
        function_of(PinDescriptor::decode(word));
    }
    const auto record = smart_serial::decode_record(bytes);
    if (record) {
        require(smart_serial::encode(*record).size() <= size, "a record is in its bytes");
    }
    const auto mode = smart_serial::decode_mode(bytes);
    require(!record || !mode, "a record is of one kind");
    return 0;
}
