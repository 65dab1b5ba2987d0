// SPDX-License-Identifier: MIT
// Device descriptions of real devices, from the folder that HALCYON_EDS_FOLDER names (they are not
// ours to keep here): all are read, and none changes by being written. What the other tests cannot
// do without is in eds_read.cpp, a test per defect.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "components/canopen/eds/concise_dcf.hpp"
#include "components/canopen/eds/xdd.hpp"
#include "eds_text.hpp"

namespace hal::canopen::eds::test {
namespace {

TEST(EdsCorpus, Files_of_real_devices_are_read_and_come_back_equal) {
    const char* const folder = std::getenv("HALCYON_EDS_FOLDER");
    if (!folder) {
        GTEST_SKIP() << "HALCYON_EDS_FOLDER names no folder of device descriptions";
    }
    ASSERT_TRUE(std::filesystem::is_directory(folder)) << folder;
    std::size_t files = 0;
    std::size_t with_warnings = 0;
    std::size_t warnings = 0;
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
        std::ifstream in(file.path(), std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(in), {}};
        const ReadResult reading = read_description(bytes);
        ASSERT_TRUE(reading.description) << file.path() << "\n" << complaints(reading);
        const DeviceDescription& d = *reading.description;
        const ReadResult again = read_eds(write_eds(d));
        EXPECT_TRUE(again.description && *again.description == d) << file.path();
        EXPECT_GT(d.entries(), 0u) << file.path();
        for (const Message& message : reading.messages) {
            EXPECT_NE(message.at.line, 0u) << file.path() << " " << message.sentence;
        }
        const Configuration configuration = configuration_of(d, 5);
        EXPECT_EQ(parse_concise(concise(configuration.writes)), configuration.writes)
            << file.path();
        ++files;
        warnings += reading.count(Severity::warning);
        with_warnings += reading.count(Severity::warning) != 0;
    }
    EXPECT_GT(files, 0u);
    std::cout << files << " device descriptions read, " << with_warnings
              << " of them with warnings (" << warnings << ", each with its line)\n";
}

}  // namespace
}  // namespace hal::canopen::eds::test
