// SPDX-License-Identifier: MIT
// The names of what a journal has in an MCAP file beside the values of a recording.
#pragma once

#include <string_view>

namespace hal::journal_format {

inline constexpr std::string_view version = "2";
/// name of the metadata record: format, version, commit, program, unix_offset_ns
inline constexpr std::string_view head = "halcyon-journal";
inline constexpr std::string_view entries_topic = "/hal/journal/entries";
/// the thread's number follows
inline constexpr std::string_view cycles_topic = "/hal/journal/cycles/";
inline constexpr std::string_view entry_schema =
    R"({"type":"object","properties":{"kind":{"type":"string"}},"required":["kind"]})";
/// What setup calls got, and the files that they read: SetupRecord, as CDR.
inline constexpr std::string_view setup_topic = "/hal/journal/setup";
inline constexpr std::string_view setup_type = "halcyon_msgs/msg/JournaledSetup";
inline constexpr std::string_view setup_schema =
    "uint32 kind\nuint32 error\nuint8[] name\nuint8[] hash\nuint8[] results\nuint8[] readings\n";
/// The state of the machine where a journal begins that was cut: JournalBegin, as CDR.
inline constexpr std::string_view state_topic = "/hal/journal/state";
inline constexpr std::string_view state_type = "halcyon_msgs/msg/JournaledState";
inline constexpr std::string_view state_schema = "uint8[] begin\n";
/// A batch of records of CycleEncoder, as CDR.
inline constexpr std::string_view cycles_type = "halcyon_msgs/msg/JournaledCycles";
inline constexpr std::string_view cycles_schema = "uint32 count\nuint8[] records\n";

}  // namespace hal::journal_format
