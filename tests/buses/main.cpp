// SPDX-License-Identifier: MIT
// The tests, or `--echo ADDRESS`: sends every frame back with the lowest bit of its identifier
// turned over, until it is killed.
#include <gtest/gtest.h>

#include <cstdio>
#include <string_view>

#include "link/can.hpp"

namespace {

int echo(const char* address) {
    auto opened = hal::can::open(address);
    std::puts(opened ? "open" : opened.problem.c_str());
    std::fflush(stdout);
    if (!opened) return 1;
    auto& link = *opened.link;
    for (hal::can::Frame f;;) {
        if (!link.wait(1'000'000'000)) continue;
        while (link.receive(f, hal::can::unclocked)) {
            f.id ^= 1U;
            link.send(f, hal::can::unclocked);
        }
        link.flush(hal::can::unclocked);
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc == 3 && std::string_view(argv[1]) == "--echo") return echo(argv[2]);
    testing::InitGoogleTest(&argc, argv);
    return RUN_ALL_TESTS();
}
