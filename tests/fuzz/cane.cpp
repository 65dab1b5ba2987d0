// SPDX-License-Identifier: MIT
// Frames of type 0x9023, as anybody on the segment can send them: the decoders as it comes, and
// again with the header made right.
#include <algorithm>

#include "drivers/can/cane/cane_format.hpp"
#include "drivers/can/cane/cane_stations.hpp"
#include "tests/fuzz/driver/require.hpp"

using namespace hal::can;
using namespace hal::can::cane;

namespace {

using hal::fuzz::require;

void unpack(std::span<const std::uint8_t> whole, Nodes& nodes, Streams& streams) {
    Unpacker u;
    if (u.open(whole) != Wrong::none) return;
    hal::ethernet::Address from{};
    std::copy_n(whole.begin() + 6, 6, from.begin());
    streams.take(from, (whole[0] & 1) != 0, u.stamp(),
                 static_cast<std::int64_t>(whole.size()) * 100'000'000);
    Frame f;
    unsigned count = 0;
    for (; u.next(f); ++count) {
        require(f.valid() && !f.fd && !f.error, "a message is a frame of classic CAN");
        nodes.learn(f.id, from, static_cast<std::int64_t>(count) * 300'000'000);
        nodes.where(f.id, true);
        std::array<std::uint8_t, max_message_size> again{};
        require(put_packed(f, again) != 0, "what was read can be written");
    }
    require(count == u.messages(), "the header's number of messages is read");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span<const std::uint8_t> bytes(data, size);
    for (const auto order : {Order::big, Order::little}) {
        Frame f;
        if (get_single(bytes, order, f) != Wrong::none) continue;
        require(f.valid(), "a frame that was read is valid");
        std::array<std::uint8_t, single_bytes + 8> again{};
        const auto length = put_single(f, order, again);
        require(
            length != 0 && std::equal(again.begin(),
                                      again.begin() + static_cast<std::ptrdiff_t>(length), data),
            "it is written as it was read");
    }
    Nodes nodes;
    Streams streams;
    unpack(bytes, nodes, streams);
    if (size < hal::ethernet::header_bytes + packed_header || size > hal::ethernet::max_frame) {
        return 0;
    }
    std::array<std::uint8_t, hal::ethernet::max_frame> buffer{};
    const auto whole = std::span(buffer).first(size);
    std::copy(bytes.begin(), bytes.end(), whole.begin());
    const auto messages = whole[hal::ethernet::header_bytes + 2];
    close_packed(whole, messages,
                 {static_cast<std::uint16_t>(size % 5), static_cast<std::uint16_t>(size % 7)});
    unpack(whole, nodes, streams);
    return 0;
}
