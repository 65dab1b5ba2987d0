// SPDX-License-Identifier: MIT
// A card that is nothing but memory: registers keep what is written to them. Tests of a driver
// change what it answers.
#pragma once

#include <array>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

#include "link/datagram.hpp"
#include "mesa/hostmot2/module_kinds.hpp"
#include "mesa/hostmot2/pin.hpp"
#include "mesa/lbp16/packet.hpp"
#include "mesa/lbp16/spaces.hpp"

namespace hal::mesa::test {

class RegisterCard final : public datagram::Server {
public:
    /// A 7I76E with an I/O port, a watchdog and three step generators.
    RegisterCard() {
        text(Space::card, card::name, "7I76E-16");
        put(Space::card, card::lbp_version, std::uint16_t{3});
        put(Space::hostmot2, cookie_address, hostmot2_cookie);
        text(Space::hostmot2, firmware_name_address, firmware_name);
        put(Space::hostmot2, idrom_offset_address, std::uint32_t{usual_idrom_address});
        idrom.ports = 3;
        idrom.port_width = 17;
        idrom.width = 51;
        modules = {module_descriptor(Tag::ioport, 0x1000, {.instances = 3}),
                   module_descriptor(Tag::watchdog, 0x0c00),
                   module_descriptor(Tag::stepgen, 0x2000, {.instances = 3, .version = 2})};
        store_tables();
    }

    /// Stores `idrom` and `modules`.
    void store_tables() {
        const auto head = idrom.encode();
        std::memcpy(at(Space::hostmot2, usual_idrom_address), head.data(), head.size());
        std::size_t address = usual_idrom_address + idrom.modules;
        for (const ModuleDescriptor& module : modules) {
            const auto bytes = module.encode();
            std::memcpy(at(Space::hostmot2, address), bytes.data(), bytes.size());
            address += bytes.size();
        }
        std::memset(at(Space::hostmot2, address), 0, ModuleDescriptor::size);
        for (std::size_t n = 0; n < idrom.width; ++n) {
            put(Space::hostmot2, usual_idrom_address + idrom.pins + 4 * n,
                PinDescriptor{}.encode());
        }
    }
    void put_pin(std::size_t pin, const PinDescriptor& descriptor) {
        put(Space::hostmot2, usual_idrom_address + idrom.pins + 4 * pin, descriptor.encode());
    }
    template <class T>
    void put(Space space, std::size_t address, T value) {
        store(at(space, address), value);
    }
    template <class T = std::uint32_t>
    T get(Space space, std::size_t address) {
        return load<T>(at(space, address));
    }
    void text(Space space, std::size_t address, std::string_view value) {
        std::memcpy(at(space, address), value.data(), value.size());
    }

    void serve(std::span<const std::uint8_t> request, std::int64_t now_ns,
               datagram::Replies& replies) noexcept override {
        ++requests;
        if (drops_requests > 0) {
            --drops_requests;
            return;
        }
        std::vector<std::uint8_t> reply;
        RequestReader reader(request);
        Command command;
        std::span<const std::uint8_t> data;
        while (reader.next(command, data) == RequestReader::Next::command) {
            std::uint8_t* const place = at(command.space, command.address);
            if (command.is_write) {
                std::memcpy(place, data.data(), data.size());
            } else {
                reply.insert(reply.end(), place, place + command.data_size());
            }
        }
        const auto count = get<std::uint16_t>(Space::status, status::received_packets);
        put(Space::status, status::received_packets, static_cast<std::uint16_t>(count + 1));
        if (drops_replies > 0) {
            --drops_replies;
            return;
        }
        for (int n = 0; n < copies; ++n) {
            replies.send(reply, now_ns == datagram::unclocked ? 0 : now_ns + delay_ns);
        }
    }

    Idrom idrom;
    std::vector<ModuleDescriptor> modules;
    int requests = 0;
    int drops_requests = 0;
    int drops_replies = 0;
    int copies = 1;
    std::int64_t delay_ns = 0;

private:
    std::uint8_t* at(Space space, std::size_t address) {
        return memory_[static_cast<std::size_t>(space)].data() + (address & 0xffff);
    }
    std::array<std::vector<std::uint8_t>, 8> memory_ = [] {
        std::array<std::vector<std::uint8_t>, 8> memory;
        for (auto& space : memory) {
            space.resize(0x10000 + max_datagram);
        }
        return memory;
    }();
};

}  // namespace hal::mesa::test
