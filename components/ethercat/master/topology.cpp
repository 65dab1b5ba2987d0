// SPDX-License-Identifier: MIT
#include "ethercat/master/topology.hpp"

#include <array>

namespace hal::ethercat::master {

namespace {

constexpr std::array<unsigned, 4> port_order{0, 3, 1, 2};

/// Returns the port in use after `port` in the order of the frame, counted round; `port` itself if
/// it is the only one.
unsigned next_port(std::uint16_t dl_status, unsigned port) noexcept {
    unsigned position = 0;
    while (port_order[position] != port) {
        ++position;
    }
    for (unsigned n = 1; n <= 4; ++n) {
        if (const unsigned candidate = port_order[(position + n) % 4];
            port_in_use(dl_status, candidate)) {
            return candidate;
        }
    }
    return port;
}

}  // namespace

bool find_tree(std::span<BusSlave* const> line) noexcept {
    bool tree = true;
    // The frame visits the slaves in depth-first order. Each slave continues at the nearest one
    // before it that has a port left.
    for (std::size_t n = 0; n < line.size(); ++n) {
        BusSlave& s = *line[n];
        s.parent = -1;
        s.parent_port = 0;
        s.neighbour.fill(-1);
        s.entry_port = 0;
        if (!port_in_use(s.dl_status, 0)) {  // reached from behind, as on a broken ring
            while (s.entry_port < 3 && !port_in_use(s.dl_status, s.entry_port)) {
                ++s.entry_port;
            }
        }
        if (n == 0) continue;
        bool found = false;
        for (std::size_t p = n; p-- > 0 && !found;) {
            BusSlave& parent = *line[p];
            for (unsigned port = next_port(parent.dl_status, parent.entry_port);
                 port != parent.entry_port; port = next_port(parent.dl_status, port)) {
                if (parent.neighbour[port] >= 0) continue;
                parent.neighbour[port] = s.number;
                s.neighbour[s.entry_port] = parent.number;
                s.parent = parent.number;
                s.parent_port = static_cast<std::uint8_t>(port);
                found = true;
                break;
            }
        }
        tree &= found;
    }
    return tree;
}

void find_delays(std::span<BusSlave* const> line, std::size_t reference) noexcept {
    const auto find = [&](int number) -> BusSlave* {
        for (BusSlave* s : line) {
            if (s->number == number) return s;
        }
        return nullptr;
    };
    // Time a frame spends behind a slave: from the last but one port of the round to the entry
    // port.
    const auto round_trip = [](const BusSlave& s) {
        unsigned last = s.entry_port;
        for (unsigned port = next_port(s.dl_status, s.entry_port); port != s.entry_port;
             port = next_port(s.dl_status, port)) {
            last = port;
        }
        return s.receive_time[last] - s.receive_time[s.entry_port];
    };
    for (std::size_t n = 0; n < line.size(); ++n) {
        BusSlave& s = *line[n];
        s.delay_ns = 0;
        if (n <= reference || !s.has_dc()) continue;
        // The nearest one with a clock above; those without only add to the cable.
        std::uint8_t port = s.parent_port;
        BusSlave* parent = find(s.parent);
        while (parent != nullptr && !parent->has_dc()) {
            port = parent->parent_port;
            parent = find(parent->parent);
        }
        if (parent == nullptr) continue;
        // the port in use before `port` in the order of the frame
        unsigned before = parent->entry_port;
        for (unsigned p = parent->entry_port, next = next_port(parent->dl_status, p);;
             p = next, next = next_port(parent->dl_status, p)) {
            if (next == port || next == parent->entry_port) {
                before = p;
                break;
            }
        }
        const std::uint32_t loop = parent->receive_time[port] - parent->receive_time[before];
        const std::uint32_t earlier =
            parent->receive_time[before] - parent->receive_time[parent->entry_port];
        const auto own = static_cast<std::int32_t>(loop - round_trip(s));
        s.delay_ns = parent->delay_ns + earlier + static_cast<std::uint32_t>(own > 0 ? own / 2 : 0);
    }
}

}  // namespace hal::ethercat::master
