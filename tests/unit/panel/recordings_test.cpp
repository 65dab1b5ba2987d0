// SPDX-License-Identifier: MIT
#include "panel/recordings.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <unistd.h>

namespace hal::tools {
namespace {

TEST(Recordings, advises_what_hal_panel_needs_for_a_file_with_too_many_values) {
    const std::string path = testing::TempDir() + "large" + std::to_string(::getpid()) + ".csv";
    std::ofstream file(path);
    file << "time_s,x,y\n";
    for (int row = 0; row <= 1 << 16; ++row) {
        file << row << ",1,2\n";
    }
    file.close();
    Recordings recordings(1 << 20);
    EXPECT_EQ(recordings.add(path).problem,
              "'" + path +
                  "' has more than 1 MiB of values; record fewer values or a shorter time; of a "
                  "journal, choose values with: hal replay --exact JOURNAL --record FILE --names "
                  "NAMES");
    EXPECT_TRUE(recordings.names().empty());
    std::filesystem::remove(path);
}

}  // namespace
}  // namespace hal::tools
