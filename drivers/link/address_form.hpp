// SPDX-License-Identifier: MIT
#pragma once

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

}  // namespace hal::link
