// SPDX-License-Identifier: MIT
// What a file NAME.mesa describes: an emulated card, and the machine that is connected to it.
// Everything here is [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mesa/card/card_model.hpp"
#include "text/config_text.hpp"

namespace hal::mesa {

/// Subject of a message: its diagnostic code.
enum class Topic : std::uint8_t {
    line,   ///< an invalid line, section or key
    value,  ///< an invalid value
    plant,  ///< parts of the machine that cannot work
};
const char* code_of(Topic);

/// A terminal of the card or of a device on its smart-serial port.
struct Terminal {
    enum class Kind : std::uint8_t { none, gpio, inm, inmux, ssr, outm, remote };
    Kind kind = Kind::none;
    std::uint8_t channel = 0;  ///< remote
    std::uint8_t number = 0;
    friend bool operator==(const Terminal&, const Terminal&) = default;
};

/// A motor behind a step generator.
struct MotorConfig {
    std::string name;
    text::Span at;
    unsigned stepgen = 0;
    double scale = 200.0;  ///< steps per unit of length; negative: the other direction
    double start = 0.0;    ///< position when the card gets power
    double min = -1e9, max = 1e9;  ///< mechanical stops: steps against them are lost
    std::optional<unsigned> encoder;
    double encoder_scale = 1000.0;  ///< edges per unit of length
    double index_every = 0.0;       ///< units of length; 0: no index
};

/// A switch that a motor closes.
struct SwitchConfig {
    std::string name;
    text::Span at;
    Terminal terminal;
    std::string motor;
    std::size_t motor_index = 0;
    std::optional<double> below, above;  ///< closed beyond these positions
    bool normally_closed = false;        ///< opens there
};

/// A spindle behind an analogue or PWM output.
struct SpindleConfig {
    std::string name;
    text::Span at;
    enum class Drive : std::uint8_t { pwm, remote };
    Drive drive = Drive::pwm;
    unsigned number = 0;  ///< PWM generator or channel
    double max_rpm = 24000.0;
    std::int64_t time_constant_ns = 200'000'000;
    std::optional<unsigned> encoder;
    std::uint32_t edges = 4096;  ///< per turn, with an index in each
};

/// A terminal with a name: a button, a lamp.
struct WireConfig {
    std::string name;
    text::Span at;
    Terminal terminal;
    bool initial = false;
};

struct CardConfig {
    std::string file;
    const CardModel* model = nullptr;
    std::string address;   ///< "sim:NAME", or where a process listens: "127.0.0.1", "HOST:PORT"
    std::string reported;  ///< name in memory space 7; empty: that of the model
    std::uint32_t idrom_type = 0;    ///< 0: that of the model
    std::uint16_t lbp_version = 3;
    std::optional<unsigned> stepgens, encoders, pwmgens;  ///< of another firmware: fewer
    std::optional<unsigned> three_phase_pwms, packet_uarts;  ///< the same: more than none
    std::optional<std::uint8_t> stepgen_version, encoder_version;
    std::uint8_t remotes = 0;        ///< bit n: a 7I76 on channel n
    std::vector<MotorConfig> motors;
    std::vector<SwitchConfig> switches;
    std::vector<SpindleConfig> spindles;
    std::vector<WireConfig> inputs, outputs;
    text::Span at;

    /// The instances of a module; 0: the card has none.
    unsigned instances(Tag tag) const;
    /// The kind of its encoders.
    Tag encoder_tag() const;
    /// The version of a module of the firmware.
    std::uint8_t version_of(const ModuleDescriptor& module) const;
};

struct CardReadResult {
    CardConfig card;
    std::vector<text::Message<Topic>> messages;
    bool good() const { return text::good(messages); }
};
/// Reads a configuration; `file` is its name in messages.
CardReadResult read_card(std::string_view text, const std::string& file);

/// Return the keys as tables in Markdown.
std::string card_reference();
std::string motor_reference();
std::string switch_reference();
std::string spindle_reference();
std::string wire_reference();

}  // namespace hal::mesa
