// SPDX-License-Identifier: MIT
// What a user writes to make a CANopen device: which objects it has, and what it does.
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
// A Node (node.hpp) runs it on a link. Events tells it of SYNC, states and errors, Handler of values that are read and written.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/protocol/device.hpp"

namespace hal::canopen {

class Program : public Events, public Handler {
public:
    /// All its objects. Asked once, before the device is made. [setup]
    virtual Description description() const = 0;
    /// The device is made and not started: the place for Dictionary::bind(), watch() and pointers to entries. [setup]
    virtual void attach(Device& device) { device_ = &device; }
    /// Makes the device; another form is for a program that has something which holds one. [setup]
    virtual Device& make(const DeviceSettings& settings) {
        own_ = std::make_unique<Device>(description(), settings, *this);
        return *own_;
    }
    /// Power comes on for the first time. [realtime]
    virtual void boot(Time now) noexcept { device_->start(now); }
    /// Once per turn, after the frames that came were taken and before what is due is sent. [realtime]
    virtual void step(Time now) noexcept { (void)now; }

    /// The world around the device, by name: "in-3", "fx". False: there is no such thing. Between two turns, from their thread. [any]
    virtual bool set(std::string_view name, double value) { return (void)name, (void)value, false; }
    /// The names set() knows. [setup]
    virtual std::vector<std::string> settable() const { return {}; }
    /// One line on what the device is doing, for people; empty: nothing to say. [any, not real time]
    virtual std::string summary() const { return {}; }
    /// The part of it whose changes are worth a line each. [any, not real time]
    virtual std::string news() const { return summary(); }

    /// Operational. [realtime]
    bool online() const noexcept { return device_ != nullptr && device_->state() == NmtState::operational; }

protected:
    /// reading(), writing() and written() are called for that object. [setup]
    void watch(std::uint16_t index) { device_->dictionary().handle(index, *this); }
    Device* device_ = nullptr;

private:
    std::unique_ptr<Device> own_;
};

/// The identity of the devices of this project; none of them has a vendor-ID given by CiA.
inline constexpr std::uint32_t example_vendor = 0x48414c;

/// Objects 1010h and 1011h, all sub-indices, and 1020h, which tells whether what was stored is what the master wants. [setup]
void add_storage(Description&);

}  // namespace hal::canopen
