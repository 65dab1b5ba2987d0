// SPDX-License-Identifier: MIT
// Built twice, as two plugins that hide their symbols: each opens a link of its own.
#include <cstdint>
#include <memory>

#include "link/can.hpp"

#define SEEN extern "C" __attribute__((visibility("default")))

namespace {
std::unique_ptr<hal::can::Link> own;
}

SEEN bool bus_user_open(const char* address) {
    own = hal::can::open(address).link;
    return own != nullptr;
}
SEEN void bus_user_send(std::uint32_t id, std::int64_t now_ns) { own->send({id, {1}}, now_ns); }
SEEN std::uint32_t bus_user_receive(std::int64_t now_ns) {
    hal::can::Frame f;
    return own->receive(f, now_ns) ? f.id : 0;
}
SEEN void bus_user_close() { own.reset(); }
