// SPDX-License-Identifier: MIT
#include "cia301/abort.hpp"

namespace hal::cia301 {

namespace {

struct AbortRow {
    Abort code;
    const char* text;
};
constexpr AbortRow abort_rows[] = {
    {Abort::none, "no error"},
    {Abort::toggle, "toggle bit not alternated"},
    {Abort::timeout, "SDO protocol timed out"},
    {Abort::command, "command specifier not valid or unknown"},
    {Abort::block_size, "invalid block size"},
    {Abort::sequence, "invalid sequence number"},
    {Abort::crc, "CRC error"},
    {Abort::memory, "out of memory"},
    {Abort::access, "unsupported access to an object"},
    {Abort::write_only, "attempt to read a write-only object"},
    {Abort::read_only, "attempt to write a read-only object"},
    {Abort::sub0_not_zero, "sub-index 0 must be 0 before other entries are written"},
    {Abort::no_complete_access, "complete access is not supported"},
    {Abort::too_long_for_mailbox, "object is longer than the mailbox"},
    {Abort::mapped, "object is mapped to a PDO, download denied"},
    {Abort::no_object, "object does not exist in the object dictionary"},
    {Abort::not_mappable, "object cannot be mapped to a PDO"},
    {Abort::pdo_length,
     "number and length of the objects to be mapped would exceed the PDO length"},
    {Abort::incompatible, "general parameter incompatibility"},
    {Abort::internal_incompatible, "general internal incompatibility in the device"},
    {Abort::hardware, "access failed due to a hardware error"},
    {Abort::length, "data type does not match, length of service parameter does not match"},
    {Abort::too_long, "data type does not match, length of service parameter too high"},
    {Abort::too_short, "data type does not match, length of service parameter too low"},
    {Abort::no_sub, "sub-index does not exist"},
    {Abort::value, "invalid value for the parameter"},
    {Abort::too_high, "value of the parameter written too high"},
    {Abort::too_low, "value of the parameter written too low"},
    {Abort::range_reversed, "maximum value is less than minimum value"},
    {Abort::no_resource, "resource not available: SDO connection"},
    {Abort::general, "general error"},
    {Abort::cannot_store, "data cannot be transferred or stored to the application"},
    {Abort::local_control, "data cannot be transferred or stored because of local control"},
    {Abort::device_state,
     "data cannot be transferred or stored because of the present device state"},
    {Abort::no_dictionary, "no object dictionary is present, or it could not be generated"},
    {Abort::no_data, "no data available"},
};

}  // namespace

const char* to_string(Abort code) noexcept {
    for (const auto& row : abort_rows) {
        if (row.code == code) return row.text;
    }
    return "unknown abort code";
}

}  // namespace hal::cia301
