// SPDX-License-Identifier: MIT
// A master and emulated slaves on a line in memory, on a time that the test moves.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "modbus/device/slave_bus.hpp"
#include "modbus/master/event_texts.hpp"
#include "modbus/master/local_master.hpp"

namespace hal::modbus::test {

constexpr std::int64_t us = 1'000;
constexpr std::int64_t ms = 1'000 * us;
constexpr std::int64_t second = 1'000 * ms;

/// Everything on one line. `text` is the configuration of the master; the slaves have the same one,
/// or `other`.
class World {
public:
    /// `wrap` makes another line of that of the master.
    explicit World(
        const std::string& text, const std::string& other = {},
        const std::function<std::unique_ptr<line::Line>(std::unique_ptr<line::Line>)>& wrap = {})
        : config_(read(text, "test.modbus")),
          slaves_config_(read(other.empty() ? text : other, "test.modbus")),
          plan_(make_plan(config_.bus)) {
        EXPECT_TRUE(config_.good()) << text::errors_text(config_.messages, "test.modbus");
        EXPECT_TRUE(slaves_config_.good());
        static int number = 0;
        const std::string address = "sim:world-" + std::to_string(++number);
        memory_.resize(Image::size_of(config_.bus, plan_) + 64);
        void* at = memory_.data();
        std::size_t space = memory_.size();
        image = Image(std::align(64, space - 64, at, space), config_.bus, plan_, true);
        auto line = line::open(address, config_.bus.line);
        EXPECT_TRUE(line) << line.problem;
        if (wrap) {
            line.line = wrap(std::move(line.line));
        }
        master_ = std::make_unique<LocalMaster>(config_.bus, plan_, image, std::move(line.line));
        other_end_ = line::open(address, config_.bus.line).line;
        slaves = std::make_unique<SlaveBus>(slaves_config_.bus);
        slaves->attach(*other_end_);
        slaves->set_thinking(0);
        image.header().outputs_valid.store(1);
    }

    /// Moves on in steps of 50 us.
    void run(std::int64_t duration) {
        for (const std::int64_t end = now + duration; now < end; now += 50 * us) {
            master_->turn(now, false);
            slaves->work(now);
        }
    }

    const Bus& bus() const { return config_.bus; }
    const Plan& plan() const { return plan_; }
    /// The index of a value in the image.
    std::size_t value(const std::string& name, std::uint8_t unit = 1) const {
        for (std::size_t n = 0; n < plan_.values.size(); ++n) {
            const PlannedValue& one = plan_.values[n];
            if (one.value->name == name && config_.bus.slaves[one.slave].unit == unit) return n;
        }
        ADD_FAILURE() << "no value " << name;
        return 0;
    }
    double real(const std::string& name) const {
        return std::bit_cast<double>(image.value(value(name)).load());
    }
    std::uint64_t number(const std::string& name, std::uint8_t unit = 1) const {
        return image.value(value(name, unit)).load();
    }

    /// Returns the lines of all events since the last call.
    std::vector<std::string> lines() const {
        const EventTexts texts(config_.bus, plan_);
        std::vector<std::string> all;
        for (EventRecord record; image.pop(record);) {
            all.push_back(texts.line(record));
        }
        return all;
    }

    std::int64_t now = second;
    Image image;
    std::unique_ptr<SlaveBus> slaves;

private:
    ReadResult config_, slaves_config_;
    Plan plan_;
    std::vector<std::byte> memory_;
    std::unique_ptr<LocalMaster> master_;
    std::unique_ptr<line::Line> other_end_;
};

}  // namespace hal::modbus::test
