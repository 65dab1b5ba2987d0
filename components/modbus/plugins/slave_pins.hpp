// SPDX-License-Identifier: MIT
// The pins of a slave, and what copies them to and from the image.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/any_pin.hpp"
#include "modbus/master/drive_axis.hpp"
#include "modbus/master/value_codec.hpp"

namespace hal::modbus {

/// The spindle pins of a frequency converter.
struct DrivePins {
    DrivePins(hal::Component& c, const hal::Function& receive, const hal::Function& transmit,
              const std::string& slave)
        : speed_cmd(c, transmit, (slave + ".speed-cmd").c_str(),
                    "commanded speed; negative: reverse", {.unit = "rpm"}),
          run(c, transmit, (slave + ".run").c_str(),
              "rising edge: the drive starts; FALSE: it stops"),
          reset(c, transmit, (slave + ".reset").c_str(), "rising edge: resets a trip of the drive"),
          speed_fb(c, receive, (slave + ".speed-fb").c_str(), "actual speed",
                   {.unit = "rpm", .safe = 0.0}),
          at_speed(c, receive, (slave + ".at-speed").c_str(),
                   "the drive turns with the commanded speed", {.safe = false}),
          running(c, receive, (slave + ".running").c_str(), "the drive runs", {.safe = false}),
          fault(c, receive, (slave + ".fault").c_str(), "the drive has tripped or is offline"),
          load(c, receive, (slave + ".load").c_str(), "load of the drive; 0: not read",
               {.unit = "%"}),
          stalled(c, receive, (slave + ".stalled").c_str(), "commanded to turn, and does not",
                  {.safe = false}) {}

    hal::In<double> speed_cmd;
    hal::In<bool> run, reset;
    hal::Out<double> speed_fb;
    hal::Out<bool> at_speed, running, fault;
    hal::Out<double> load;
    hal::Out<bool> stalled;
};

class SlavePins {
public:
    /// Declares the pins. [setup]
    SlavePins(hal::Component& c, const hal::Function& receive, const hal::Function& transmit,
              const Bus& bus, const Plan& plan, std::size_t index)
        : index_(index),
          online_(c, receive, (name_of(bus, index) + ".online").c_str(), "the slave answers",
                  {.safe = false}),
          age_(c, receive, (name_of(bus, index) + ".age").c_str(),
               "age of its oldest value; -1: one was not read", {.initial = -1.0, .unit = "s"}),
          timeouts_(c, receive, (name_of(bus, index) + ".timeouts").c_str(),
                    "requests without an answer"),
          errors_(c, receive, (name_of(bus, index) + ".errors").c_str(),
                  "answers with a wrong check sequence"),
          exceptions_(c, receive, (name_of(bus, index) + ".exceptions").c_str(),
                      "requests that it rejected"),
          stopped_(c, receive, (name_of(bus, index) + ".stopped").c_str(),
                   "it has acknowledged its stop telegrams") {
        const Slave& slave = bus.slaves[index];
        for (std::uint32_t n = 0; n < plan.values.size(); ++n) {
            const PlannedValue& planned = plan.values[n];
            if (planned.slave != index) continue;
            if (!planned.value->is_output) {
                add_reading(planned.telegram);
            }
            declare(c, receive, transmit, slave.name, planned, n);
        }
        if (slave.drive) {
            drive_ = std::make_unique<DrivePins>(c, receive, transmit, slave.name);
            axis_.emplace(slave.drive->max_speed_rpm, slave.drive->tolerance,
                          slave.drive->stall_ns);
        }
    }

    std::size_t index() const noexcept { return index_; }
    bool is_online() const noexcept { return is_online_; }
    /// Drives start with their next edge of `run` only. [realtime]
    void require_edge() noexcept {
        if (axis_) {
            axis_->require_edge();
        }
    }

    /// Shows what the image has. `changed`: values have arrived. [realtime]
    void show(const Image& image, std::int64_t now_ns, bool is_alive, bool changed) noexcept {
        const SlaveImage& slave = image.slave(index_);
        const bool was_online = is_online_;
        is_online_ = is_alive && slave.online.load(std::memory_order_relaxed) != 0;
        online_ = is_online_;
        stopped_ = slave.stopped.load(std::memory_order_relaxed) != 0;
        timeouts_ = slave.timeouts.load(std::memory_order_relaxed);
        errors_ = slave.errors.load(std::memory_order_relaxed);
        exceptions_ = slave.exceptions.load(std::memory_order_relaxed);
        show_ages(image, now_ns);
        if (!changed && was_online == is_online_) return;
        outputs_.each([&](auto& pin, const OutputData& data) {
            using T = std::remove_cvref_t<decltype(pin.get())>;
            if (!is_online_ && data.has_safe) {
                pin = static_cast<T>(data.safe);
                return;
            }
            if (image.stamp(data.telegram).load(std::memory_order_relaxed) == 0) return;
            pin = from_cell<T>(image.value(data.value).load(std::memory_order_relaxed));
        });
    }

    /// Copies the input pins, and commands the drive. Returns whether an input is not finite.
    /// [realtime]
    bool transmit(const Image& image, std::int64_t now_ns, bool may_run) noexcept {
        bool invalid = false;
        inputs_.each([&](const auto& pin, const std::uint32_t& value) {
            const auto number = pin.get();
            if constexpr (std::is_same_v<std::remove_cvref_t<decltype(number)>, double>) {
                if (!std::isfinite(number)) {
                    invalid = true;
                    return;
                }
            }
            image.value(value).store(to_cell(number), std::memory_order_relaxed);
        });
        if (drive_) {
            invalid = command(image, now_ns, may_run) || invalid;
        }
        return invalid;
    }

    /// Shows what the last command and the values mean. [realtime]
    void show_drive(const Image& image) noexcept {
        if (!drive_) return;
        drive_->speed_fb = is_online_ ? shown_.speed_feedback_rpm : 0.0;
        drive_->at_speed = is_online_ && shown_.at_speed;
        drive_->running = is_online_ && shown_.running;
        drive_->fault = !is_online_ || shown_.fault;
        drive_->stalled = shown_.stalled;
        drive_->load = is_online_ ? number(image, load_) : 0.0;
    }

private:
    struct OutputData {
        std::uint32_t value;
        std::uint32_t telegram;
        bool has_safe;
        double safe;
    };
    struct AgePin {
        std::unique_ptr<hal::Out<double>> pin;
        std::uint32_t telegram;
    };
    static constexpr std::uint32_t no_value = UINT32_MAX;

    static const std::string& name_of(const Bus& bus, std::size_t index) {
        return bus.slaves[index].name;
    }

    template <class T>
    static T from_cell(std::uint64_t cell) noexcept {
        if constexpr (std::is_same_v<T, double>) {
            return std::bit_cast<double>(cell);
        } else if constexpr (std::is_same_v<T, bool>) {
            return cell != 0;
        } else {
            return static_cast<T>(cell);
        }
    }
    template <class T>
    static std::uint64_t to_cell(T value) noexcept {
        if constexpr (std::is_same_v<T, double>) {
            return std::bit_cast<std::uint64_t>(value);
        } else {
            return static_cast<std::uint64_t>(value);
        }
    }

    static hal_type type_of(const Value& v) {
        const bool wide = v.size() > 2;
        switch (pin_form(v)) {
        case PinForm::real: return HAL_TYPE_FLOAT;
        case PinForm::bit: return HAL_TYPE_BIT;
        case PinForm::signed_number: return wide ? HAL_TYPE_S64 : HAL_TYPE_S32;
        case PinForm::unsigned_number: return wide ? HAL_TYPE_U64 : HAL_TYPE_U32;
        }
        return HAL_TYPE_U32;
    }

    void add_reading(std::uint32_t telegram) {
        if (std::find(readings_.begin(), readings_.end(), telegram) == readings_.end()) {
            readings_.push_back(telegram);
        }
    }

    void declare(hal::Component& c, const hal::Function& receive, const hal::Function& transmit,
                 const std::string& slave, const PlannedValue& planned, std::uint32_t n) {
        const Value& v = *planned.value;
        switch (v.purpose) {
        case Purpose::pin: break;
        case Purpose::speed:
            speed_ = n;
            speed_telegram_ = planned.telegram;
            return;
        case Purpose::load: load_ = n; return;
        case Purpose::running: running_ = n; return;
        case Purpose::fault: fault_ = n; return;
        }
        char doc[96];
        std::snprintf(doc, sizeof doc, "%s 0x%04X, %s", to_string(v.table), v.address,
                      bus::to_string(v.type));
        const std::string name = slave + "." + v.name;
        if (v.is_output) {
            inputs_.declare(c, &transmit, type_of(v), name, doc, n, {.unit = v.unit.c_str()});
            return;
        }
        outputs_.declare(c, &receive, type_of(v), name, doc,
                         {n, planned.telegram, v.safe.has_value(), v.safe.value_or(0.0)},
                         {.unit = v.unit.c_str()});
        if (v.has_age) {
            ages_.push_back(
                {std::make_unique<hal::Out<double>>(
                     c, receive, (name + "-age").c_str(), "age of the value; -1: it was not read",
                     hal::PinOptions<double>{.initial = -1.0, .unit = "s"}),
                 planned.telegram});
        }
    }

    static double age_of(const Image& image, std::uint32_t telegram, std::int64_t now_ns) noexcept {
        const std::int64_t stamp = image.stamp(telegram).load(std::memory_order_relaxed);
        return stamp == 0 ? -1.0 : std::max(0.0, static_cast<double>(now_ns - stamp) * 1e-9);
    }
    void show_ages(const Image& image, std::int64_t now_ns) noexcept {
        double oldest = readings_.empty() ? -1.0 : 0.0;
        for (const std::uint32_t telegram : readings_) {
            const double age = age_of(image, telegram, now_ns);
            oldest = age < 0.0 || oldest < 0.0 ? -1.0 : std::max(oldest, age);
        }
        age_ = oldest;
        for (AgePin& age : ages_) {
            *age.pin = age_of(image, age.telegram, now_ns);
        }
    }

    bool command(const Image& image, std::int64_t now_ns, bool may_run) noexcept {
        DriveAxis::Feedback feedback;
        feedback.is_online = is_online_ && may_run;
        feedback.has_speed = speed_ != no_value && image.stamp(speed_telegram_) != 0;
        feedback.speed_rpm = number(image, speed_);
        feedback.has_running = running_ != no_value;
        feedback.is_running = bit(image, running_);
        feedback.is_faulty = bit(image, fault_);
        const DriveAxis::Outputs out =
            axis_->step({drive_->run, drive_->speed_cmd, drive_->reset}, feedback, now_ns);
        SlaveImage& slave = image.slave(index_);
        slave.speed.store(std::bit_cast<std::uint64_t>(out.speed_rpm), std::memory_order_relaxed);
        slave.command.store(out.command, std::memory_order_relaxed);
        shown_ = out;
        return !std::isfinite(drive_->speed_cmd.get());
    }

    static double number(const Image& image, std::uint32_t value) noexcept {
        if (value == no_value) return 0.0;
        return std::bit_cast<double>(image.value(value).load(std::memory_order_relaxed));
    }
    static bool bit(const Image& image, std::uint32_t value) noexcept {
        return value != no_value && image.value(value).load(std::memory_order_relaxed) != 0;
    }

    const std::size_t index_;
    hal::Out<bool> online_;
    hal::Out<double> age_;
    hal::Out<std::uint32_t> timeouts_, errors_, exceptions_;
    hal::Out<bool> stopped_;
    hal::AnyOuts<OutputData> outputs_;
    hal::AnyIns<std::uint32_t> inputs_;
    std::vector<AgePin> ages_;
    std::vector<std::uint32_t> readings_;  // telegrams
    std::unique_ptr<DrivePins> drive_;
    std::optional<DriveAxis> axis_;
    DriveAxis::Outputs shown_;
    std::uint32_t speed_ = no_value;
    std::uint32_t load_ = no_value;
    std::uint32_t running_ = no_value;
    std::uint32_t fault_ = no_value;
    std::uint32_t speed_telegram_ = 0;
    bool is_online_ = false;
};

}  // namespace hal::modbus
