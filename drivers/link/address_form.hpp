// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string_view>

namespace hal::link {

/// What an address leads to.
enum class Reach {
    bus,      ///< a bus that every program on this machine can open
    process,  ///< something in the memory of the process that opens it
    file      ///< a recording
};

/// How the addresses of a driver are written: for messages, help texts and tables.
struct AddressForm {
    std::string_view example;  ///< an address, as in can:can0
    std::string_view purpose;  ///< what it opens, as in "an interface of this machine"
    Reach reach = Reach::bus;
};

/// The form of a driver in a table of forms; a driver that is not in it does not compile.
template <std::size_t size>
consteval AddressForm form_of(const AddressForm (&forms)[size], std::string_view driver) {
    for (const AddressForm& form : forms) {
        if (form.example.substr(0, form.example.find(':')) == driver) return form;
    }
    throw "the driver is missing in the table of address forms";
}

}  // namespace hal::link

namespace hal::can {

/// How the addresses of CAN buses are written.
inline constexpr link::AddressForm address_forms[] = {
    {"can:can0", "an interface of this machine"},
    {"sim:NAME", "a bus in memory", link::Reach::process},
    {"udp:239.74.163.2:43113", "a bus in UDP datagrams"},
    {"slcan:/dev/ttyACM0", "an adapter on a serial line"},
    {"cane:enp3s0", "CAN in Ethernet frames"},
    {"scocan:NODE", "the slots of a node", link::Reach::process},
    {"replay:FILE", "a recorded bus", link::Reach::file},
};

}  // namespace hal::can

namespace hal::ethernet {

/// How the addresses of Ethernet segments are written.
inline constexpr link::AddressForm address_forms[] = {
    {"eth:enp3s0", "an interface of this machine"},
    {"sim:NAME", "a segment in memory", link::Reach::process},
    {"udp:HOST", "UDP datagrams"},
    {"replay:FILE", "a recorded segment", link::Reach::file},
};

}  // namespace hal::ethernet

namespace hal::line {

/// How the addresses of lines of bytes are written.
inline constexpr link::AddressForm address_forms[] = {
    {"serial:/dev/ttyUSB0", "a serial line of this machine"},
    {"pty:PATH", "a pseudo terminal that others open by PATH"},
    {"tcp:HOST:PORT", "a connection to a TCP port"},
    {"listen:PORT", "a TCP port for one connection"},
    {"sim:NAME", "a line in memory", link::Reach::process},
};

}  // namespace hal::line

namespace hal::datagram {

/// How the addresses of devices that answer datagrams are written.
inline constexpr link::AddressForm address_forms[] = {
    {"eth:10.10.10.10", "a card on the network"},
    {"sim:NAME", "a card in memory", link::Reach::process},
};

}  // namespace hal::datagram
