// SPDX-License-Identifier: MIT
// The pins of a slave, and what copies them to and from the image.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bus/component/working_set.hpp"
#include "hal/age.hpp"
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
                   "run is TRUE, and the drive turns with the commanded speed", {.safe = false}),
          running(c, receive, (slave + ".running").c_str(), "the drive runs", {.safe = false}),
          fault(c, receive, (slave + ".fault").c_str(),
                "the drive has tripped, is offline or rejects its telegrams"),
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

/// Returns the type of the pin of a value. [setup]
inline hal_type type_of(const Value& v) {
    const bool wide = v.size() > 2;
    switch (pin_form(v)) {
    case PinForm::real: return HAL_TYPE_FLOAT;
    case PinForm::bit: return HAL_TYPE_BIT;
    case PinForm::signed_number: return wide ? HAL_TYPE_S64 : HAL_TYPE_S32;
    case PinForm::unsigned_number: return wide ? HAL_TYPE_U64 : HAL_TYPE_U32;
    }
    return HAL_TYPE_U32;
}

/// The input pins of all slaves: one loop copies them. A value is written to the image when it has
/// changed: a cycle reads no cache line of the image for the others.
class SetPointPins {
public:
    /// The image is a new one: all values are written to it. [setup]
    void rewrite() noexcept {
        pins_.each(
            [](const auto&, SetPoint& set_point) { set_point.state = SetPoint::State::unwritten; });
    }
    /// [setup]
    void declare(hal::Component& c, const hal::Function& transmit, const Value& v,
                 const std::string& name, const char* doc, std::uint32_t value) {
        pins_.declare(c, &transmit, type_of(v), name, doc, {.value = value},
                      {.unit = v.unit.c_str()});
    }
    /// Copies the pins to the image. Returns whether one is not finite: its last value stays.
    /// [realtime]
    bool transmit(const Image& image) noexcept {
        bool invalid = false;
        pins_.each([&](const auto& pin, SetPoint& set_point) {
            const auto number = pin.get();
            const std::uint64_t cell = to_cell(number);
            if (cell != set_point.cell || set_point.state == SetPoint::State::unwritten) {
                set_point.cell = cell;
                const bool is_valid = is_finite(number);
                set_point.state = is_valid ? SetPoint::State::valid : SetPoint::State::invalid;
                if (is_valid) {
                    image.value(set_point.value).store(cell, std::memory_order_relaxed);
                }
            }
            invalid = invalid || set_point.state == SetPoint::State::invalid;
        });
        return invalid;
    }

private:
    template <class T>
    static bool is_finite(T value) noexcept {
        if constexpr (std::is_same_v<T, double>) {
            return std::isfinite(value);
        } else {
            return true;
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

    struct SetPoint {
        enum class State : std::uint32_t { unwritten, valid, invalid };
        std::uint64_t cell = 0;  // of the pin in the cycle before
        std::uint32_t value = 0;
        State state = State::unwritten;
    };

    hal::AnyIns<SetPoint> pins_;
};

/// The pins that change in every cycle, the ages, one behind the other: a cycle reads few cache
/// lines.
class AgePins {
public:
    /// When a value was read, in ns; 0: never.
    struct Stamp {
        std::int64_t ns = 0;
    };
    /// Returns the stamp of the pin, which the owner of the value sets. [setup]
    Stamp& declare(hal::Component& c, const hal::Function& receive, const std::string& name,
                   const char* doc) {
        const hal_value infinite{.real = infinite_age};
        return pins_.declare(c, &receive, HAL_TYPE_FLOAT, name, doc, {},
                             {.unit = "s", .initial = infinite, .safe = infinite});
    }
    /// [realtime]
    void show(std::int64_t now_ns) const noexcept {
        pins_.each([now_ns]<class T>(hal::Out<T>& pin, const Stamp& stamp) {
            if constexpr (std::is_same_v<T, double>) {
                pin = stamp.ns == 0 ? infinite_age : seconds_between(stamp.ns, now_ns);
            }
        });
    }

private:
    static double seconds_between(std::int64_t from_ns, std::int64_t to_ns) noexcept {
        return to_ns > from_ns ? static_cast<double>(to_ns - from_ns) * 1e-9 : 0.0;
    }

    hal::AnyOuts<Stamp> pins_;
};

/// What the slaves of a bus have together.
struct SharedPins {
    SetPointPins& set_points;
    AgePins& ages;
};

class SlavePins {
public:
    /// Declares the pins. [setup]
    SlavePins(hal::Component& c, const hal::Function& receive, const hal::Function& transmit,
              const Bus& bus, const Plan& plan, std::size_t index, SharedPins shared)
        : index_(index),
          age_(shared.ages.declare(
              c, receive, name_of(bus, index) + ".age",
              "age of its oldest value; infinite: one was not read, or the thread is stopped")),
          online_(c, receive, (name_of(bus, index) + ".online").c_str(), "the slave answers",
                  {.safe = false}),
          timeouts_(c, receive, (name_of(bus, index) + ".timeouts").c_str(),
                    "requests without an answer"),
          errors_(c, receive, (name_of(bus, index) + ".errors").c_str(),
                  "answers with a wrong check sequence"),
          exceptions_(c, receive, (name_of(bus, index) + ".exceptions").c_str(),
                      "requests that it rejected"),
          stopped_(c, receive, (name_of(bus, index) + ".stopped").c_str(),
                   "it has acknowledged its stop telegrams") {
        const Slave& slave = bus.slaves[index];
        Lists lists;
        for (std::uint32_t n = 0; n < plan.values.size(); ++n) {
            const PlannedValue& planned = plan.values[n];
            if (planned.slave != index) continue;
            if (!planned.value->is_output) {
                lists.add_reading(planned.telegram);
            }
            declare(c, receive, transmit, slave.name, planned, n, shared, lists);
        }
        for (std::uint32_t n = 0; slave.drive && n < plan.telegrams.size(); ++n) {
            if (plan.telegrams[n].slave == index &&
                plan.telegrams[n].kind == Telegram::Kind::drive) {
                lists.drive_telegrams.push_back(n);
            }
        }
        if (slave.drive) {
            drive_ = std::make_unique<DrivePins>(c, receive, transmit, slave.name);
            axis_.emplace(slave.drive->max_speed_rpm, slave.drive->tolerance,
                          slave.drive->stall_ns);
        }
        readings_ = bus::place_list(lists.readings);
        drive_telegrams_ = bus::place_list(lists.drive_telegrams);
        value_ages_ = bus::place_list(lists.value_ages);
    }

    bool is_online() const noexcept { return is_online_; }
    /// Drives start with their next edge of `run` only. [realtime]
    void require_edge() noexcept {
        if (axis_) {
            axis_->require_edge();
        }
    }

    /// Shows what the image has. [realtime]
    void show(const Image& image, bool is_alive) noexcept {
        show_all(image, image.slave(index_), is_alive);
    }

    /// Commands the drive in the image `to`, by what the cycle has seen in `image`. Returns whether
    /// its speed is not finite. [realtime]
    bool command(const Image& image, const Image& to, std::int64_t now_ns, bool may_run) noexcept {
        DriveAxis::Feedback feedback;
        SlaveImage& slave = to.slave(index_);
        const bool is_stopping =
            image.slave(index_).stop_pending.load(std::memory_order_relaxed) != 0;
        feedback.is_online = is_online_ && may_run && !is_stopping && !rejects_;
        const std::int64_t read_at_ns =
            speed_ == no_value ? 0 : image.value_stamp(speed_).load(std::memory_order_relaxed);
        feedback.has_speed = read_at_ns != 0;
        feedback.is_current = feedback.has_speed && now_ns - read_at_ns <= max_speed_age_ns_;
        feedback.speed_rpm = number(image, speed_);
        feedback.has_running = running_ != no_value;
        feedback.is_running = bit(image, running_);
        feedback.reads_fault = fault_ != no_value;
        feedback.is_faulty = bit(image, fault_);
        const DriveAxis::Outputs out =
            axis_->step({drive_->run, drive_->speed_cmd, drive_->reset}, feedback, now_ns);
        slave.speed.store(std::bit_cast<std::uint64_t>(out.speed_rpm), std::memory_order_relaxed);
        slave.command.store(out.command, std::memory_order_relaxed);
        shown_ = out;
        return !std::isfinite(drive_->speed_cmd.get());
    }

    /// Shows what the last command and the values of a drive mean. [realtime]
    void show_drive(const Image& image) noexcept {
        const bool works = is_online_ && !rejects_;
        drive_->speed_fb = works ? shown_.speed_feedback_rpm : 0.0;
        drive_->at_speed = works && shown_.at_speed;
        drive_->running = works && shown_.running;
        drive_->fault = !works || shown_.fault;
        drive_->stalled = shown_.stalled;
        drive_->load = works ? number(image, load_) : 0.0;
    }

private:
    struct OutputData {
        std::uint32_t value;
        std::uint32_t telegram;
        bool has_safe;
        double safe;
    };
    struct ValueAge {
        AgePins::Stamp* stamp;
        std::uint32_t value;
    };
    /// What the constructor collects.
    struct Lists {
        std::vector<std::uint32_t> readings, drive_telegrams;
        std::vector<ValueAge> value_ages;

        void add_reading(std::uint32_t telegram) {
            if (std::find(readings.begin(), readings.end(), telegram) == readings.end()) {
                readings.push_back(telegram);
            }
        }
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
    void declare(hal::Component& c, const hal::Function& receive, const hal::Function& transmit,
                 const std::string& slave, const PlannedValue& planned, std::uint32_t n,
                 SharedPins shared, Lists& lists) {
        const Value& v = *planned.value;
        if (v.purpose != Purpose::pin) {
            lists.drive_telegrams.push_back(planned.telegram);
        }
        switch (v.purpose) {
        case Purpose::pin: break;
        case Purpose::speed:
            speed_ = n;
            max_speed_age_ns_ = 1'000'000'000 + 3 * v.period_ns;
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
            shared.set_points.declare(c, transmit, v, name, doc, n);
            return;
        }
        outputs_.declare(c, &receive, type_of(v), name, doc,
                         {n, planned.telegram, v.safe.has_value(), v.safe.value_or(0.0)},
                         {.unit = v.unit.c_str()});
        if (v.has_age) {
            lists.value_ages.push_back(
                {&shared.ages.declare(
                     c, receive, name + "-age",
                     "age of the value; infinite: it was not read, or the thread is stopped"),
                 n});
        }
    }

    void show_all(const Image& image, const SlaveImage& slave, bool is_alive) noexcept {
        is_online_ = is_alive && slave.online.load(std::memory_order_relaxed) != 0;
        online_ = is_online_;
        stopped_ = slave.stopped.load(std::memory_order_relaxed) != 0;
        timeouts_ = slave.timeouts.load(std::memory_order_relaxed);
        errors_ = slave.errors.load(std::memory_order_relaxed);
        exceptions_ = slave.exceptions.load(std::memory_order_relaxed);
        outputs_.each([&](auto& pin, const OutputData& data) {
            using T = std::remove_cvref_t<decltype(pin.get())>;
            const bool is_lost =
                !is_online_ || image.rejected(data.telegram).load(std::memory_order_relaxed) != 0;
            if (is_lost && data.has_safe) {
                pin = static_cast<T>(data.safe);
                return;
            }
            if (image.value_stamp(data.value).load(std::memory_order_relaxed) == 0) return;
            pin = from_cell<T>(image.value(data.value).load(std::memory_order_relaxed));
        });
        rejects_ = std::any_of(drive_telegrams_.begin(), drive_telegrams_.end(),
                               [&](std::uint32_t telegram) {
            return image.rejected(telegram).load(std::memory_order_relaxed) != 0;
        });
        age_.ns = oldest_of(image);
        for (const ValueAge& age : value_ages_) {
            age.stamp->ns = image.value_stamp(age.value).load(std::memory_order_relaxed);
        }
    }
    /// Returns the time of the oldest value; 0: one was not read.
    std::int64_t oldest_of(const Image& image) const noexcept {
        std::int64_t oldest_ns = readings_.empty() ? 0 : INT64_MAX;
        for (const std::uint32_t telegram : readings_) {
            oldest_ns = std::min(oldest_ns, image.stamp(telegram).load(std::memory_order_relaxed));
        }
        return oldest_ns;
    }

    static double number(const Image& image, std::uint32_t value) noexcept {
        if (value == no_value) return 0.0;
        return std::bit_cast<double>(image.value(value).load(std::memory_order_relaxed));
    }
    static bool bit(const Image& image, std::uint32_t value) noexcept {
        return value != no_value && image.value(value).load(std::memory_order_relaxed) != 0;
    }

    const std::size_t index_;
    AgePins::Stamp& age_;  // of its oldest value
    std::span<const ValueAge> value_ages_;
    std::unique_ptr<DrivePins> drive_;
    hal::Out<bool> online_;
    hal::Out<std::uint32_t> timeouts_, errors_, exceptions_;
    hal::Out<bool> stopped_;
    hal::AnyOuts<OutputData> outputs_;
    std::span<const std::uint32_t> readings_;  // telegrams
    std::span<const std::uint32_t> drive_telegrams_;
    std::optional<DriveAxis> axis_;
    DriveAxis::Outputs shown_;
    std::uint32_t speed_ = no_value;
    std::uint32_t load_ = no_value;
    std::uint32_t running_ = no_value;
    std::uint32_t fault_ = no_value;
    std::int64_t max_speed_age_ns_ = 0;  // of which `at-speed` is still TRUE
    bool is_online_ = false;
    bool rejects_ = false;  // the telegrams of its drive
};

}  // namespace hal::modbus
