// SPDX-License-Identifier: MIT
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

constexpr std::uint32_t columns = 8;
constexpr std::uint32_t rows = 8;

struct SimMatrixKb : hal::Component {
    hal::Out<std::uint32_t> out{*this, "out",
                                "key code: 0xC0 + key when pressed, 0x80 + key when released"};
    std::array<std::optional<hal::In<bool>>, columns * rows> buttons;
    hal::Function run{*this, "", &SimMatrixKb::update, "encodes the buttons"};

    explicit SimMatrixKb(const hal_host* host) : Component(host) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            for (std::uint32_t row = 0; row < rows; ++row) {
                const std::string name =
                    "button.c0" + std::to_string(column) + ".r0" + std::to_string(row);
                buttons[row * columns + column].emplace(*this, name.c_str(),
                                                        "TRUE while this key is pressed");
            }
        }
    }

    void update(hal::Cycle) noexcept {
        std::uint64_t now = 0;
        for (std::uint32_t key = 0; key < buttons.size(); ++key) {
            if (*buttons[key]) {
                now |= std::uint64_t{1} << key;
            }
        }
        if (const std::uint64_t changed = now ^ reported_; changed != 0) {  // one change per cycle
            const auto key = static_cast<std::uint32_t>(__builtin_ctzll(changed));
            const std::uint64_t bit = std::uint64_t{1} << key;
            out = (now & bit ? 0xC0u : 0x80u) + key;
            reported_ ^= bit;
        } else {
            out = now != 0 ? 0x40u : 0u;
        }
    }

private:
    std::uint64_t reported_ = 0;
    hal::Retained retained_{*this, {{"reported", reported_}}};
};

}  // namespace

HAL_COMPONENT(SimMatrixKb, "sim_matrix_kb", "Simulated keypad controller with 8 by 8 keys", R"(
Simulates a keypad: each change of a button outputs a code for one cycle, 0xC0 + 8 row + column when
pressed, 0x80 + 8 row + column when released. Without a change the code is 0x40 while a key is
pressed, else 0. If several change in one cycle, their codes follow one per cycle, the lowest key
first.

    loadrt sim_matrix_kb names=pad
    addf pad servo
    net key-1  => pad.button.c00.r00
    net code   <= pad.out
)")
