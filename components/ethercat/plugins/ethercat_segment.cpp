// SPDX-License-Identifier: MIT
#include <algorithm>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ethercat/devices/device_words.hpp"
#include "ethercat/devices/registry.hpp"
#include "ethercat/devices/servo.hpp"
#include "ethercat/esc/line.hpp"
#include "ethercat/esc/responder.hpp"
#include "ethercat/plugins/segment_pins.hpp"
#include "hal/component.hpp"
#include "hal/texts.hpp"

namespace {

using namespace hal::ethercat;

class EthercatSegment : public hal::Component {
public:
    explicit EthercatSegment(const hal_host* host) : Component(host) {
        const devices::LineDescription description = devices::read_line(
            devices::device_lines(devices_.get()),
            [texts = hal::Texts(*this)](const std::string& name) { return texts.find(name); });
        for (const auto& m : description.messages) {
            if (m.severity == hal::Severity::error) {  // duplicate aliases may be wanted
                throw hal::ArgumentError(
                    "devices", "devices=\"" + devices_.get() + "\": " + m.sentence + "; " + m.help);
            }
        }
        line_devices_ = devices::make_line(description);
        for (std::size_t n = 0; n < line_devices_.size(); ++n) {
            declare(n);
        }
    }

    void start() {
        hal::ethernet::Options options;
        options.promiscuous = true;
        options.send_capacity = options.receive_capacity = 256;
        if (link_.get() == backup_.get()) {
            throw std::runtime_error("backup=" + backup_.get() +
                                     " is the link itself; choose another name");
        }
        primary_ = open(link_.get(), options);
        if (!backup_.get().empty()) {
            secondary_ = open(backup_.get(), options);
        }
        line_.emplace();
        frames_ = 0;
        silent_ = 0;
        for (devices::Device& d : line_devices_) {
            line_->add({.controller = {.dc = d.dc}, .sii = d.sii, .application = d.firmware.get()});
        }
        if (secondary_ && !line_devices_.empty() &&
            !line_->close_ring(static_cast<unsigned>(line_devices_.size() - 1), 1)) {
            throw std::runtime_error(
                "backup=" + backup_.get() +
                ": the last device has no second port; put one with two ports at the end");
        }
        const std::int64_t now = primary_->segment()->time_ns();
        line_->power_on(now == hal::ethernet::unclocked ? 0 : now);
        connection_ = std::make_unique<esc::LineOnSegments>(*line_, *primary_, secondary_.get());
        if (!connection_->connected()) {
            throw std::runtime_error(link_.get() +
                                     " already has emulated slaves; choose another name");
        }
        for (EmulatedSlavePins& pins : slaves_) {
            pins.forget();
        }
        unposted_ = true;
    }

    void stop() noexcept {
        connection_.reset();
        line_.reset();
        primary_.reset();
        secondary_.reset();
    }

    void update(hal::Cycle cycle) noexcept {
        if (!line_) return;
        primary_->receive(cycle.start_ns());  // frames of a master that is gone pass too
        silent_ = line_->frames() == frames_ ? silent_ + 1 : 0;
        frames_ = line_->frames();
        if (silent_ >= silent_cycles) {
            // frames move its time; without them its watchdogs run all the same
            line_->advance(cycle.start_ns());
        }
        bool disturbed = unposted_;
        for (unsigned n = 0; n < slaves_.size(); ++n) {
            EmulatedSlavePins& pins = slaves_[n];
            pins.post_changes(*line_, n);
            disturbed |= pins.frames_changed();
            set_faults(pins, *line_devices_[n].firmware);
            pins.state =
                pins.power ? static_cast<std::uint32_t>(line_devices_[n].firmware->state()) : 0U;
        }
        if (disturbed) {
            unposted_ = !post_disturbances();
        }
        for (EmulatedAxisPins& pins : axes_) {
            pins.update();
        }
        for (SampledIoPins& pins : sampled_) {
            pins.update();
        }
        for (auto& c : digital_in_) {
            c.io.set_input(c.number, c.pin ? 1 : 0);
        }
        for (auto& c : digital_out_) {
            c.pin = c.io.output(c.number) != 0;
        }
        for (auto& c : analog_in_) {
            c.io.set_input(c.number, c.pin);
        }
        for (auto& c : analog_out_) {
            c.pin = c.io.output(c.number);
        }
    }

private:
    static constexpr unsigned silent_cycles = 10;

    /// Replaces the disturbances of frames by those that the pins ask for. Returns whether the line
    /// took them all. [realtime]
    bool post_disturbances() noexcept {
        bool posted = line_->post({.kind = esc::LineCommand::Kind::calm});
        for (unsigned n = 0; n < slaves_.size(); ++n) {
            posted = posted && slaves_[n].post_disturbances(*line_, n);
        }
        return posted;
    }

    /// Copies the pins of firmware faults. [realtime]
    static void set_faults(EmulatedSlavePins& pins, devices::Firmware& firmware) noexcept {
        devices::FirmwareFaults& faults = firmware.faults();
        for (const State state : {State::preop, State::safeop, State::op}) {
            const bool rejected = pins.reject_state == static_cast<std::uint32_t>(state);
            const std::uint32_t code =
                rejected ? std::clamp<std::uint32_t>(pins.reject_code, 1, 0xffff) : 0U;
            faults.reject[state].store(static_cast<std::uint16_t>(code), std::memory_order_relaxed);
        }
        if (pins.fail_code != pins.was_fail && pins.fail_code != 0 &&
            firmware.state() == State::op) {
            faults.fail.store(
                static_cast<std::uint16_t>(std::min<std::uint32_t>(pins.fail_code, 0xffff)),
                std::memory_order_relaxed);
        }
        pins.was_fail = pins.fail_code;
        faults.mailbox_delay_ns.store(nanoseconds(pins.mailbox_delay), std::memory_order_relaxed);
    }

    static std::unique_ptr<hal::ethernet::Port> open(const std::string& address,
                                                     const hal::ethernet::Options& options) {
        if (!hal::ethernet::describe(address).in_memory) {
            throw std::runtime_error(address + " is not a segment in memory; write link=sim:NAME");
        }
        auto opened = hal::ethernet::open(address, options);
        if (!opened) throw std::runtime_error(opened.problem);
        return std::move(opened.port);
    }

    /// Declares the pins of a device. [setup]
    void declare(std::size_t n) {
        const devices::Device& device = line_devices_[n];
        const std::string name = "slave-" + std::to_string(n);
        slaves_.emplace_back(*this, update_, name);
        devices::Behaviour& behaviour = device.firmware->behaviour();
        if (auto* servo = dynamic_cast<devices::Servo*>(&behaviour)) {
            for (unsigned a = 0; a < servo->axes(); ++a) {
                axes_.emplace_back(
                    *this, update_,
                    name + (servo->axes() > 1 ? ".axis-" + std::to_string(a) + "." : "."),
                    servo->axis(a));
            }
        } else if (auto* sampled = dynamic_cast<devices::SampledIo*>(&behaviour)) {
            sampled_.emplace_back(*this, update_, name, *sampled);
        } else if (auto* io = dynamic_cast<devices::IoBehaviour*>(&behaviour)) {
            for (unsigned c = 0; c < io->channels(); ++c) {
                const std::string number = (c < 10 ? "0" : "") + std::to_string(c);
                if (device.name == "digital_in") {
                    digital_in_.emplace_back(*this, update_, name + ".in-" + number,
                                             "terminal of the input", *io, c);
                } else if (device.name == "digital_out") {
                    digital_out_.emplace_back(*this, update_, name + ".out-" + number,
                                              "terminal of the output", *io, c);
                } else if (device.name == "analog_in") {
                    analog_in_.emplace_back(*this, update_, name + ".analog-in-" + number,
                                            "terminal of the input, in counts", *io, c);
                } else {
                    analog_out_.emplace_back(*this, update_, name + ".analog-out-" + number,
                                             "terminal of the output, in counts", *io, c);
                }
            }
        }
    }

    hal::TextArgument devices_{
        *this, "devices", "coupler",
        "devices along the line, separated by commas: coupler, digital_in bits=16, digital_out "
        "bits=8, analog_in channels=4, "
        "analog_out channels=2, servo axes=1, mailbox_device, esi file=drive.xml device=NAME; all "
        "take alias= and serial=, a servo dc=required, modes= (6502h) and motor=, as in "
        "motor=inertia:1e-4;home-from:5000"};
    hal::TextArgument link_{*this, "link", "sim:ethercat", "segment in memory where the master is"};
    hal::TextArgument backup_{*this, "backup", "",
                              "segment in memory of the master's second port, which closes a ring"};
    hal::Function update_{*this, "update", &EthercatSegment::update,
                          "copies values between pins and devices; in the thread of the master"};

    std::vector<devices::Device> line_devices_;
    // Deques: a pin may not move once it is declared.
    std::deque<EmulatedSlavePins> slaves_;
    std::deque<EmulatedAxisPins> axes_;
    std::deque<SampledIoPins> sampled_;
    std::deque<ChannelPin<hal::In<bool>>> digital_in_;
    std::deque<ChannelPin<hal::Out<bool>>> digital_out_;
    std::deque<ChannelPin<hal::In<std::int32_t>>> analog_in_;
    std::deque<ChannelPin<hal::Out<std::int32_t>>> analog_out_;
    std::unique_ptr<hal::ethernet::Port> primary_, secondary_;
    std::optional<esc::Line> line_;
    std::uint64_t frames_ = 0;
    unsigned silent_ = 0;
    /// disturbances that the line did not take yet
    bool unposted_ = false;
    std::unique_ptr<esc::LineOnSegments> connection_;
};

}  // namespace

HAL_COMPONENT(EthercatSegment, "ethercat_segment",
              "Emulated EtherCAT slaves on a segment in memory", R"(
A line of EtherCAT slaves for machines without the hardware: controllers with registers, sync
managers, FMMUs, EEPROM, watchdog and distributed clocks, and the firmware of couplers, digital and
analogue I/O and CiA 402 servo drives. Frames are answered while they pass, with the delays of
cables and devices, at the same times in every run of `hal sim`.

    loadrt ethercat_segment devices="coupler, digital_in bits=16, servo axes=2" link=sim:line
    addf ethercat-segment.0.update servo-thread
    setp ethercat-segment.0.slave-2.axis-0.inputs 1

Each axis of a servo is the simulated one of `canopen_drive`: all modes of CiA 402, homing methods 1
to 37, touch probes, limits, a brake and faults, with 10 000 increments per revolution, an absolute
encoder and an endless travel. `motor` changes the parameters that `canopen_drive` lists, separated
by semicolons.

A device of an ESI file whose PDOs have samples (OSFac) takes one at each pulse of SYNC0. Its inputs
are `offset-NN` + `sine-amplitude-NN` times a sine of `sine-frequency-NN`, which is 0 at system time
0; `value-NN` is the newest sample of an output.

A master on the same segment is `loadrt ethercat config=machine.ethercat link=sim:line`.

Slaves are counted from 0 along the line. `slave-N.power` and `slave-N.cable` switch a slave off and
break its cable. `slave-N.reject-state` with `slave-N.reject-code` makes a slave reject a state,
`slave-N.leave-op` makes it leave OP, and `slave-N.mailbox-delay` makes its mailbox slow. Frames on
the cable before a slave are disturbed by `lose-every`, `corrupt-every`, `double-every` and
`delay-every` with `delay`, its clock by `drift` and `clock-jump`, its EEPROM by `eeprom-fail`,
`eeprom-damaged` and `wrong-identity`, and `expire-watchdog` stops its outputs. With `backup` the
line is a ring with both ports of the master.
)");
