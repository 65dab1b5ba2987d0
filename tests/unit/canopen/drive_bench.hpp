// SPDX-License-Identifier: MIT
// A drive on a test bench: objects are written as an SDO writes them, time is a number, one step is
// 1 ms.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "bus.hpp"
#include "canopen/device/drive/drive.hpp"

namespace hal::canopen::test {

using namespace cia402;

struct DriveBench : testing::Test {
    Recorder events;
    DriveSettings settings;
    std::unique_ptr<Drive> drive;
    std::vector<Frame> sent;
    Time now = 0;

    void make() {
        drive = std::make_unique<Drive>(settings, DeviceSettings{.node_id = 5}, &events);
        drive->start(now);
        run(1);
    }
    Device& device() { return drive->device(); }
    void run(int ms) {
        for (int n = 0; n < ms; ++n) {
            now += millisecond;
            drive->step(now);
            device().poll(now);
            for (Frame f; device().out().pop(f);) {
                sent.push_back(f);
            }
        }
    }
    /// Steps until it is so; false when it is not within the time.
    template <class F>
    bool until(F&& so, int ms = 10000) {
        for (int n = 0; n < ms; ++n) {
            if (so()) return true;
            run(1);
        }
        return so();
    }
    Abort write(std::uint16_t index, std::uint8_t sub, std::int64_t value, unsigned axis = 0) {
        index = of_axis(index, axis);
        const auto* e = device().dictionary().find(index, sub);
        if (e == nullptr) return Abort::no_object;
        std::uint8_t bytes[8];
        store(bytes, value);
        return device().dictionary().write(index, sub, {bytes, e->size});
    }
    /// One that has to be accepted.
    void set(std::uint16_t index, std::int64_t value, unsigned axis = 0, std::uint8_t sub = 0) {
        EXPECT_EQ(write(index, sub, value, axis), Abort::none) << std::hex << index << ' ' << value;
    }
    template <class T>
    T get(std::uint16_t index, unsigned axis = 0, std::uint8_t sub = 0) {
        return device().dictionary().get<T>(of_axis(index, axis), sub);
    }
    std::uint16_t word(unsigned axis = 0) { return get<std::uint16_t>(object::statusword, axis); }
    State state(unsigned axis = 0) { return state_of(word(axis)); }
    bool bit(std::uint16_t mask, unsigned axis = 0) { return (word(axis) & mask) != 0; }
    std::int32_t position(unsigned axis = 0) {
        return get<std::int32_t>(object::position_actual, axis);
    }
    std::int32_t velocity(unsigned axis = 0) {
        return get<std::int32_t>(object::velocity_actual, axis);
    }
    void control(std::uint16_t value, unsigned axis = 0) {
        set(object::controlword, value, axis);
        run(1);
    }
    void set_mode(Mode mode, unsigned axis = 0) {
        set(object::modes_of_operation, static_cast<int>(mode), axis);
    }
    void enable(Mode mode, unsigned axis = 0) {
        set_mode(mode, axis);
        control(command::shutdown, axis);
        control(command::switch_on, axis);
        control(command::enable_operation, axis);
        ASSERT_EQ(state(axis), State::operation_enabled) << cia402::to_string(state(axis));
    }
    std::vector<Emergency> emergencies() {
        std::vector<Emergency> result;
        for (const auto& f : sent) {
            if (f.id == 0x85) {
                result.push_back(EmcyConsumer::read(f, 0));
            }
        }
        return result;
    }
};

inline std::ostream& operator<<(std::ostream& out, Abort abort) {
    return out << canopen::to_string(abort);
}

}  // namespace hal::canopen::test

namespace hal::cia402 {
inline std::ostream& operator<<(std::ostream& out, State state) { return out << to_string(state); }
inline std::ostream& operator<<(std::ostream& out, Homing homing) {
    return out << to_string(homing);
}
}  // namespace hal::cia402
