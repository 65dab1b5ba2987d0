// SPDX-License-Identifier: MIT
#include <atomic>
#include <deque>
#include <memory>

#include "hal/background.hpp"
#include "hal/journal.hpp"
#include "link/system.hpp"
#include "modbus/device/slave_bus.hpp"
#include "modbus/master/value_codec.hpp"
#include "modbus_arguments.hpp"

namespace {

using namespace hal::modbus;

/// The pins of an emulated slave. Values cross between the cycle and the background by atomics.
class NodePins {
public:
    NodePins(hal::Component& c, const Slave& slave) : slave_(slave) {
        for (const Value& value : slave.values) {
            if (value.purpose != Purpose::pin) continue;
            Crossing& crossing = values_.emplace_back(value);
            const std::string name = slave.name + "." + value.name;
            if (value.is_output) {
                crossing.out = std::make_unique<hal::Out<double>>(
                    c, name.c_str(), "what the master has written",
                    hal::PinOptions<double>{.unit = value.unit.c_str()});
            } else {
                crossing.in = std::make_unique<hal::In<double>>(
                    c, name.c_str(), "what the master reads",
                    hal::PinOptions<double>{.unit = value.unit.c_str()});
            }
        }
        if (!slave.drive) return;
        rpm_ = std::make_unique<hal::Out<double>>(c, (slave.name + ".rpm").c_str(),
                                                  "speed of the motor",
                                                  hal::PinOptions<double>{.unit = "rpm"});
        trip_ = std::make_unique<hal::In<bool>>(c, (slave.name + ".trip").c_str(),
                                                "rising edge: the drive trips");
        blocked_ = std::make_unique<hal::In<bool>>(c, (slave.name + ".blocked").c_str(),
                                                   "the shaft does not turn");
    }

    /// [realtime]
    void update() noexcept {
        for (Crossing& value : values_) {
            if (value.in) {
                value.number.store(*value.in, std::memory_order_relaxed);
            } else {
                *value.out = value.seen(value.number.load(std::memory_order_relaxed));
            }
        }
        if (!rpm_) return;
        *rpm_ = seen_speed_(speed_.load(std::memory_order_relaxed));
        blocks_.store(*blocked_, std::memory_order_relaxed);
        if (*trip_ && !was_tripped_) {
            trips_.store(true, std::memory_order_relaxed);
        }
        was_tripped_ = *trip_;
    }

    /// In the background.
    void exchange(EmulatedSlave& slave) {
        for (Crossing& value : values_) {
            if (value.in) {
                slave.set(value.config.name, value.number.load(std::memory_order_relaxed));
                continue;
            }
            Registers r;
            r.count = is_bits(value.config.table) ? 1 : value.config.size();
            for (std::size_t n = 0; n < r.count; ++n) {
                r.words[n] = slave
                                 .get(value.config.table,
                                      static_cast<std::uint16_t>(value.config.address + n))
                                 .value_or(0);
            }
            value.number.store(number_of(value.config, decode_value(value.config, r, 0)),
                               std::memory_order_relaxed);
        }
        DriveModel* const drive = slave.drive();
        if (drive == nullptr) return;
        if (trips_.exchange(false, std::memory_order_relaxed)) {
            drive->is_tripped = true;
        }
        drive->is_blocked = blocks_.load(std::memory_order_relaxed);
        speed_.store(drive->speed_rpm, std::memory_order_relaxed);
    }

private:
    struct Crossing {
        explicit Crossing(const Value& value) : config(value) {}
        const Value& config;
        std::unique_ptr<hal::In<double>> in;
        std::unique_ptr<hal::Out<double>> out;
        std::atomic<double> number{0.0};  // written by the cycle with `in`, else by the background
        hal::JournaledValue<double> seen;  // by the cycle
    };

    static double number_of(const Value& v, std::uint64_t cell) {
        switch (pin_form(v)) {
        case PinForm::real: return std::bit_cast<double>(cell);
        case PinForm::signed_number: return static_cast<double>(static_cast<std::int64_t>(cell));
        default: return static_cast<double>(cell);
        }
    }

    const Slave& slave_;
    std::deque<Crossing> values_;
    std::unique_ptr<hal::Out<double>> rpm_;
    std::unique_ptr<hal::In<bool>> trip_, blocked_;
    std::atomic<double> speed_{0.0};  // written by the background
    hal::JournaledValue<double> seen_speed_;  // by the cycle
    std::atomic<bool> trips_{false};  // set by the cycle, taken by the background
    std::atomic<bool> blocks_{false};  // written by the cycle
    bool was_tripped_ = false;
};

struct ModbusNode : hal::Component {
    explicit ModbusNode(const hal_host* host) : Component(host) {
        arguments_.load("modbus_node");
        if (!arguments_.loaded) return;
        for (const Slave& slave : arguments_.bus.slaves) {
            pins_.emplace_back(*this, slave);
        }
    }

    ModbusArguments arguments_{*this};
    hal::Function run_{*this, "", &ModbusNode::update, "copies values between pins and registers"};
    hal::In<bool> silence_{*this, "silence", "no slave answers"};
    hal::In<bool> late_{*this, "late", "answers are 200 ms late"};
    hal::In<bool> corrupt_{*this, "corrupt", "a byte of each answer is wrong"};
    hal::In<bool> wrong_unit_{*this, "wrong-unit", "answers have another address"};
    hal::In<bool> exception_{*this, "exception", "requests are answered with exception 4"};
    hal::In<bool> half_{*this, "half", "only the first half of an answer is sent"};
    hal::In<std::uint32_t> unit_{*this, "fault-unit", "the slave of these faults; 0: all"};
    hal::In<double> noise_{*this, "noise",
                           "share of the bytes on the line that are changed, 0..1, of requests and "
                           "of answers of all slaves"};
    hal::Out<std::uint64_t> requests_{*this, "requests", "requests to these slaves"};

    void start() {
        if (!arguments_.loaded) {
            throw std::runtime_error("missing configuration: write config=FILE.modbus");
        }
        const hal::JournaledSource journaled;  // by JournaledValue
        // a re-execution opens no real line
        auto opened = hal::line::open(hal::is_executed_again() ? "sim:replay" : arguments_.bus.link,
                                      arguments_.bus.line);
        if (!opened) throw std::runtime_error(opened.problem);
        line_ = std::move(opened.line);
        bus_ = std::make_unique<SlaveBus>(arguments_.bus);
        for (std::size_t n = 0; n < fault_kinds; ++n) {
            SlaveFault fault;
            fault.kind = static_cast<FaultKind>(n);
            fault.is_active = false;
            bus_->faults().push_back(fault);
        }
        bus_->attach(*line_);
        background_.start();
    }
    void stop() noexcept {
        background_.stop();
        bus_.reset();
        line_.reset();
    }

    void update(hal::Cycle) noexcept {
        const bool has_noise = noise_ > 0.0;
        const bool faults[] = {silence_,   late_, corrupt_, wrong_unit_,
                               exception_, half_, has_noise};
        static_assert(std::size(faults) == fault_kinds);
        share_.store(noise_, std::memory_order_relaxed);
        std::uint32_t bits = 0;
        for (std::size_t n = 0; n < fault_kinds; ++n) {
            bits |= static_cast<std::uint32_t>(faults[n]) << n;
        }
        faults_.store(bits | unit_.get() << 8, std::memory_order_relaxed);
        for (NodePins& pins : pins_) {
            pins.update();
        }
        requests_ = seen_count_(count_.load(std::memory_order_relaxed));
    }

private:
    void turn(std::int64_t now_ns, bool may_wait) {
        const std::uint32_t faults = faults_.load(std::memory_order_relaxed);
        for (std::size_t n = 0; n < fault_kinds; ++n) {
            bus_->faults()[n].is_active = (faults >> n & 1U) != 0;
            bus_->faults()[n].unit = static_cast<std::uint8_t>(faults >> 8);
            bus_->faults()[n].share = share_.load(std::memory_order_relaxed);
        }
        const std::int64_t next = bus_->work(now_ns);
        for (std::size_t n = 0; n < pins_.size(); ++n) {
            pins_[n].exchange(bus_->slaves()[n]);
        }
        count_.store(bus_->requests(), std::memory_order_relaxed);
        if (!may_wait) return;
        const timespec pause =
            hal::link::to_timespec(std::clamp<std::int64_t>(next - now_ns, 50'000, 500'000));
        nanosleep(&pause, nullptr);
    }

    std::deque<NodePins> pins_;
    std::unique_ptr<hal::line::Line> line_;
    std::unique_ptr<SlaveBus> bus_;
    hal::Background background_{[this](std::int64_t now, bool may_wait) { turn(now, may_wait); }};
    std::atomic<std::uint32_t> faults_{0};  // written by the cycle: kinds, and the slave from bit 8
    std::atomic<double> share_{0.0};  // written by the cycle: of the noise
    std::atomic<std::uint64_t> count_{0};  // written by the background
    hal::JournaledValue<std::uint64_t> seen_count_;  // by the cycle
};

}  // namespace

HAL_COMPONENT(ModbusNode, "modbus_node", "Emulated Modbus slaves and drives, for simulations", R"(
Emulates all slaves of a configuration on a line: their registers, and a motor behind each frequency
converter. With the master on the same line in memory a machine runs in `hal sim`:

`spindle.modbus`:

    [bus]
    link = serial:/dev/ttyUSB0
    baud = 19200

    [slave 1 spindle]
    profile = delta-ms300
    max-speed = 24000
    max-frequency = 400

The netlist puts both on a line in memory:

    loadrt modbus      config=spindle.modbus link=sim:spindle
    loadrt modbus_node config=spindle.modbus link=sim:spindle
    addf modbus.0.receive servo-thread
    addf modbus-node.0 servo-thread
    addf modbus.0.transmit servo-thread

On the virtual clock the line works once in each cycle of the fastest thread: a telegram takes at
least two of them. The slaves answer also while `modbus-node.0` is in no thread, or stopped: then
their pins stand, and the registers keep their values.

What the master reads is an input pin here, and what it writes is an output pin. The inputs
`silence`, `late`, `corrupt`, `wrong-unit`, `exception` and `half` make the faults of a slave, and
`noise` changes bytes on the line.
`trip` and `blocked` of a drive make those of a motor.

As a process of its own, on a pseudo terminal or a TCP port, it is `hal node modbus FILE`.
)")
