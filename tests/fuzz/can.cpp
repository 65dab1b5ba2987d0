// SPDX-License-Identifier: MIT
// What comes to the CAN drivers from outside: datagrams, lines of a serial adapter, captures. The
// first byte chooses. What was understood is a valid frame, and is understood again after it was
// written.
#include <cstdint>
#include <string_view>

#include "drivers/can/slcan/slcan_line.hpp"
#include "drivers/can/udp/datagram.hpp"
#include "drivers/link/capture.hpp"
#include "tests/fuzz/driver/require.hpp"

using namespace hal::can;

namespace {

using hal::fuzz::require;

void check(const Frame& f) {
    require(f.error || f.valid(), "a frame that was read is valid");
    require(f.bytes().size() <= 64, "its data is bounded");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
    Frame f, again;
    if (data[0] % 3 == 0) {
        if (!canudp::decode({data + 1, size - 1}, f)) return 0;
        check(f);
        canudp::Datagram out;
        const auto written = canudp::encode(f, 0, out);
        require(canudp::decode({out.data(), written}, again) && again.same(f),
                "a datagram survives the way back");
    } else if (data[0] % 3 == 1) {
        slcan::Decoder decoder;
        for (const char c : text) {
            if (decoder.take(c) != slcan::Decoder::Found::frame) continue;
            check(decoder.frame());
            slcan::Line out;
            const auto written = slcan::encode(decoder.frame(), out);
            slcan::Decoder second;
            auto found = slcan::Decoder::Found::nothing;
            for (std::size_t i = 0; i < written; ++i) {
                found = second.take(out[i]);
            }
            require(found == slcan::Decoder::Found::frame && second.frame().same(decoder.frame()),
                    "a line survives the way back");
        }
    } else {
        for (const auto& frame : parse_capture(text).frames) {
            check(frame);
            const bool back = frame.error ||
                              (parse_log_line(log_line(frame, "can0"), again) && again.same(frame));
            require(back, "a log line survives the way back");
        }
    }
    return 0;
}
