// SPDX-License-Identifier: MIT
#include "emulated_card.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/pin.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "mesa/lbp16/spaces.hpp"

namespace hal::mesa {

namespace {

constexpr std::size_t rom_size = 0x0c00;
constexpr std::int64_t plant_clocks = 5000;  ///< 50 us at 100 MHz
constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::size_t no_pin = SIZE_MAX;
constexpr std::uint16_t firmware_version = 1;
constexpr std::uint32_t serial_number = 0x00760000;

template <std::size_t N>
void put_text(std::array<std::uint8_t, N>& space, std::size_t at, std::string_view text,
              std::size_t size) {
    std::copy_n(text.begin(), std::min(text.size(), size),
                space.begin() + static_cast<std::ptrdiff_t>(at));
}

/// The registers behind those of the descriptor that select a timer of the DPLL.
unsigned registers_of(const ModuleDescriptor& module) {
    if (module.tag == Tag::stepgen) return stepgen::dpll_timer + 1;
    const bool is_encoder = module.tag == Tag::encoder || module.tag == Tag::muxed_encoder;
    if (is_encoder) return encoder::dpll_timer + 1;
    return module.registers;
}

/// The timer that a register selects, 1..4; 0: off.
unsigned timer_of(std::uint32_t selection) noexcept {
    return (selection & 0x8000U) != 0 ? selection >> 12 & 7U : 0;
}

/// The accumulator of a generator at a step, `remaining` steps before its newest one.
std::uint32_t accumulator_at(const StepGenerator& dds, std::int64_t steps,
                             std::int64_t remaining) noexcept {
    const std::uint32_t newest =
        steps > 0 ? dds.accumulator() & 0xffff0000U : dds.accumulator() | 0xffffU;
    const std::int64_t back = steps > 0 ? -remaining : remaining;
    return newest + static_cast<std::uint32_t>(back * 65536);
}

constexpr std::uint32_t bit(std::uint32_t word, unsigned n) noexcept { return word >> n & 1U; }

}  // namespace

// --- Setup

EmulatedCard::EmulatedCard(const CardConfig& config, const std::array<std::uint8_t, 6>& mac)
    : config_(config),
      model_(*config.model),
      plant_(config),
      inputs_(config.inputs.size()),
      outside_(std::size_t{config.model->ports} * config.model->pins) {
    idrom_.type = config.idrom_type != 0 ? config.idrom_type : model_.idrom_type;
    std::copy_n(model_.board.begin(), idrom_.board.size(), idrom_.board.begin());
    idrom_.ports = model_.ports;
    idrom_.port_width = model_.pins;
    idrom_.width = idrom_.ports * idrom_.port_width;
    clock_hz_ = idrom_.clock_low_hz;
    for (ModuleDescriptor descriptor : model_.modules) {
        descriptor.instances = static_cast<std::uint8_t>(config.instances(descriptor.tag));
        if (descriptor.instances == 0) continue;
        descriptor.version = config.version_of(descriptor);
        modules_.push_back({descriptor, {descriptor, idrom_}, registers_of(descriptor)});
    }
    for (unsigned channel = 0; channel < smart_serial::max_channels; ++channel) {
        if (bit(config.remotes, channel) != 0) {
            serial_.connect(channel, serial_number + channel);
        }
    }
    for (std::size_t n = 0; n < inputs_.size(); ++n) {
        inputs_[n] = config.inputs[n].initial;
    }
    fill_rom();
    find_pins();
    std::reverse_copy(mac.begin(), mac.end(), eeprom_.begin() + eeprom::mac);
    put_text(card_, card::name, config.reported.empty() ? model_.reported : config.reported, 16);
    store(card_.data() + card::lbp_version, config.lbp_version);
    store(card_.data() + card::firmware_version, firmware_version);
    reset();
}

void EmulatedCard::fill_rom() {
    rom_.resize(rom_size);
    store(rom_.data() + cookie_address, hostmot2_cookie);
    std::copy(firmware_name.begin(), firmware_name.end(), rom_.begin() + firmware_name_address);
    store(rom_.data() + idrom_offset_address, std::uint32_t{usual_idrom_address});
    const auto bytes = idrom_.encode();
    std::copy(bytes.begin(), bytes.end(), rom_.begin() + usual_idrom_address);
    auto at = rom_.begin() + usual_idrom_address + static_cast<std::ptrdiff_t>(idrom_.modules);
    for (const Module& module : modules_) {
        at = std::ranges::copy(module.descriptor.encode(), at).out;
    }
    std::size_t pin_at = usual_idrom_address + idrom_.pins;
    for (std::size_t pin = 0; pin < outside_.size(); ++pin) {
        store(rom_.data() + pin_at, descriptor(pin).encode());
        pin_at += 4;
    }
}

/// The descriptor of a pin: that of the model, unless its module is missing in this firmware.
PinDescriptor EmulatedCard::descriptor(std::size_t pin) const noexcept {
    const PinDescriptor whole = PinDescriptor::decode(model_.descriptors[pin]);
    return has_pin(whole) ? whole : PinDescriptor{};
}

/// Whether this firmware has a pin of the model.
bool EmulatedCard::has_pin(const PinDescriptor& pin) const noexcept {
    const std::uint8_t encoder_version = config_.encoder_version.value_or(0);
    const unsigned count = config_.instances(pin.module);
    switch (pin.module) {
    case Tag::stepgen: {
        const bool is_latch_input = pin.number >= pin_number::stepgen::index;
        const bool can_latch = config_.stepgen_version.value_or(0) == stepgen::version_with_latch;
        return pin.unit < count && (can_latch || !is_latch_input);
    }
    case Tag::encoder:
    case Tag::muxed_encoder: {
        const bool is_probe = pin.number == pin_number::encoder::probe;
        if (is_probe && (encoder_version & encoder::version_with_probe) == 0) return false;
        if (pin.unit == PinDescriptor::all_units) return count > 0;
        return pin.unit < (pin.module == Tag::encoder ? count : (count + 1) / 2);
    }
    case Tag::mux_select: return config_.instances(Tag::muxed_encoder) > 0;
    case Tag::pwm:
    case Tag::three_phase_pwm:
    case Tag::packet_uart_transmit:
    case Tag::packet_uart_receive: return pin.unit < count;
    default: return true;
    }
}

/// Whether a smart-serial channel has a pin to send.
bool EmulatedCard::has_channel(unsigned channel) const noexcept {
    const unsigned number = pin_number::smart_serial::first_transmit + channel;
    return find_output(Tag::smart_serial, 0, number) != no_pin;
}

std::size_t EmulatedCard::find_output(Tag tag, unsigned unit, unsigned number) const noexcept {
    for (std::size_t pin = 0; pin < outside_.size(); ++pin) {
        const PinDescriptor is = descriptor(pin);
        if (is.module == tag && is.unit == unit && is.number == number && is.is_output) return pin;
    }
    return no_pin;
}

std::size_t EmulatedCard::find_input(Tag tag, unsigned unit, unsigned number) const noexcept {
    for (std::size_t pin = 0; pin < outside_.size(); ++pin) {
        const PinDescriptor is = descriptor(pin);
        const bool is_of_unit = is.unit == unit || is.unit == PinDescriptor::all_units;
        if (is.module == tag && is_of_unit && is.number == number && !is.is_output) return pin;
    }
    return no_pin;
}

/// The probe is an input of the card, on which a switch of the same motor may be.
void EmulatedCard::find_latch_inputs(unsigned unit) {
    Generator& generator = generators_[unit];
    generator.latch.set_version(config_.stepgen_version.value_or(0));
    generator.index.pin = find_input(Tag::stepgen, unit, pin_number::stepgen::index);
    generator.probe.pin = find_input(Tag::stepgen, unit, pin_number::stepgen::probe);
    for (std::size_t n = 0; n < config_.switches.size(); ++n) {
        const SwitchConfig& one = config_.switches[n];
        const bool is_there =
            one.terminal.kind == Terminal::Kind::gpio && one.terminal.number == generator.probe.pin;
        if (is_there && config_.motors[one.motor_index].stepgen == unit) {
            generator.probe.switch_index = n;
        }
    }
}

void EmulatedCard::find_pins() {
    unsigned channels = 0;
    while (channels < smart_serial::max_channels && has_channel(channels)) {
        ++channels;
    }
    serial_.set_channels(channels);
    for (unsigned unit = 0; unit < config_.instances(Tag::stepgen); ++unit) {
        Generator& generator = generators_[unit];
        generator.step_pin = find_output(Tag::stepgen, unit, pin_number::stepgen::step);
        generator.direction_pin = find_output(Tag::stepgen, unit, pin_number::stepgen::direction);
        find_latch_inputs(unit);
    }
    for (unsigned unit = 0; unit < max_units; ++unit) {
        pwm_pins_[unit] = find_output(Tag::pwm, unit, pin_number::pwm::out);
        fault_pins_[unit] =
            find_input(Tag::three_phase_pwm, unit, pin_number::three_phase_pwm::fault);
        counters_[unit].probe_pin =
            find_input(config_.encoder_tag(), unit, pin_number::encoder::probe);
    }
}

void EmulatedCard::reset() noexcept {
    ports_ = {};
    for (Generator& generator : generators_) {
        generator.dds = {};
        generator.latch.reset();
        generator.latched = 0;
    }
    for (Counter& counter : counters_) {
        counter.counter = {};
        counter.latched = 0;
    }
    bridges_ = {};
    bridge_rate_ = 0;
    watchdog_ = {};
    phase_loop_ = PhaseLoop(clock_hz_);
    serial_.reset();
    stepgen_timer_ = 0;
    encoder_timer_ = 0;
    timestamp_divider_ = 0;
    filter_ = 0;
    pwm_values_ = {};
    pwm_modes_ = {};
    pwm_rate_ = 0;
    pdm_rate_ = 0;
    pwm_enables_ = 0;
    ssr_data_ = 0;
    ssr_rate_ = 0;
    outm_data_ = 0;
    leds_ = 0;
    inm_control_ = config_.instances(Tag::inmux) > 0 ? 23 : 10;  // inputs of the card, less 1
    inm_filter_ = 0;
    timers_ = {};
    status_ = {};
    last_address_ = {};
    feed_inputs();
}

// --- Time

std::int64_t EmulatedCard::now_ns() const noexcept {
    const std::int64_t seconds = clock_ / clock_hz_;
    const std::int64_t rest = clock_ % clock_hz_;
    return begin_ns_ + seconds * second_ns + rest * second_ns / clock_hz_;
}

void EmulatedCard::advance(std::int64_t now_ns) noexcept {
    if (!has_time_) {
        has_time_ = true;
        begin_ns_ = now_ns;
    }
    const std::int64_t passed = now_ns - begin_ns_;
    const std::int64_t target =
        passed / second_ns * clock_hz_ + passed % second_ns * clock_hz_ / second_ns;
    while (clock_ < target) {
        std::int64_t clocks = std::min(target - clock_, plant_clocks);
        clocks = std::min(clocks, watchdog_.expires() - clock_);
        clocks = std::min(clocks, phase_loop_.clocks_to_timer());
        run(clocks);
        if (clock_ >= watchdog_.expires()) {
            bite();
        }
    }
    feed_inputs();
}

void EmulatedCard::run(std::int64_t clocks) noexcept {
    move_motors(clocks);
    command_spindles();
    plant_.advance(static_cast<double>(clocks) / clock_hz_);
    turn_encoders(clocks);
    clock_ += clocks;
    serial_.advance(now_ns());
    const unsigned timers = phase_loop_.advance(clocks);
    if (timers != 0) {
        latch(timers);
    }
}

/// With exchanged pins neither is what its motor expects.
bool EmulatedCard::drives_motor(const Generator& generator) const noexcept {
    return is_driven_by_module(generator.step_pin) &&
           is_driven_by_module(generator.direction_pin) && !generator.latch.swaps_pins();
}

void EmulatedCard::move_motors(std::int64_t clocks) noexcept {
    for (unsigned unit = 0; unit < config_.instances(Tag::stepgen); ++unit) {
        const std::int64_t steps = generators_[unit].dds.advance(clocks);
        if (steps != 0 && drives_motor(generators_[unit])) {
            step_motor(unit, steps);
        }
    }
    sample_latch_inputs();
}

void EmulatedCard::step_motor(unsigned unit, std::int64_t steps) noexcept {
    Generator& generator = generators_[unit];
    const std::size_t pin = generator.direction_pin;
    const bool is_inverted =
        bit(ports_[pin / model_.pins].invert, static_cast<unsigned>(pin % model_.pins)) != 0;
    const auto indexed = plant_.indexed_motor(unit);
    std::optional<std::size_t> probed;
    if (generator.probe.switch_index) {
        probed = config_.switches[*generator.probe.switch_index].motor_index;
    }
    const std::int64_t index_from = indexed ? plant_.steps(*indexed) : 0;
    const std::int64_t probe_from = probed ? plant_.steps(*probed) : 0;
    plant_.step(unit, is_inverted ? -steps : steps);
    if (indexed) {
        follow_index(generator, *indexed, {index_from, plant_.steps(*indexed), steps});
    }
    if (probed) {
        follow_switch(generator, {probe_from, plant_.steps(*probed), steps});
    }
}

void EmulatedCard::follow_index(Generator& generator, std::size_t motor,
                                const Movement& moved) noexcept {
    using Input = PositionLatch::Input;
    if (!generator.latch.is_armed(Input::index)) return;
    const bool level = generator.latch.wants_rising(Input::index);
    const auto at = plant_.step_of_index(motor, moved.from, moved.to, level);
    if (!at) return;
    const std::int64_t remaining = std::abs(moved.to - *at);
    generator.latch.meet(Input::index, accumulator_at(generator.dds, moved.steps, remaining));
}

void EmulatedCard::follow_switch(Generator& generator, const Movement& moved) noexcept {
    using Input = PositionLatch::Input;
    const std::size_t which = *generator.probe.switch_index;
    const auto at = plant_.step_of_change(which, moved.from, moved.to);
    if (!at) return;
    const bool level = plant_.is_closed(which);
    const bool is_event = generator.latch.is_armed(Input::probe) &&
                          level == generator.latch.wants_rising(Input::probe);
    if (!is_event) return;
    const std::int64_t remaining = std::abs(moved.to - *at);
    generator.latch.meet(Input::probe, accumulator_at(generator.dds, moved.steps, remaining));
}

/// Inputs that no motor of theirs moves: buttons, and switches of another motor.
void EmulatedCard::sample_latch_inputs() noexcept {
    using Input = PositionLatch::Input;
    for (unsigned unit = 0; unit < config_.instances(Tag::stepgen); ++unit) {
        Generator& generator = generators_[unit];
        if (!generator.latch.can_latch()) return;
        if (!plant_.indexed_motor(unit)) {
            sample(generator, Input::index, generator.index);
        }
        if (!generator.probe.switch_index) {
            sample(generator, Input::probe, generator.probe);
        }
    }
}

void EmulatedCard::sample(Generator& generator, PositionLatch::Input which,
                          LatchInput& input) noexcept {
    if (input.pin == no_pin) return;
    const bool level = outside_[input.pin];
    const bool is_edge = std::exchange(input.level, level) != level;
    if (is_edge && generator.latch.is_armed(which) &&
        level == generator.latch.wants_rising(which)) {
        generator.latch.meet(which, generator.dds.accumulator());
    }
}

double EmulatedCard::pwm_command(unsigned unit) const noexcept {
    if (!is_driven_by_module(pwm_pins_[unit]) || bit(pwm_enables_, unit) == 0) return 0.0;
    return std::clamp(pwm_duty(pwm_values_[unit], 9 + (pwm_modes_[unit] & 3U)), -1.0, 1.0);
}

void EmulatedCard::command_spindles() noexcept {
    for (std::size_t n = 0; n < config_.spindles.size(); ++n) {
        const SpindleConfig& spindle = config_.spindles[n];
        if (spindle.drive == SpindleConfig::Drive::pwm) {
            plant_.drive(n, pwm_command(spindle.number));
            continue;
        }
        const Remote7i76* const remote = serial_.remote(spindle.number);
        const double command = remote == nullptr ? 0.0 : remote->spindle();
        plant_.drive(n, remote != nullptr && remote->is_reverse() ? -command : command);
    }
}

std::uint16_t EmulatedCard::timestamp(std::int64_t clock) const noexcept {
    return static_cast<std::uint16_t>(clock / (std::int64_t{timestamp_divider_} + 2));
}

void EmulatedCard::turn_encoders(std::int64_t clocks) noexcept {
    for (const EncoderMotion& motion : plant_.encoders()) {
        const double share = motion.newest_edge;
        const auto edge = static_cast<std::int64_t>(share * static_cast<double>(clocks));
        counters_[motion.encoder].counter.move(
            {motion.from, motion.to, motion.index_every, timestamp(clock_ + edge)});
    }
}

void EmulatedCard::latch(unsigned timers) noexcept {
    const auto expired = [&](std::uint32_t selection) {
        const unsigned timer = timer_of(selection);
        return timer != 0 && bit(timers, timer - 1) != 0;
    };
    if (expired(stepgen_timer_)) {
        for (Generator& generator : generators_) {
            generator.latched = generator.dds.accumulator();
        }
    }
    if (expired(encoder_timer_)) {
        for (Counter& counter : counters_) {
            counter.latched = counter.counter.count_register();
        }
    }
}

void EmulatedCard::fail_encoders() noexcept {
    for (Counter& counter : counters_) {
        counter.counter.fail();
    }
}

void EmulatedCard::bite() noexcept {
    watchdog_.bite();
    ++bites_;
    make_inputs();
}
void EmulatedCard::make_inputs() noexcept {
    for (Port& port : ports_) {
        port.direction = 0;
        port.open_drain = 0;
    }
}

/// Puts the levels of switches and buttons on the terminals.
void EmulatedCard::feed_inputs() noexcept {
    std::fill(outside_.begin(), outside_.end(), true);  // pulled up
    inm_inputs_ = 0;
    std::array<std::uint32_t, smart_serial::max_channels> remote_inputs{};
    const auto put = [&](const Terminal& terminal, bool level) {
        const std::uint32_t mask = level ? 1U << terminal.number % 32 : 0U;
        switch (terminal.kind) {
        case Terminal::Kind::gpio: outside_[terminal.number] = level; break;
        case Terminal::Kind::inm:
        case Terminal::Kind::inmux: inm_inputs_ |= mask; break;
        case Terminal::Kind::remote: remote_inputs[terminal.channel] |= mask; break;
        default: break;
        }
    };
    for (std::size_t n = 0; n < config_.switches.size(); ++n) {
        put(config_.switches[n].terminal, plant_.is_closed(n));
    }
    for (std::size_t n = 0; n < inputs_.size(); ++n) {
        put(config_.inputs[n].terminal, inputs_[n]);
    }
    for (unsigned channel = 0; channel < smart_serial::max_channels; ++channel) {
        if (Remote7i76* const remote = serial_.remote(channel)) {
            remote->inputs = remote_inputs[channel];
        }
    }
    for (std::size_t unit = 0; unit < max_units; ++unit) {
        if (counters_[unit].probe_pin != no_pin) {
            counters_[unit].counter.set_probe(outside_[counters_[unit].probe_pin]);
        }
        if (fault_pins_[unit] != no_pin) {
            bridges_[unit].sample(outside_[fault_pins_[unit]]);
        }
    }
}

// --- Pins

bool EmulatedCard::is_output(std::size_t pin) const noexcept {
    const Port& port = ports_[pin / model_.pins];
    return bit(port.direction | port.open_drain, static_cast<unsigned>(pin % model_.pins)) != 0;
}

bool EmulatedCard::is_driven_by_module(std::size_t pin) const noexcept {
    return pin != no_pin && is_output(pin) &&
           bit(ports_[pin / model_.pins].source, static_cast<unsigned>(pin % model_.pins)) != 0;
}

bool EmulatedCard::module_level(const PinDescriptor& pin) const noexcept {
    switch (pin.module) {
    case Tag::stepgen:
        return pin.number == pin_number::stepgen::direction && generators_[pin.unit].dds.rate() < 0;
    case Tag::pwm:
        if (pin.number == pin_number::pwm::not_enable) return bit(pwm_enables_, pin.unit) == 0;
        if (pin.number == pin_number::pwm::direction) {
            return (pwm_values_[pin.unit] & pwm::negative) != 0;
        }
        return std::fabs(pwm_duty(pwm_values_[pin.unit], 12)) > 0.5;
    case Tag::three_phase_pwm: return bridges_[pin.unit].level(pin.number);
    case Tag::smart_serial: return true;  // a line at rest
    case Tag::ssr: return (ssr_rate_ & ssr::rate_enable) != 0 && bit(ssr_data_, pin.number - 1U);
    case Tag::outm: return bit(outm_data_, pin.number - 1U) != 0;
    default: return false;
    }
}

bool EmulatedCard::outside_level(std::size_t pin) const noexcept {
    const PinDescriptor is = descriptor(pin);
    if (is.is_output) return outside_[pin];
    if (is.module == Tag::inm) return bit(inm_inputs_, is.number - 1U) != 0;
    const bool is_muxed = is.module == Tag::muxed_encoder;
    if (is.module != Tag::encoder && !is_muxed) return outside_[pin];
    if (is.number > pin_number::encoder::index) return outside_[pin];
    // of two multiplexed encoders a reading shows the first
    const unsigned unit = is_muxed ? is.unit * 2U : is.unit;
    if (!plant_.has_encoder(unit)) return outside_[pin];
    const QuadratureCounter& counter = counters_[unit].counter;
    if (is.number == pin_number::encoder::a) return counter.input_a();
    if (is.number == pin_number::encoder::b) return counter.input_b();
    return counter.input_index();
}

bool EmulatedCard::level(std::size_t pin) const noexcept {
    if (!is_output(pin)) return outside_level(pin);
    const Port& port = ports_[pin / model_.pins];
    const auto n = static_cast<unsigned>(pin % model_.pins);
    const bool driven =
        bit(port.source, n) != 0 ? module_level(descriptor(pin)) : bit(port.data, n) != 0;
    const bool out = driven != (bit(port.invert, n) != 0);
    return bit(port.open_drain, n) != 0 ? out && outside_level(pin) : out;
}

bool EmulatedCard::has_terminal_level(const Terminal& terminal) const noexcept {
    const auto module_output = [&](Tag tag) {
        const std::size_t pin = find_output(tag, 0, terminal.number + 1U);
        return pin != no_pin && is_driven_by_module(pin) && level(pin);
    };
    switch (terminal.kind) {
    case Terminal::Kind::gpio: return is_output(terminal.number) && level(terminal.number);
    case Terminal::Kind::ssr: return module_output(Tag::ssr);
    case Terminal::Kind::outm: return module_output(Tag::outm);
    default: return false;
    }
}

bool EmulatedCard::output(std::size_t output) const noexcept {
    const Terminal& terminal = config_.outputs[output].terminal;
    if (terminal.kind != Terminal::Kind::remote) return has_terminal_level(terminal);
    const Remote7i76* const remote = serial_.remote(terminal.channel);
    return remote != nullptr && bit(remote->outputs(), terminal.number) != 0;
}

// --- Registers

EmulatedCard::Place EmulatedCard::find(std::uint16_t address) const noexcept {
    for (const Module& module : modules_) {
        const unsigned stride = module.addresses.register_stride;
        if (address < module.addresses.base) continue;
        const unsigned offset = address - module.addresses.base;
        Place place{module.descriptor.tag, offset / stride};
        if (place.reg >= module.registers) continue;
        place.instance = offset % stride / module.addresses.instance_stride;
        place.channel = offset % module.addresses.instance_stride / 4;
        if (place.instance < module.descriptor.instances) return place;
    }
    return {};
}

std::uint32_t EmulatedCard::read(std::uint16_t address) noexcept {
    address &= 0xfffc;
    const Place place = find(address);
    if (place.tag != Tag::none) return read_module(place);
    if (address + 4U > rom_.size()) return 0;
    const auto value = load<std::uint32_t>(rom_.data() + address);
    return cookie_is_wrong_ && address == cookie_address ? ~value : value;
}

void EmulatedCard::write(std::uint16_t address, std::uint32_t value) noexcept {
    const Place place = find(address & 0xfffcU);
    if (place.tag != Tag::none) {
        write_module(place, value);
    }
}

std::uint32_t EmulatedCard::read_module(const Place& at) noexcept {
    switch (at.tag) {
    case Tag::watchdog: return watchdog_.read(at.reg);
    case Tag::ioport: return read_port(at.reg, at.instance);
    case Tag::stepgen: return read_stepgen(at.reg, at.instance);
    case Tag::encoder:
    case Tag::muxed_encoder: return read_encoder(at.reg, at.instance);
    case Tag::three_phase_pwm: return read_bridge(at.reg, at.instance);
    case Tag::pwm: return read_pwm(at.reg, at.instance);
    case Tag::dpll: return phase_loop_.read(at.reg);
    case Tag::smart_serial: return serial_.read(at.reg, at.channel);
    case Tag::ssr: return at.reg == ssr::data ? ssr_data_ : ssr_rate_;
    case Tag::outm: return outm_data_;
    case Tag::led: return leds_;
    case Tag::inm:
    case Tag::inmux: return read_inputs(at.reg);
    default: return 0;
    }
}

void EmulatedCard::write_module(const Place& at, std::uint32_t value) noexcept {
    switch (at.tag) {
    case Tag::watchdog: watchdog_.write(at.reg, value, clock_); break;
    case Tag::ioport: write_port(at.reg, at.instance, value); break;
    case Tag::stepgen: write_stepgen(at.reg, at.instance, value); break;
    case Tag::encoder:
    case Tag::muxed_encoder: write_encoder(at.reg, at.instance, value); break;
    case Tag::three_phase_pwm: write_bridge(at.reg, at.instance, value); break;
    case Tag::pwm: write_pwm(at.reg, at.instance, value); break;
    case Tag::dpll: phase_loop_.write(at.reg, value); break;
    case Tag::smart_serial: serial_.write(at.reg, at.channel, value, now_ns()); break;
    case Tag::ssr: (at.reg == ssr::data ? ssr_data_ : ssr_rate_) = value; break;
    case Tag::outm: outm_data_ = value; break;
    case Tag::led: leds_ = value; break;
    case Tag::inm:
    case Tag::inmux: write_inputs(at.reg, value); break;
    default: break;
    }
}

std::uint32_t EmulatedCard::read_port(unsigned reg, unsigned port) const noexcept {
    const Port& of = ports_[port];
    switch (reg) {
    case ioport::data: {
        std::uint32_t levels = 0;
        for (unsigned n = 0; n < model_.pins; ++n) {
            levels |= level(std::size_t{port} * model_.pins + n) ? 1U << n : 0U;
        }
        return levels;
    }
    case ioport::direction: return of.direction;
    case ioport::source: return of.source;
    case ioport::open_drain: return of.open_drain;
    default: return of.invert;
    }
}

void EmulatedCard::write_port(unsigned reg, unsigned port, std::uint32_t value) noexcept {
    Port& of = ports_[port];
    std::uint32_t* const registers[] = {&of.data, &of.direction, &of.source, &of.open_drain,
                                        &of.invert};
    *registers[reg] = value;
}

std::uint32_t EmulatedCard::read_stepgen(unsigned reg, unsigned unit) const noexcept {
    const Generator& of = generators_[unit];
    switch (reg) {
    case stepgen::rate: return static_cast<std::uint32_t>(of.dds.rate());
    case stepgen::accumulator:
        return timer_of(stepgen_timer_) != 0 ? of.latched : of.dds.accumulator();
    case stepgen::mode: return of.latch.read();
    case stepgen::dpll_timer: return stepgen_timer_;
    default: return 0;
    }
}

void EmulatedCard::write_stepgen(unsigned reg, unsigned unit, std::uint32_t value) noexcept {
    Generator& of = generators_[unit];
    const std::uint32_t clocks = value & stepgen::max_time;
    switch (reg) {
    case stepgen::rate: of.dds.set_rate(static_cast<std::int32_t>(value)); break;
    case stepgen::accumulator: of.dds.set_accumulator(value); break;
    case stepgen::mode: of.latch.write(value); break;
    case stepgen::direction_setup: of.dds.times().setup = clocks; break;
    case stepgen::direction_hold: of.dds.times().hold = clocks; break;
    case stepgen::pulse_length: of.dds.times().length = clocks; break;
    case stepgen::pulse_space: of.dds.times().space = clocks; break;
    case stepgen::table_data: of.table_data = value; break;
    case stepgen::table_length: of.table_length = value; break;
    case stepgen::dpll_timer: stepgen_timer_ = value; break;
    default: break;
    }
}

std::uint32_t EmulatedCard::read_encoder(unsigned reg, unsigned unit) const noexcept {
    const Counter& of = counters_[unit];
    switch (reg) {
    case encoder::count:
        return timer_of(encoder_timer_) != 0 ? of.latched : of.counter.count_register();
    case encoder::control: return of.counter.control_register();
    case encoder::timestamp_divider: return timestamp_divider_;
    case encoder::timestamp: return timestamp(clock_);
    case encoder::filter: return filter_;
    default: return encoder_timer_;
    }
}

void EmulatedCard::write_encoder(unsigned reg, unsigned unit, std::uint32_t value) noexcept {
    switch (reg) {
    case encoder::control: counters_[unit].counter.write_control(value); break;
    case encoder::timestamp_divider: timestamp_divider_ = value & 0xffffU; break;
    case encoder::filter: filter_ = value; break;
    case encoder::dpll_timer: encoder_timer_ = value; break;
    default: break;
    }
}

std::uint32_t EmulatedCard::read_pwm(unsigned reg, unsigned unit) const noexcept {
    switch (reg) {
    case pwm::value: return pwm_values_[unit];
    case pwm::mode: return pwm_modes_[unit];
    case pwm::pwm_rate: return pwm_rate_;
    case pwm::pdm_rate: return pdm_rate_;
    default: return pwm_enables_;
    }
}

void EmulatedCard::write_pwm(unsigned reg, unsigned unit, std::uint32_t value) noexcept {
    switch (reg) {
    case pwm::value: pwm_values_[unit] = value; break;
    case pwm::mode: pwm_modes_[unit] = value; break;
    case pwm::pwm_rate: pwm_rate_ = value; break;
    case pwm::pdm_rate: pdm_rate_ = value; break;
    default: pwm_enables_ = value; break;
    }
}

std::uint32_t EmulatedCard::read_bridge(unsigned reg, unsigned unit) const noexcept {
    const BridgeDriver& of = bridges_[unit];
    switch (reg) {
    case three_phase_pwm::value: return of.value;
    case three_phase_pwm::enable: return of.enable();
    case three_phase_pwm::setup: return of.setup;
    default: return bridge_rate_;
    }
}

void EmulatedCard::write_bridge(unsigned reg, unsigned unit, std::uint32_t value) noexcept {
    BridgeDriver& of = bridges_[unit];
    switch (reg) {
    case three_phase_pwm::value: of.value = value; break;
    case three_phase_pwm::enable: of.write_enable(value); break;
    case three_phase_pwm::setup: of.setup = value; break;
    default: bridge_rate_ = value; break;
    }
    if (fault_pins_[unit] != no_pin) {
        of.sample(outside_[fault_pins_[unit]]);
    }
}

std::uint32_t EmulatedCard::read_inputs(unsigned reg) const noexcept {
    switch (reg) {
    case inm::control: return inm_control_;
    case inm::filter: return inm_filter_;
    case inm::counters: return 0;
    default: return inm_inputs_;
    }
}

void EmulatedCard::write_inputs(unsigned reg, std::uint32_t value) noexcept {
    if (reg == inm::control) {
        inm_control_ = (value & ~0x1fU) | (inm_control_ & 0x1fU);
    } else if (reg == inm::filter) {
        inm_filter_ = value;
    }
}

// --- Memory spaces

std::span<std::uint8_t> EmulatedCard::space(Space which) noexcept {
    switch (which) {
    case Space::eeprom: return eeprom_;
    case Space::timers:
        return config_.lbp_version >= 3 ? std::span<std::uint8_t>(timers_)
                                        : std::span<std::uint8_t>();
    case Space::status: return status_;
    case Space::card: return card_;
    default: return {};
    }
}

void EmulatedCard::count_packet() noexcept {
    ++requests_;
    if (counter_is_stuck_) return;
    for (const std::uint16_t at : {status::received_packets, status::received_udp}) {
        const auto count = load<std::uint16_t>(status_.data() + at);
        store(status_.data() + at, static_cast<std::uint16_t>(count + 1));
    }
}

std::size_t EmulatedCard::execute(std::span<const std::uint8_t> request,
                                  std::span<std::uint8_t> reply) noexcept {
    count_packet();
    RequestReader reader(request);
    Command command;
    std::span<const std::uint8_t> data;
    std::size_t size = 0;
    auto next = reader.next(command, data);
    for (; next == RequestReader::Next::command; next = reader.next(command, data)) {
        auto& last = last_address_[static_cast<std::size_t>(command.space)];
        if (!command.has_address) {
            command.address = last;
        }
        const std::size_t length = command.is_write ? 0 : command.data_size();
        if (size + length > reply.size()) break;
        execute(command, data, reply.subspan(size, length));
        size += length;
        last = static_cast<std::uint16_t>(command.address +
                                          (command.advances ? command.data_size() : 0));
    }
    if (next == RequestReader::Next::malformed) {
        const auto count = load<std::uint16_t>(status_.data() + status::parse_errors);
        store(status_.data() + status::parse_errors, static_cast<std::uint16_t>(count + 1));
    }
    return size;
}

void EmulatedCard::execute(const Command& command, std::span<const std::uint8_t> data,
                           std::span<std::uint8_t> reply) noexcept {
    if (command.information) {
        read_information(command.space, reply);
    } else if (command.space == Space::hostmot2) {
        if (command.is_write) {
            write_registers(command, data);
        } else {
            read_registers(command, reply);
        }
    } else if (command.is_write) {
        write_space(command, data);
    } else {
        read_space(command, reply);
    }
}

void EmulatedCard::read_registers(const Command& command, std::span<std::uint8_t> reply) noexcept {
    std::uint32_t word = 0;
    std::size_t word_at = SIZE_MAX;
    for (std::size_t n = 0; n < reply.size(); ++n) {
        const std::size_t offset = command.advances ? n : n % bytes_of(command.unit);
        const std::size_t address = command.address + offset;
        const std::size_t word_address = address & ~std::size_t{3};
        const bool is_next_unit = n % bytes_of(command.unit) == 0 && !command.advances;
        if (word_address != word_at || is_next_unit) {  // each register is read once
            word_at = word_address;
            word = read(static_cast<std::uint16_t>(word_address));
        }
        reply[n] = static_cast<std::uint8_t>(word >> 8 * (address & 3U));
    }
}

void EmulatedCard::write_registers(const Command& command,
                                   std::span<const std::uint8_t> data) noexcept {
    if (bytes_of(command.unit) < 4 || (command.address & 3U) != 0) return;  // words only
    std::uint32_t address = command.address;
    for (std::size_t n = 0; n + 4 <= data.size(); n += 4) {
        if (!command.advances && n % bytes_of(command.unit) == 0) {
            address = command.address;
        }
        write(static_cast<std::uint16_t>(address), load<std::uint32_t>(data.data() + n));
        address += 4;
    }
}

void EmulatedCard::read_space(const Command& command, std::span<std::uint8_t> reply) noexcept {
    const std::span<const std::uint8_t> bytes = space(command.space);
    if (command.space == Space::timers) {
        store(timers_.data() + timers::microseconds, static_cast<std::uint16_t>(now_ns() / 1000));
    }
    for (std::size_t n = 0; n < reply.size(); ++n) {
        const std::size_t at =
            command.address + (command.advances ? n : n % bytes_of(command.unit));
        reply[n] = at < bytes.size() ? bytes[at] : std::uint8_t{0};
    }
}

void EmulatedCard::write_space(const Command& command,
                               std::span<const std::uint8_t> data) noexcept {
    // EEPROM and flash need a key for each write, and drivers do not write them
    if (command.space != Space::timers && command.space != Space::status) return;
    const std::span<std::uint8_t> bytes = space(command.space);
    for (std::size_t n = 0; n < data.size(); ++n) {
        const std::size_t at =
            command.address + (command.advances ? n : n % bytes_of(command.unit));
        if (at < bytes.size()) {
            bytes[at] = data[n];
        }
    }
}

void EmulatedCard::read_information(Space which, std::span<std::uint8_t> reply) noexcept {
    struct Row {
        Information::Kind kind;
        bool is_writable;
        std::uint8_t units;
        std::string_view name;  ///< ours
    };
    using Kind = Information::Kind;
    static constexpr Row rows[] = {
        {Kind::memory, true, 0x4, "HostMot2"}, {Kind::registers, true, 0x2, "Ethernet"},
        {Kind::eeprom, true, 0x2, "EEPROM"},   {Kind::flash, true, 0x4, "Flash"},
        {Kind::memory, true, 0x2, "Timers"},   {Kind::memory, false, 0x0, "unused"},
        {Kind::memory, true, 0x2, "Status"},   {Kind::memory, false, 0x2, "Card"}};
    const Row& row = rows[static_cast<std::size_t>(which)];
    Information area;
    area.space = which;
    area.is_writable = row.is_writable;
    area.kind = row.kind;
    area.units = row.units;
    area.range = static_cast<std::uint16_t>(which == Space::hostmot2 ? std::size_t{0xffff}
                                                                     : space(which).size());
    area.pointer = last_address_[static_cast<std::size_t>(which)];
    std::ranges::copy(row.name, area.name.begin());
    const auto bytes = area.encode();
    std::fill(reply.begin(), reply.end(), std::uint8_t{0});
    std::copy_n(bytes.begin(), std::min(bytes.size(), reply.size()), reply.begin());
}

}  // namespace hal::mesa
