// SPDX-License-Identifier: MIT
// A Mesa card made of software: the registers of its modules, its memory spaces, and the machine
// behind its pins. Its time is what its user passes in; it has no thread and no clock.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesa/card/bridge_driver.hpp"
#include "mesa/card/card_config.hpp"
#include "mesa/card/phase_loop.hpp"
#include "mesa/card/plant.hpp"
#include "mesa/card/position_latch.hpp"
#include "mesa/card/quadrature_counter.hpp"
#include "mesa/card/serial_port.hpp"
#include "mesa/card/step_generator.hpp"
#include "mesa/card/watchdog_timer.hpp"
#include "mesa/hostmot2/pin.hpp"
#include "mesa/lbp16/packet.hpp"

namespace hal::mesa {

/// [realtime], except what is marked.
class EmulatedCard {
public:
    /// `config` outlives it. `mac` is that of the interface on which the card answers: drivers pin
    /// their ARP entry from it. [setup]
    EmulatedCard(const CardConfig& config, const std::array<std::uint8_t, 6>& mac);

    /// Lets time pass up to `now_ns`; the first call sets the time. Earlier times are ignored.
    void advance(std::int64_t now_ns) noexcept;
    /// Executes a request and returns the size of the reply; 0: no reply.
    std::size_t execute(std::span<const std::uint8_t> request,
                        std::span<std::uint8_t> reply) noexcept;
    /// A register of 32 bits.
    std::uint32_t read(std::uint16_t address) noexcept;
    void write(std::uint16_t address, std::uint32_t value) noexcept;

    /// The watchdog bites.
    void bite() noexcept;
    /// All encoders see A and B change at the same time.
    void fail_encoders() noexcept;
    /// All pins become inputs.
    void make_inputs() noexcept;
    /// The card loses its power and gets it back: all registers are reset, the machine stays.
    void reset() noexcept;
    void set_remotes_lost(bool lost) noexcept { serial_.set_lost(lost); }
    void set_cookie_wrong(bool wrong) noexcept { cookie_is_wrong_ = wrong; }
    void set_counter_stuck(bool stuck) noexcept { counter_is_stuck_ = stuck; }
    void set_input(std::size_t input, bool level) noexcept { inputs_[input] = level; }
    bool output(std::size_t output) const noexcept;

    const Plant& plant() const noexcept { return plant_; }
    const CardConfig& config() const noexcept { return config_; }
    std::uint64_t requests() const noexcept { return requests_; }
    bool has_bitten() const noexcept { return watchdog_.has_bitten(); }
    std::uint64_t bites() const noexcept { return bites_; }

private:
    static constexpr std::size_t max_units = 10;  ///< instances of a module
    static constexpr std::size_t max_ports = 3;
    struct Module {
        ModuleDescriptor descriptor;
        ModuleAddresses addresses;
        unsigned registers;  ///< more than the descriptor names: the selection of a DPLL timer
    };
    struct Place {
        Tag tag = Tag::none;
        unsigned reg = 0, instance = 0, channel = 0;
    };
    struct Port {
        std::uint32_t data = 0, direction = 0, source = 0, open_drain = 0, invert = 0;
    };
    /// An input that latches, and the switch on it.
    struct LatchInput {
        std::size_t pin = SIZE_MAX;
        std::optional<std::size_t> switch_index;  ///< of the motor of the step generator
        bool level = true;
    };
    struct Generator {
        StepGenerator dds;
        std::uint32_t table_data = 0, table_length = 0;
        std::uint32_t latched = 0;  ///< accumulator at the timer
        std::size_t step_pin = 0, direction_pin = 0;
        PositionLatch latch;  ///< and the mode
        LatchInput index, probe;
    };
    struct Counter {
        QuadratureCounter counter;
        std::uint32_t latched = 0;
        std::size_t probe_pin = SIZE_MAX;
    };
    /// The movement of a motor by the steps of a generator.
    struct Movement {
        std::int64_t from = 0, to = 0;  ///< of the motor
        std::int64_t steps = 0;  ///< of the generator
    };

    // Setup
    void fill_rom();
    void find_pins();

    // Time
    void run(std::int64_t clocks) noexcept;
    void move_motors(std::int64_t clocks) noexcept;
    bool drives_motor(const Generator& generator) const noexcept;
    void step_motor(unsigned unit, std::int64_t steps) noexcept;
    void follow_index(Generator& generator, std::size_t motor, const Movement& moved) noexcept;
    void follow_switch(Generator& generator, const Movement& moved) noexcept;
    void sample_latch_inputs() noexcept;
    void sample(Generator& generator, PositionLatch::Input which, LatchInput& input) noexcept;
    void command_spindles() noexcept;
    void turn_encoders(std::int64_t clocks) noexcept;
    void feed_inputs() noexcept;
    void latch(unsigned timers) noexcept;
    std::int64_t now_ns() const noexcept;
    std::uint16_t timestamp(std::int64_t clock) const noexcept;

    // Registers
    Place find(std::uint16_t address) const noexcept;
    std::uint32_t read_module(const Place& at) noexcept;
    void write_module(const Place& at, std::uint32_t value) noexcept;
    std::uint32_t read_port(unsigned reg, unsigned port) const noexcept;
    void write_port(unsigned reg, unsigned port, std::uint32_t value) noexcept;
    std::uint32_t read_stepgen(unsigned reg, unsigned unit) const noexcept;
    void write_stepgen(unsigned reg, unsigned unit, std::uint32_t value) noexcept;
    std::uint32_t read_encoder(unsigned reg, unsigned unit) const noexcept;
    void write_encoder(unsigned reg, unsigned unit, std::uint32_t value) noexcept;
    std::uint32_t read_pwm(unsigned reg, unsigned unit) const noexcept;
    void write_pwm(unsigned reg, unsigned unit, std::uint32_t value) noexcept;
    std::uint32_t read_bridge(unsigned reg, unsigned unit) const noexcept;
    void write_bridge(unsigned reg, unsigned unit, std::uint32_t value) noexcept;
    std::uint32_t read_inputs(unsigned reg) const noexcept;
    void write_inputs(unsigned reg, std::uint32_t value) noexcept;

    // Pins
    PinDescriptor descriptor(std::size_t pin) const noexcept;
    bool has_pin(const PinDescriptor& pin) const noexcept;
    void find_latch_inputs(unsigned unit);
    std::size_t find_input(Tag tag, unsigned unit, unsigned number) const noexcept;
    bool is_output(std::size_t pin) const noexcept;
    bool is_driven_by_module(std::size_t pin) const noexcept;
    bool level(std::size_t pin) const noexcept;
    bool module_level(const PinDescriptor& pin) const noexcept;
    bool outside_level(std::size_t pin) const noexcept;
    bool has_terminal_level(const Terminal& terminal) const noexcept;
    bool has_channel(unsigned channel) const noexcept;
    std::size_t find_output(Tag tag, unsigned unit, unsigned number) const noexcept;
    double pwm_command(unsigned unit) const noexcept;

    // Memory spaces
    void execute(const Command& command, std::span<const std::uint8_t> data,
                 std::span<std::uint8_t> reply) noexcept;
    void read_registers(const Command& command, std::span<std::uint8_t> reply) noexcept;
    void write_registers(const Command& command, std::span<const std::uint8_t> data) noexcept;
    std::span<std::uint8_t> space(Space which) noexcept;
    void read_space(const Command& command, std::span<std::uint8_t> reply) noexcept;
    void write_space(const Command& command, std::span<const std::uint8_t> data) noexcept;
    void read_information(Space which, std::span<std::uint8_t> reply) noexcept;
    void count_packet() noexcept;

    const CardConfig& config_;
    const CardModel& model_;
    Idrom idrom_;
    std::vector<Module> modules_;
    std::vector<std::uint8_t> rom_;  ///< space 0 below the modules
    Plant plant_;

    std::uint32_t clock_hz_;
    std::int64_t begin_ns_ = 0;
    std::int64_t clock_ = 0;  ///< clocks since begin_ns_
    bool has_time_ = false;

    std::array<Port, max_ports> ports_{};
    std::array<Generator, max_units> generators_{};
    std::array<Counter, max_units> counters_{};
    WatchdogTimer watchdog_;
    PhaseLoop phase_loop_;
    SerialPort serial_;
    std::uint32_t stepgen_timer_ = 0, encoder_timer_ = 0;
    std::uint32_t timestamp_divider_ = 0, filter_ = 0;
    std::array<std::uint32_t, max_units> pwm_values_{}, pwm_modes_{};
    std::array<std::size_t, max_units> pwm_pins_{};
    std::uint32_t pwm_rate_ = 0, pdm_rate_ = 0, pwm_enables_ = 0;
    std::uint32_t ssr_data_ = 0, ssr_rate_ = 0, outm_data_ = 0, leds_ = 0;
    std::array<BridgeDriver, max_units> bridges_{};
    std::array<std::size_t, max_units> fault_pins_{};
    std::uint32_t bridge_rate_ = 0;
    std::uint32_t inm_control_ = 0, inm_filter_ = 0, inm_inputs_ = 0;  ///< of InM or InMux

    std::vector<bool> inputs_;  ///< levels of the inputs of the configuration
    std::vector<bool> outside_;  ///< levels that the machine puts on the pins
    std::array<std::uint8_t, 0x80> eeprom_{}, timers_{}, status_{}, card_{};
    std::array<std::uint16_t, 8> last_address_{};  ///< where a command without address goes on
    std::uint64_t requests_ = 0, bites_ = 0;
    bool cookie_is_wrong_ = false, counter_is_stuck_ = false;
};

}  // namespace hal::mesa
