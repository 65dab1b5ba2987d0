// SPDX-License-Identifier: MIT
// Base of the simulated devices that are HAL components: runs a Node in the cycle of a thread.
#pragma once

#include <deque>
#include <memory>
#include <stdexcept>

#include "hal/component.hpp"
#include "hal/setup_time.hpp"
#include "node.hpp"

namespace hal::canopen {

/// Returns the faults named in `faults=late-sdo,mute`. Throws std::invalid_argument for an unknown
/// name. [setup]
inline std::vector<const FaultRow*> chosen_faults(std::string_view text) {
    std::vector<const FaultRow*> rows;
    while (!text.empty()) {
        const auto name = text.substr(0, text.find(','));
        text.remove_prefix(std::min(name.size() + 1, text.size()));
        Fault fault{};
        FaultSetting setting;
        std::string problem;
        const auto* row = find_fault(name);
        if (row == nullptr) {
            parse_fault(name, fault, setting, problem), throw std::invalid_argument(problem);
        }
        rows.push_back(row);
    }
    return rows;
}

/// Declares the load arguments and pins of every simulated node. A derived class provides
/// program(), and copies values between its pins and the program before and after turn().
class NodeComponent : public hal::Component {
public:
    NodeComponent(const hal_host* host, std::int64_t default_id)
        : Component(host),
          address_(*this, "link", "sim:can0",
                   "bus address, as in sim:arm, can:can0 or udp:239.74.163.2:43113"),
          id_(*this, "id", default_id, "node ID; a list has one per instance",
              {.per_instance = true, .min = 1, .max = 127}),
          serial_(*this, "serial", 1, "serial number in 1018h:4; a list has one per instance",
                  {.per_instance = true, .min = 0, .max = 0xffffffffLL}),
          heartbeat_(*this, "heartbeat", 0, "initial heartbeat period (1017h) in ms; 0: off",
                     {.min = 0, .max = 65535}),
          itself_(*this, "start_by_itself", 0,
                  "1: enter operational after boot-up without a master", {.min = 0, .max = 1}),
          faults_(*this, "faults", "",
                  "faults to create pins for, as in late-sdo,mute; to list them: hal node faults"),
          fault_rows_(chosen_faults(faults_.get())) {
        for (const auto* row : fault_rows_) {
            const std::string name = std::string("fault-") + row->name;
            every_.emplace_back(
                *this, name.c_str(),
                (std::string("0: off; 1: every ") + row->what + "; n: every n-th").c_str());
            if (row->time == 0) continue;
            const std::string doc = std::string("time of the fault ") + row->name;
            const PinOptions<double> usual{.initial = static_cast<double>(row->time) / 1e6,
                                           .unit = "ms"};
            times_.emplace_back(*this, (name + "-ms").c_str(), doc.c_str(), usual);
        }
    }

    hal::In<bool> power{*this, "power", "true: the device is powered", {.initial = true}};
    hal::Out<bool> online{*this, "online", "the device is powered and operational"};
    hal::Out<std::uint32_t> state{
        *this, "state",
        "NMT state: 0 initialising or off, 4 stopped, 5 operational, 127 pre-operational"};
    hal::Out<std::uint32_t> error_register{*this, "error-register", "object 1001h"};
    hal::Out<bool> bus_off{*this, "bus-off", "the CAN controller of the device is bus off"};

    void start() {
        setup_time_.start();
        auto opened = can::open(address_.get());
        if (!opened) throw std::runtime_error(opened.problem);
        node_ = std::make_unique<Node>(
            program(), std::move(opened.link),
            DeviceSettings{.node_id = static_cast<std::uint8_t>(id_), .auto_start = itself_ != 0});
    }
    void stop() noexcept {
        if (node_) {
            setup_time_.expect(node_->link().closing_ns(), can::closing_text);
        }
        node_.reset();
    }

protected:
    /// Returns the program, created by the derived component before its start() ends. [setup]
    virtual Program& program() = 0;

    std::uint32_t serial() const noexcept { return static_cast<std::uint32_t>(serial_); }
    std::uint16_t heartbeat() const noexcept { return static_cast<std::uint16_t>(heartbeat_); }
    Node& node() noexcept { return *node_; }

    /// Runs one cycle of the device. Call it after reading the input pins and before writing the
    /// output pins. [realtime]
    void turn(hal::Cycle cycle) noexcept {
        std::size_t timed = 0;
        for (std::size_t n = 0; n < fault_rows_.size(); ++n) {
            FaultSetting setting{.every = every_[n]};
            if (fault_rows_[n]->time != 0) {
                const double ms = times_[timed++];
                setting.time = ms > 0.0 && ms < 1e9 ? static_cast<Time>(ms * 1e6) : 0;
            }
            const auto& now = node_->faults().setting(fault_rows_[n]->fault);
            if (now.every != setting.every || now.time != setting.time) {
                node_->faults().set(fault_rows_[n]->fault, setting);
            }
        }
        node_->power(power);
        node_->turn(cycle.start_ns());
        const auto& device = node_->device();
        const bool on = node_->powered();
        online = on && device.state() == NmtState::operational;
        state = on ? static_cast<std::uint32_t>(device.state()) : 0U;
        error_register = on ? std::uint32_t{node_->device().emcy().error_register()} : 0U;
        bus_off = node_->link().state() == can::State::bus_off;
    }

private:
    hal::TextArgument address_;
    hal::Argument id_, serial_, heartbeat_, itself_;
    hal::TextArgument faults_;
    const std::vector<const FaultRow*> fault_rows_;
    std::deque<hal::In<std::uint32_t>> every_;
    std::deque<hal::In<double>> times_;  // of the faults that have a time, in their order
    std::unique_ptr<Node> node_;
    hal::SetupTime setup_time_;
};

}  // namespace hal::canopen
