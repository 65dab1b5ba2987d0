// SPDX-License-Identifier: MIT
// The interface for writing a CANopen device: its objects and its behaviour.
//
//     struct Lamp : hal::canopen::Program {
//         Description description() const override {
//             Description d = basic_device({.device_type = 0x191, .vendor = 1, .product = 7, .name = "lamp"});
//             d.add(0x2000, 0, Type::unsigned8, Access::read_write, 0, "Brightness").received();
//             add_rpdo(d, 1, {.mapping = {map_entry(0x2000, 0, 8)}});
//             return d;
//         }
//         void attach(Device& d) override { Program::attach(d), d.dictionary().bind(0x2000, 0, brightness); }
//         void step(Time) noexcept override { lamp.set(online() ? brightness : 0); }
//         std::uint8_t brightness = 0;
//     };
//
// A Node (node.hpp) runs it on a link. DeviceEvents notifies it of SYNC, states and errors, Handler
// of values that are read and written.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/protocol/device.hpp"

namespace hal::canopen {

/// The application of a device. All functions are called by the thread that turns the Node, except
/// where noted.
class Program : public DeviceEvents, public Handler {
public:
    /// Returns all objects of the device. Called once, before the device is created. [setup]
    virtual Description description() const = 0;
    /// Binds variables and entries of the object dictionary: Dictionary::bind(), watch(). Called
    /// after the device is created and before it starts; an override calls this one first. [setup]
    virtual void attach(Device& device) { device_ = &device; }
    /// Creates the device. Override it in a program that owns a Device through another class.
    /// [setup]
    virtual Device& make(const DeviceSettings& settings) {
        own_ = std::make_unique<Device>(description(), settings, *this);
        return *own_;
    }
    /// Handles the first power-on, with the time in ns. [realtime]
    virtual void boot(Time now) noexcept { device_->start(now); }
    /// Advances the application to `now` (ns). Called once per turn, after received frames are
    /// handled and before frames are sent. [realtime]
    virtual void step(Time now) noexcept { (void)now; }
    /// Handles the loss of the supply. [realtime]
    virtual void lose_power() noexcept {}
    /// Lets time pass without supply, for what moves by itself. [realtime]
    virtual void rest(Time now) noexcept { (void)now; }

    /// Sets a value of the simulated environment by name, such as "in-3" or "fx". Returns false for
    /// an unknown name. Call it between turns, from the thread that turns the node. [any]
    virtual bool set(std::string_view name, double value) { return (void)name, (void)value, false; }
    /// Returns the names set() accepts. [setup]
    virtual std::vector<std::string> settable() const { return {}; }
    /// Returns one line on what the device is doing, for a person to read; may be empty. [any, not
    /// real time]
    virtual std::string summary() const { return {}; }
    /// Returns the part of summary() whose changes are worth a log line each. [any, not real time]
    virtual std::string news() const { return summary(); }

    /// Returns true in the NMT state operational. [realtime]
    bool online() const noexcept {
        return device_ != nullptr && device_->state() == NmtState::operational;
    }

protected:
    /// Subscribes to reading(), writing() and written() of all sub-indices of `index`. [setup]
    void watch(std::uint16_t index) { device_->dictionary().handle(index, *this); }
    Device* device_ = nullptr;

private:
    std::unique_ptr<Device> own_;
};

/// Vendor ID of the devices of this project; it is not assigned by CiA.
inline constexpr std::uint32_t example_vendor = 0x48414c;

/// Adds objects 1010h and 1011h with all sub-indices and 1020h, by which a master verifies the
/// stored configuration (CiA 301). [setup]
void add_storage(Description&);

}  // namespace hal::canopen
