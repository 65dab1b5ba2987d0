// SPDX-License-Identifier: MIT
#include "node.hpp"

#include <stdexcept>

namespace hal::canopen {

namespace {
// of 64 frames: a flooded bus must not delay a cycle without limit
constexpr unsigned max_batches = 16;
}  // namespace

void add_storage(Description& d) {
    for (const std::uint16_t index : {std::uint16_t{0x1010}, std::uint16_t{0x1011}}) {
        const bool stores = index == 0x1010;
        d.add(index, 0, Type::unsigned8, Access::constant, 4, "Highest sub-index");
        const char* const what[] = {"all parameters", "communication parameters",
                                    "application parameters", "manufacturer parameters"};
        for (std::uint8_t sub = 1; sub <= 4; ++sub) {
            d.add(index, sub, Type::unsigned32, Access::read_write, 1,
                  std::string(stores ? "Save " : "Restore ") + what[sub - 1]);
        }
    }
    d.add(0x1020, 0, Type::unsigned8, Access::constant, 2, "Highest sub-index");
    d.add(0x1020, 1, Type::unsigned32, Access::read_write, 0, "Configuration date");
    d.add(0x1020, 2, Type::unsigned32, Access::read_write, 0, "Configuration time");
}

Node::Node(Program& program, std::unique_ptr<can::Link> link, const DeviceSettings& settings)
    : program_(program),
      device_(program.make(settings)),
      link_(std::move(link)),
      bus_(settings.queue) {
    if (const auto& problems = device_.dictionary().problems(); !problems.empty()) {
        throw std::invalid_argument(problems.front());
    }
    program_.attach(device_);
}

void Node::watch_bus(Time now) noexcept {
    const auto state = link_->state();
    const bool off = state == can::State::bus_off || state == can::State::down;
    // a bus that was down from the start is not an error of this device
    if (!watched_) {
        bus_off_ = off;
        watched_ = true;
    }
    if (off == bus_off_) return;
    bus_off_ = off;
    if (off) {
        device_.bus_off(now);
    } else {
        device_.bus_recovered();
    }
}

void Node::turn(Time now, std::int64_t link_now) noexcept {
    if (powered_ && !runs_) {
        runs_ = true;
        if (!booted_once_) {
            program_.boot(now);
        } else {
            device_.command(NmtCommand::reset_node, now);
        }
        booted_once_ = true;
    } else if (!powered_ && runs_) {
        runs_ = false;
        program_.lose_power();
        device_.out().clear();
        bus_.clear();
    }
    std::size_t count = heard_.size();
    for (unsigned batch = 0; batch < max_batches && count == heard_.size(); ++batch) {
        count = link_->receive(heard_, link_now);
        if (!runs_) continue;
        for (std::size_t n = 0; n < count; ++n) {
            if (!heard_[n].error && !heard_[n].own &&
                !faults_.swallows(heard_[n], device_.node_id(), now)) {
                device_.handle(heard_[n], now);
            }
        }
    }
    if (runs_) {
        watch_bus(now);
        program_.step(now);
        device_.poll(now);
    } else if (booted_once_) {
        program_.rest(now);
    }
    send(now, link_now);
    link_->flush(link_now);
}

void Node::send(Time now, std::int64_t link_now) noexcept {
    const auto emptied = [&](FrameQueue& queue) {
        for (const Frame* f; (f = queue.front()) != nullptr; queue.drop()) {
            if (link_->send(*f, link_now) == can::Sent::full) {
                return false;  // frames for a bus that is off or down are lost
            }
        }
        return true;
    };
    auto& out = device_.out();
    if (faults_.idle() && bus_.size() == 0) return void(emptied(out));
    for (Frame f; bus_.space() > 4 && out.pop(f);) {
        faults_.send(f, device_.node_id(), bus_, now);
    }
    if (faults_.poll(device_.node_id(), bus_, now) && runs_) {
        out.clear();
        device_.command(NmtCommand::reset_node, now);
    }
    emptied(bus_);
}

}  // namespace hal::canopen
