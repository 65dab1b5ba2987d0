// SPDX-License-Identifier: MIT
// Captures of Ethernet: whatever is in them, what is read is frames.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "drivers/link/ethernet_capture.hpp"

using namespace hal::ethernet;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto capture = parse_capture({reinterpret_cast<const char*>(data), size});
    for (const auto& f : capture.frames) {
        if (f.bytes.size() >= header_bytes && f.bytes.size() <= max_frame) continue;
        std::fprintf(stderr, "broken: a frame of %zu bytes\n", f.bytes.size());
        std::abort();
    }
    return 0;
}
