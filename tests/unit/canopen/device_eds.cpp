// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <map>

#include "canopen/device/bootloader/bootloader.hpp"
#include "canopen/device/drive/drive_program.hpp"
#include "canopen/device/eds_export.hpp"
#include "canopen/device/io/io.hpp"
#include "canopen/device/sensor/jr3.hpp"
#include "canopen/eds/eds_dictionary.hpp"

namespace hal::canopen::test {
namespace {

/// Returns all entries of a description by key; writing and reading the file must not change them.
std::map<std::uint32_t, EntryDescription> all_of(const Description& d) {
    std::map<std::uint32_t, EntryDescription> entries;
    for (const auto& e : d.entries) {
        entries.emplace(std::uint32_t{e.index} << 8 | e.sub, e);
    }
    return entries;
}

void comes_back(const Program& program) {
    const auto ours = program.description();
    auto eds = eds_of(ours);
    eds.file.file_name = "device.eds";
    eds.device.vendor_name = "Halcyon";
    eds.file.creation_date = eds.file.modification_date = "01-31-2026";
    eds.file.creation_time = eds.file.modification_time = "10:00AM";
    const auto reading = eds::read_eds(eds::write_eds(eds));
    ASSERT_TRUE(reading.description);
    for (const auto& message : reading.messages) {
        ADD_FAILURE() << to_string(message);
    }
    EXPECT_TRUE(*reading.description == eds);
    const auto there = all_of(ours);
    const auto back = all_of(eds::dictionary_of(*reading.description));
    ASSERT_EQ(there.size(), back.size());
    for (const auto& [key, e] : there) {
        ASSERT_TRUE(back.contains(key)) << std::hex << key;
        const auto& b = back.at(key);
        EXPECT_EQ(b.type, e.type) << std::hex << key;
        EXPECT_EQ(b.access, e.access) << std::hex << key;
        EXPECT_EQ(b.rpdo, e.rpdo) << std::hex << key;
        EXPECT_EQ(b.tpdo, e.tpdo) << std::hex << key;
        EXPECT_EQ(b.plus_node_id, e.plus_node_id) << std::hex << key;
        EXPECT_EQ(b.ranged, e.ranged) << std::hex << key;
        EXPECT_EQ(b.low, e.low) << std::hex << key;
        EXPECT_EQ(b.high, e.high) << std::hex << key;
        if (e.type != Type::domain) {
            EXPECT_EQ(b.value, e.value) << std::hex << key;
        }
    }
}

TEST(DeviceEds, of_an_IO_node_reads_back_as_the_device) { comes_back(Io(IoSettings{})); }
TEST(DeviceEds, of_a_force_torque_node_reads_back_as_the_device) { comes_back(Jr3(Jr3Settings{})); }
TEST(DeviceEds, of_a_bootloader_reads_back_as_the_device) {
    comes_back(Bootloader(BootloaderSettings{}));
}
TEST(DeviceEds, of_drives_reads_back_as_the_device) {
    for (const unsigned axes : {1U, 8U}) {
        DriveSettings settings;
        settings.axes = axes;
        comes_back(DriveProgram(settings));
    }
}

TEST(DeviceEds, names_objects_as_their_documents_do) {
    const auto d = Io(IoSettings{}).description();
    EXPECT_EQ(object_name(d, 0x1018), "Identity object");
    EXPECT_EQ(object_name(d, 0x1a02), "TPDO mapping parameter 3");
    EXPECT_EQ(object_name(d, 0x6411), "Write analogue output 16-bit");
    EXPECT_EQ(object_name(d, 0x2abc), "Object 2ABCh");
    DriveSettings settings;
    settings.axes = 2;
    EXPECT_EQ(object_name(DriveProgram(settings).description(), 0x6899), "Homing speeds 2");
}

}  // namespace
}  // namespace hal::canopen::test
