// SPDX-License-Identifier: MIT
#include "setup_link.hpp"

#include "mesa/lbp16/spaces.hpp"

namespace hal::mesa {

std::span<const std::uint8_t> SetupLink::exchange(Request request) {
    // Answers have no number. Consecutive ones differ in their length instead, by a read of 1..8
    // units behind the data, so that a late or duplicate answer is not taken for the next one.
    const std::size_t size = request.reply_size();
    sequence_ = sequence_ % 8 + 1;
    if (!request.read(Space::card, card::name, Unit::u16, sequence_)) {
        throw CardError(address() + ": a request of the driver is too long");
    }
    bool is_sent = false;
    for (int n = 0; n < tries; ++n) {
        while (port_.receive(buffer_, datagram::unclocked) != 0) {
            // left over from a request before
        }
        ++sent_;
        if (!port_.send(request.bytes(), datagram::unclocked)) continue;
        if (receive(request.reply_size())) return std::span(buffer_).first(size);
        is_sent = true;
    }
    std::string text =
        address() + ": no answer from a card (" + std::to_string(tries) + " requests, 20 ms each)";
    const std::string& remark = port_.description().remark;
    if (in_memory() && is_sent) {
        text +=
            "; the emulated card is loaded: set its faults to FALSE, drop-request, drop-reply and "
            "their like, and its loss and delay to 0";
    } else if (in_memory()) {
        text += "; load the emulated card first: loadrt mesa_card link=" + address();
    } else if (!remark.empty()) {
        text += "; " + remark;
    } else {
        text +=
            "; check its power, its cable, its jumpers for the address; to look for cards: hal "
            "mesa scan";
    }
    throw CardError(text);
}

bool SetupLink::receive(std::size_t size) {
    for (int n = 0; n < 8; ++n) {
        std::size_t got = port_.receive(buffer_, datagram::unclocked);
        if (got == 0) {
            if (!port_.wait(timeout_ns)) return false;
            got = port_.receive(buffer_, datagram::unclocked);
        }
        if (got == size) return true;
    }
    return false;
}

std::uint32_t SetupLink::read32(std::uint16_t address) {
    Request request;
    request.read(Space::hostmot2, address, Unit::u32);
    return load<std::uint32_t>(exchange(request).data());
}

void SetupLink::write32(std::uint16_t address, std::uint32_t value) {
    Request request;
    request.write32(address, value);
    exchange(request);
}

std::span<const std::uint8_t> SetupLink::read16(Space space, std::uint16_t address,
                                                std::size_t count) {
    Request request;
    request.read(space, address, Unit::u16, count);
    return exchange(request);
}

}  // namespace hal::mesa
