// SPDX-License-Identifier: MIT
// Devices on smart serial: ports, their state, and the values of the devices.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "command_pin.hpp"
#include "hal/limit.hpp"
#include "mesa/driver/position_counter.hpp"
#include "mesa/driver/remote.hpp"
#include "module_pins.hpp"
#include "scale_param.hpp"

namespace hal::mesa {

/// One field of the process data of a device as pins.
class RemoteFieldPins {
public:
    RemoteFieldPins(const PinOwner& o, const std::string& device, const RemoteField& field,
                    bool is_output)
        : field_(field) {
        using smart_serial::RecordType;
        const std::string name = device + "." + field.record.name;
        switch (field.record.type) {
        case RecordType::bits: declare_bits(o, name, is_output); return;
        case RecordType::boolean: declare_bit(o, name, is_output); return;
        case RecordType::unsigned_number:
        case RecordType::signed_number:
        case RecordType::float_number: declare_number(o, name, is_output); return;
        case RecordType::encoder: declare_encoder(o, name, is_output); return;
        default: return;  // padding, and what has no pin in LinuxCNC either
        }
    }

    /// [realtime] read
    void receive(std::span<const std::uint32_t> words, bool is_after_gap) noexcept {
        const std::uint64_t raw = take(words);
        for (std::size_t n = 0; n < bits_out_.size(); ++n) {
            const bool level = (raw >> n & 1U) != 0;
            *bits_out_[n] = level;
            *bits_not_[n] = !level;
        }
        if (number_out_) {
            show_number(number(raw));
        }
        if (count_) {
            receive_encoder(raw, is_after_gap);
        }
    }
    /// [realtime] write
    void transmit(std::span<std::uint32_t> words, bool is_on) const noexcept {
        std::uint64_t raw = 0;
        for (std::size_t n = 0; is_on && n < bits_in_.size(); ++n) {
            const bool is_inverted = n < inverts_.size() && *inverts_[n];
            raw |= *bits_in_[n] != is_inverted ? std::uint64_t{1} << n : 0;
        }
        if (number_in_) {
            raw = number_raw(is_on);
        }
        if (field_.record.bits != 0) {
            smart_serial::put_bits(words, field_.bit, field_.record.bits, raw);
        }
    }

private:
    using Record = smart_serial::Record;

    void declare_bits(const PinOwner& o, const std::string& name, bool is_output) {
        for (unsigned n = 0; n < field_.record.bits; ++n) {
            char number[8];
            std::snprintf(number, sizeof number, "-%02u", n);
            add_bit(o, name + number, is_output);
        }
    }
    void declare_bit(const PinOwner& o, const std::string& name, bool is_output) {
        add_bit(o, name, is_output);
    }
    void add_bit(const PinOwner& o, const std::string& name, bool is_output) {
        if (is_output) {
            bits_in_.push_back(
                place<hal::In<bool>>(o.component, o.write, name.c_str(), "output of the device"));
            inverts_.push_back(place<hal::Param<bool>>(o.component, (name + "-invert").c_str(),
                                                       "TRUE: the output is inverted"));
            return;
        }
        bits_out_.push_back(
            place<hal::Out<bool>>(o.component, o.read, name.c_str(), "input of the device"));
        bits_not_.push_back(place<hal::Out<bool>>(o.component, o.read, (name + "-not").c_str(),
                                                  "input of the device, inverted"));
    }
    void declare_number(const PinOwner& o, const std::string& name, bool is_output) {
        const Record& r = field_.record;
        const bool has_range = r.min != r.max;
        const double max = has_range ? r.max : 1.0;
        const double min = has_range ? r.min : 0.0;
        scale_max_ = place<ScaleParam>(o.component, (name + "-scalemax").c_str(),
                                       "value of the largest number",
                                       hal::PinOptions<double>{.initial = max});
        if (!is_output) {
            number_out_ = place<hal::Out<double>>(
                o.component, o.read, name.c_str(), "input of the device",
                hal::PinOptions<double>{.unit = field_.record.unit.c_str()});
            return;
        }
        number_in_ = place<CommandPin>(o, name.c_str(), "output of the device", "the output is 0",
                                       hal::PinOptions<double>{.unit = field_.record.unit.c_str()});
        max_limit_ =
            place<hal::LimitParam>(o.component, (name + "-maxlim").c_str(), "largest value",
                                   hal::PinOptions<double>{.initial = max});
        min_limit_ =
            place<hal::LimitParam>(o.component, (name + "-minlim").c_str(), "smallest value",
                                   hal::PinOptions<double>{.initial = min});
    }
    void declare_encoder(const PinOwner& o, const std::string& name, bool is_output) {
        if (is_output) return;
        count_ = place<hal::Out<std::int32_t>>(o.component, o.read, (name + ".count").c_str(),
                                               "counts since the last reset");
        raw_count_ = place<hal::Out<std::int32_t>>(
            o.component, o.read, (name + ".rawcounts").c_str(), "counts since the start");
        position_ = place<hal::Out<double>>(o.component, o.read, (name + ".position").c_str(),
                                            "position, count / scale");
        reset_ = place<hal::In<bool>>(o.component, o.read, (name + ".reset").c_str(),
                                      "TRUE: count and position are 0");
        scale_ = place<ScaleParam>(o.component, (name + ".scale").c_str(), "counts per unit",
                                   hal::PinOptions<double>{.initial = 1.0});
    }

    std::uint64_t take(std::span<const std::uint32_t> words) const noexcept {
        if (field_.record.bits == 0) return 0;
        return smart_serial::take_bits(words, field_.bit, field_.record.bits);
    }
    bool is_signed() const noexcept {
        return field_.record.type == smart_serial::RecordType::signed_number;
    }
    bool is_float() const noexcept {
        return field_.record.type == smart_serial::RecordType::float_number &&
               field_.record.bits == 32;
    }
    /// The raw value at scalemax.
    double full_scale() const noexcept {
        const int bits = field_.record.bits - (is_signed() ? 1 : 0);
        return bits > 0 ? std::ldexp(1.0, std::min(bits, 63)) - 1.0 : 1.0;
    }
    double number(std::uint64_t raw) const noexcept {
        if (is_float()) return std::bit_cast<float>(static_cast<std::uint32_t>(raw));
        if (!is_signed()) return static_cast<double>(raw) * *scale_max_ / full_scale();
        const unsigned unused = 64U - field_.record.bits;
        const auto value = static_cast<std::int64_t>(raw << unused) >> unused;
        return static_cast<double>(value) * *scale_max_ / full_scale();
    }
    /// A device may send NaN; it is not shown.
    void show_number(double value) noexcept {
        if (std::isfinite(value)) {
            *number_out_ = value;
        }
    }
    std::uint64_t number_raw(bool is_on) const noexcept {
        if (!is_on) {
            number_in_->ignore();
            return 0;
        }
        const std::optional<double> value = number_in_->valid();
        return value ? raw_of(*value) : 0;
    }
    std::uint64_t raw_of(double value) const noexcept {
        const double low = std::min(min_limit_->get(), max_limit_->get());
        const double high = std::max(min_limit_->get(), max_limit_->get());
        const double limited = std::clamp(value, low, high);
        if (is_float()) return std::bit_cast<std::uint32_t>(static_cast<float>(limited));
        const double scale = *scale_max_;
        const double bottom = is_signed() ? -full_scale() : 0.0;
        // downwards, as LinuxCNC's driver does: 50 of 100 is 7Fh in 8 bits
        const double raw =
            std::trunc(std::clamp(limited / scale * full_scale(), bottom, full_scale()));
        return is_signed() ? static_cast<std::uint64_t>(static_cast<std::int64_t>(raw))
                           : static_cast<std::uint64_t>(raw);
    }
    void receive_encoder(std::uint64_t raw, bool is_after_gap) noexcept {
        const unsigned unused = 32U - std::min<unsigned>(field_.record.bits, 32);
        const auto value = static_cast<std::int32_t>(static_cast<std::uint32_t>(raw) << unused);
        if (is_after_gap) {
            counter_.rebase(value);
        }
        const std::int64_t position = counter_.update(value) >> unused;
        if (*reset_) {
            zero_ = position;
        }
        const double scale = *scale_;
        *raw_count_ = static_cast<std::int32_t>(position);
        *count_ = static_cast<std::int32_t>(position - zero_);
        *position_ = static_cast<double>(position - zero_) / scale;
    }

    const RemoteField field_;
    std::vector<Placed<hal::In<bool>>> bits_in_;
    std::vector<Placed<hal::Param<bool>>> inverts_;
    std::vector<Placed<hal::Out<bool>>> bits_out_, bits_not_;
    Placed<CommandPin> number_in_;
    Placed<hal::Out<double>> number_out_;
    Placed<hal::LimitParam> max_limit_, min_limit_;
    Placed<ScaleParam> scale_max_, scale_;
    Placed<hal::Out<std::int32_t>> count_, raw_count_;
    Placed<hal::Out<double>> position_;
    Placed<hal::In<bool>> reset_;
    PositionCounter<std::int32_t> counter_;
    std::int64_t zero_ = 0;
};

/// One device.
class RemotePins {
public:
    /// `number` identifies it in events.
    RemotePins(const PinOwner& o, const RemotePort& port, const Remote& remote,
               std::uint32_t number)
        : number_(number),
          channel_(remote.channel),
          mode_(remote.mode),
          output_words_(remote.output_words()),
          input_words_(remote.input_words()),
          status_(port.of_channel(smart_serial::control_status, remote.channel)),
          online_(o.component, o.read, (remote.name() + ".online").c_str(), "the device answers",
                  {.safe = false}) {
        for (unsigned n = 0; n < max_words; ++n) {
            user_[n] = port.of_channel(smart_serial::user + n, remote.channel);
        }
        for (const RemoteField& field : remote.outputs) {
            outputs_.push_back(place<RemoteFieldPins>(o, remote.name(), field, true));
        }
        for (const RemoteField& field : remote.inputs) {
            inputs_.push_back(place<RemoteFieldPins>(o, remote.name(), field, false));
        }
        for (const RemoteConstant& constant : remote.constants) {
            constants_.push_back(place<hal::Param<std::uint32_t>>(
                o.component, (remote.name() + "." + constant.name).c_str(),
                "read from the device at the start",
                hal::PinOptions<std::uint32_t>{.initial = constant.value}));
        }
    }
    static constexpr unsigned max_words = 7;

    void plan(ReadLayout& layout) {
        for (unsigned n = 0; n < input_words_; ++n) {
            offsets_[n] = layout.add(user_[n]);
        }
    }
    /// [realtime] read
    void receive(const Reply& reply, bool has_answered, bool is_after_gap) noexcept {
        missing_ = has_answered ? 0 : std::min(missing_ + 1, tolerated + 1);
        online_ = missing_ <= tolerated;
        if (!has_answered) return;
        std::array<std::uint32_t, max_words> words{};
        for (unsigned n = 0; n < input_words_; ++n) {
            words[n] = reply.at(offsets_[n]);
        }
        for (const auto& field : inputs_) {
            field->receive(std::span(words).first(input_words_), is_after_gap);
        }
    }
    void show_offline() noexcept { online_ = false; }
    /// [realtime] write
    void transmit(Outgoing& out, bool is_on) const noexcept {
        std::array<std::uint32_t, max_words> words{};
        for (const auto& field : outputs_) {
            field->transmit(std::span(words).first(output_words_), is_on);
        }
        out.put(status_, 0);
        for (unsigned n = 0; n < output_words_; ++n) {
            out.put(user_[n], words[n]);
        }
    }
    void select_mode(Outgoing& out) const noexcept {
        out.put(status_, static_cast<std::uint32_t>(mode_) << 24);
    }
    unsigned channel() const noexcept { return channel_; }
    std::uint32_t number() const noexcept { return number_; }
    bool is_online() const noexcept { return online_; }
    std::size_t write_size() const noexcept { return 8 * (1 + output_words_); }

private:
    static constexpr unsigned tolerated = 10;  // exchanges

    const std::uint32_t number_;
    const unsigned channel_, mode_, output_words_, input_words_;
    const std::uint16_t status_;
    std::array<std::uint16_t, max_words> user_{};
    std::array<std::size_t, max_words> offsets_{};
    std::vector<Placed<RemoteFieldPins>> outputs_, inputs_;
    std::vector<Placed<hal::Param<std::uint32_t>>> constants_;
    unsigned missing_ = 0;
    hal::Out<bool> online_;
};

/// One port. After a start, a gap or too many faults it is stopped and started again by itself; the
/// first exchange has all outputs off.
class SerialPortPins {
public:
    SerialPortPins(const PinOwner& o, const RemotePort& port, std::uint32_t& number)
        : command_(port.command),
          data_(port.data),
          mask_(port.mask()),
          run_(o.component, o.write, named(port, "run").c_str(),
               "TRUE: data is exchanged in each cycle", {.initial = true}),
          state_(o.component, o.read, named(port, "port_state").c_str(),
                 "0: off, 2: starting, 3: running, 4: stopping"),
          state_2_(o.component, o.read, named(port, "port_state2").c_str(),
                   "data register: devices whose last exchange has failed, a bit each"),
          state_3_(o.component, o.read, named(port, "port_state3").c_str(), "command register"),
          fault_count_(o.component, o.read, named(port, "fault-count").c_str(),
                       "faults, less those that are forgotten"),
          restarts_(o.component, o.read, named(port, "restarts").c_str(),
                    "restarts because of faults"),
          fault_inc_(o.component, named(port, "fault-inc").c_str(),
                     "added to fault-count by a failed exchange", {.initial = 10}),
          fault_dec_(o.component, named(port, "fault-dec").c_str(), "subtracted by a good one",
                     {.initial = 1}),
          fault_lim_(o.component, named(port, "fault-lim").c_str(),
                     "fault-count at which the port is started again", {.initial = 200}) {
        for (const Remote& remote : port.remotes) {
            remotes_.push_back(place<RemotePins>(o, port, remote, number++));
        }
    }

    void plan(ReadLayout& layout) {
        command_offset_ = layout.add(command_);
        data_offset_ = layout.add(data_);
        for (const auto& remote : remotes_) {
            remote->plan(layout);
        }
    }
    std::size_t write_size() const noexcept {
        std::size_t size = 8;
        for (const auto& remote : remotes_) {
            size += remote->write_size();
        }
        return size;
    }

    /// [realtime] read
    void receive(const Reply& reply, const Reading& reading) noexcept {
        const std::uint32_t command = reply.at(command_offset_);
        const std::uint32_t failed = reply.at(data_offset_) & mask_;
        state_2_ = failed;
        state_3_ = command;
        if (reading.is_after_gap || reading.has_lost_power) {
            phase_ = Phase::stop;
        }
        is_idle_ = command == 0;
        switch (phase_) {
        case Phase::running: follow(reply, failed, reading); break;
        case Phase::stopping:
            phase_ = is_idle_ ? Phase::stopped : Phase::stopping;
            show_offline();
            break;
        case Phase::starting:
            phase_ = is_idle_ ? Phase::running : Phase::starting;
            exchanges_ = 0;
            break;
        case Phase::stop:
        case Phase::stopped: break;
        }
        state_ = shown_state();
        fault_count_ = faults_;
    }
    /// Behind the reads of the same datagram: an exchange takes time, and the reads show the one
    /// before. [realtime] write
    void transmit(Outgoing& out, const Writing& writing) noexcept {
        switch (phase_) {
        case Phase::stop:
            out.put(command_, smart_serial::port::stop_all);
            phase_ = Phase::stopping;
            break;
        case Phase::stopped:
            if (!run_) break;
            for (const auto& remote : remotes_) {
                remote->select_mode(out);
            }
            out.put(command_, smart_serial::port::start | mask_);
            phase_ = Phase::starting;
            faults_ = 0;
            break;
        case Phase::running:
            if (!run_) {
                phase_ = Phase::stop;
            } else if (is_idle_) {
                exchange(out, writing);
            }
            break;
        case Phase::stopping:
        case Phase::starting: break;
        }
    }
    void stop(Outgoing& out) const { out.put(command_, smart_serial::port::stop_all); }
    void has_stopped() noexcept { phase_ = Phase::stop; }
    void show_offline() noexcept {
        for (const auto& remote : remotes_) {
            remote->show_offline();
        }
    }
    const std::vector<Placed<RemotePins>>& remotes() const noexcept { return remotes_; }
    /// Returns whether devices answer or have had the time to.
    bool is_running() const noexcept { return phase_ == Phase::running && exchanges_ > 20; }

private:
    enum class Phase : std::uint8_t { stop, stopping, stopped, starting, running };

    static std::string named(const RemotePort& port, const char* name) {
        return "sserial.port-" + std::to_string(port.port) + "." + name;
    }
    std::uint32_t shown_state() const noexcept {
        switch (phase_) {
        case Phase::stop:
        case Phase::stopping: return 4;
        case Phase::stopped: return 0;
        case Phase::starting: return 2;
        case Phase::running: return 3;
        }
        return 0;
    }
    /// The answer has the results of the exchange of the cycle before.
    void follow(const Reply& reply, std::uint32_t failed, const Reading& reading) noexcept {
        if (exchanges_ < 2) return;
        const bool is_good = is_idle_ && failed == 0;
        const std::uint32_t change = is_good ? fault_dec_.get() : fault_inc_.get();
        if (is_good) {
            faults_ -= std::min(faults_, change);
        } else {
            faults_ += std::min(change, UINT32_MAX - faults_);
        }
        for (const auto& remote : remotes_) {
            const bool has_answered = is_idle_ && (failed >> remote->channel() & 1U) == 0;
            remote->receive(reply, has_answered, is_first_ || reading.has_lost_power);
        }
        is_first_ = false;
        if (faults_ > fault_lim_) {
            phase_ = Phase::stop;
            is_first_ = true;
            restarts_ = restarts_ + 1;
        }
    }
    void exchange(Outgoing& out, const Writing& writing) noexcept {
        const bool is_on = writing.outputs_on && exchanges_ > 0;
        for (const auto& remote : remotes_) {
            remote->transmit(out, is_on);
        }
        out.put(command_, smart_serial::port::do_it | mask_);
        exchanges_ = std::min(exchanges_ + 1, 1000U);
    }

    const std::uint16_t command_, data_;
    const std::uint32_t mask_;
    std::size_t command_offset_ = 0;
    std::size_t data_offset_ = 0;
    Phase phase_ = Phase::stop;
    bool is_idle_ = false;
    bool is_first_ = true;  ///< no answers since the start
    unsigned exchanges_ = 0;  ///< since the start
    std::uint32_t faults_ = 0;
    std::vector<Placed<RemotePins>> remotes_;
    hal::In<bool> run_;
    hal::Out<std::uint32_t> state_, state_2_, state_3_, fault_count_, restarts_;
    hal::Param<std::uint32_t> fault_inc_, fault_dec_, fault_lim_;
};

class SerialPins final : public ModulePins {
public:
    SerialPins(const PinOwner& o, const std::vector<RemotePort>& ports) {
        std::uint32_t number = 0;
        for (const RemotePort& port : ports) {
            ports_.push_back(place<SerialPortPins>(o, port, number));
        }
    }
    void plan(ReadLayout& layout) override {
        for (const auto& port : ports_) {
            port->plan(layout);
        }
    }
    void receive(const Reply& reply, const Reading& reading) noexcept override {
        for (const auto& port : ports_) {
            port->receive(reply, reading);
        }
    }
    /// Its writes are behind the reads of the datagram: transmit_late().
    void transmit_late(Outgoing& out, const Writing& writing) noexcept {
        for (const auto& port : ports_) {
            port->transmit(out, writing);
        }
    }
    void stop(Outgoing& out) const override {
        for (const auto& port : ports_) {
            port->stop(out);
        }
    }
    void has_stopped() noexcept override {
        for (const auto& port : ports_) {
            port->has_stopped();
        }
    }
    std::size_t write_size() const noexcept {
        std::size_t size = 0;
        for (const auto& port : ports_) {
            size += port->write_size();
        }
        return size;
    }
    const std::vector<Placed<SerialPortPins>>& ports() const noexcept { return ports_; }

private:
    std::vector<Placed<SerialPortPins>> ports_;
};

}  // namespace hal::mesa
