// SPDX-License-Identifier: MIT
// LBP16 and HostMot2: any bytes are read as a request, as descriptors and as records, or rejected;
// what was decoded is encoded to the same bytes. An emulated card executes any requests, and any
// configuration is read, or rejected with a position.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "components/mesa/card/card_server.hpp"
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

/// Counts the replies and what is in them.
struct Inbox final : hal::datagram::Replies {
    void send(std::span<const std::uint8_t> bytes, std::int64_t) noexcept override {
        require(bytes.size() <= hal::datagram::max_size, "a reply fits a datagram");
        size += bytes.size();
    }
    std::size_t size = 0;
};

/// A card executes the request again and again while its time passes.
void serve(const CardConfig& config, std::span<const std::uint8_t> bytes) {
    EmulatedCard card(config, {});
    CardServer server(card);
    Inbox inbox;
    const std::span request = bytes.first(std::min(bytes.size(), max_datagram));
    for (std::int64_t now = 0; now < 5'000'000; now += 1'000'000) {
        server.serve(request, now, inbox);
    }
    require(card.requests() == 5, "each request is counted");
}

/// A configuration, and the request on the card that it describes.
void read_configuration(std::string_view text, std::span<const std::uint8_t> bytes) {
    const CardReadResult result = read_card(text, "fuzz.mesa");
    for (const auto& message : result.messages) {
        require(message.at.offset + message.at.length <= text.size() + 1,
                "a message is in the file");
    }
    if (result.good()) {
        serve(result.card, bytes);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span bytes(data, size);
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    read_request(bytes);
    for (const CardModel& model : card_models()) {
        CardConfig config;
        config.model = &model;
        config.remotes = model.default_remotes;
        serve(config, bytes);
    }
    read_configuration(text, bytes);
    CardFault fault;
    parse_card_fault(text.substr(0, 100), fault);
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
