// SPDX-License-Identifier: MIT
// Frequency converters: which registers command and read them. One table for the master, the
// emulated slaves and the page. Everything here is [setup].
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace hal::modbus {

/// Where a value of a slave is.
enum class Table : std::uint8_t {
    none,
    coil,
    discrete,
    holding,
    input,
    huanyang,  ///< of the first Huanyang dialect: a value by its index, or a function to write
};
const char* to_string(Table);
constexpr bool is_bits(Table table) { return table == Table::coil || table == Table::discrete; }
/// Returns whether the master can write there.
constexpr bool is_writable(Table table) {
    return table == Table::coil || table == Table::holding || table == Table::huanyang;
}

/// A write with a fixed value.
struct Write {
    Table table = Table::none;
    std::uint16_t address = 0;
    std::uint16_t value = 0;
};

/// A value that is read from a drive.
struct Reading {
    Table table = Table::none;
    std::uint16_t address = 0;
    double scale = 1.0;       ///< unit per count
    std::uint16_t mask = 0;   ///< of a bit or bits; 0: a number
    std::uint8_t words = 1;   ///< 2: the high word first
};

/// How the speed is read back.
enum class Feedback : std::uint8_t { frequency, rpm, share };

struct Profile {
    const char* name;
    const char* title;
    Write forward[2];
    Write reverse[2];
    Write stop[2];
    Write reset;  ///< table none: the drive is reset at its panel
    /// The set-point of the speed. `value` is what stands for full speed; 0: the frequency in
    /// `counts_per_hz`.
    Write speed;
    double counts_per_hz;
    bool speed_by_16;   ///< the speed is written by function 16, not 06
    bool one_telegram;  ///< command and speed are 32 coils that are written together
    Feedback feedback;
    Reading actual;   ///< Hz, rpm, or the share of full speed
    Reading load;     ///< per cent
    Reading running;  ///< table none: the actual speed is not 0
    Reading fault;    ///< any masked bit
    std::uint32_t gap_us;  ///< silence that the drive requires before a request
    const char* setup;     ///< what is set at the panel
    const char* ending;    ///< what `stop` does: "ramp", "coast"
};

std::span<const Profile> profiles();
/// Returns nullptr for an unknown name.
const Profile* find_profile(std::string_view name);
/// Returns the table of the page.
std::string profile_reference();
/// Returns "holding 0x2000 := 0x0001".
std::string write_text(const Write&);

}  // namespace hal::modbus
