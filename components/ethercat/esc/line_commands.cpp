// SPDX-License-Identifier: MIT
// Faults and power of a line on request of other threads.
#include "ethercat/esc/line.hpp"

namespace hal::ethercat::esc {

bool Line::post(const LineCommand& command) noexcept {
    const std::size_t next = posted_.load(std::memory_order_relaxed);
    if (next - taken_.load(std::memory_order_acquire) == most_commands) return false;
    commands_[next % most_commands] = command;
    posted_.store(next + 1, std::memory_order_release);
    return true;
}

void Line::take_commands(std::int64_t now_ns) noexcept {
    std::size_t next = taken_.load(std::memory_order_relaxed);
    const std::size_t end = posted_.load(std::memory_order_acquire);
    if (next == end) return;
    for (; next != end; ++next) {
        execute(commands_[next % most_commands], now_ns);
    }
    taken_.store(end, std::memory_order_release);
}

void Line::execute(const LineCommand& command, std::int64_t now_ns) noexcept {
    using Kind = LineCommand::Kind;
    if (command.kind == Kind::end_cable) {
        if (command.port < ends_.size()) {
            set_cable(static_cast<End>(command.port), command.on);
        }
        return;
    }
    if (command.kind == Kind::calm) return calm();
    if (command.kind == Kind::disturb) {
        disturb(command.disturbance);
        return;
    }
    if (command.slave >= nodes_.size()) return;
    Controller& c = controller(command.slave);
    switch (command.kind) {
    case Kind::power: return set_power(command.slave, command.on, now_ns);
    case Kind::cable:
        return command.port < ports ? set_cable(command.slave, command.port, command.on) : void();
    case Kind::drift: return c.set_drift(command.value, now_ns);
    case Kind::jump: return c.jump_clock(static_cast<std::int64_t>(command.value), now_ns);
    case Kind::eeprom:
        return c.eeprom().fail(command.value > 0 ? static_cast<unsigned>(command.value) : 0U);
    case Kind::checksum: return c.eeprom().damage(!command.on);
    case Kind::identity: return c.eeprom().falsify(!command.on);
    case Kind::watchdog: return c.expire_watchdog();
    case Kind::end_cable:
    case Kind::calm:
    case Kind::disturb: break;
    }
}

}  // namespace hal::ethercat::esc
