// SPDX-License-Identifier: MIT
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>

#include "hal/naming.hpp"

namespace {

/// Parses config=: rows, columns, and whether to scan.
struct Config {
    explicit Config(const std::string& text) {
        char* end = nullptr;
        rows = std::strtol(text.c_str(), &end, 10);
        const bool by = *end == 'x' || *end == 'X';
        columns = by ? std::strtol(end + 1, &end, 10) : 0;
        scan = *end == 's' || *end == 'S';
        if (scan) ++end;
        if (*end != '\0' || rows < 1 || columns < 1 || rows > 32 || columns > 32)
            throw hal::ArgumentError("config", "config=" + text + " is not ROWSxCOLUMNS, each 1 to 32, with an s at the end to scan");
        if (rows * static_cast<long>(std::bit_ceil(static_cast<unsigned long>(columns))) > 64)
            throw hal::ArgumentError("config", "config=" + text + " has more than 64 keys, the limit of the key code");
    }
    long rows, columns;
    bool scan;
};

struct MatrixKb : hal::Component {
    hal::InstanceName instance_name{*this, "matrix_kb"};
    hal::TextArgument text{*this, "config", "4x8", "ROWSxCOLUMNS, with an s to scan inputs and outputs", {.per_instance = true}};
    const Config config{text.get()};

    const long stride_ = static_cast<long>(std::bit_ceil(static_cast<unsigned long>(config.columns)));  // of key numbers, per row
    std::array<std::optional<hal::Out<bool>>, 64> keys;  // by key number
    hal::Ins<std::uint32_t> code_in{*this, "keycode", config.scan ? 0 : 1, "code of the keypad: 0xC0 + key: down, 0x80 + key: up"};
    hal::Outs<std::uint32_t> code_out{*this, "keycode", config.scan ? 1 : 0, "code of the newest change: 0xC0 + key: down, 0x80 + key: up; otherwise 0x40"};
    hal::Ins<bool> column{*this, "col-##-in", config.scan ? config.columns : 0, "column ## of the keypad"};
    hal::Outs<bool> row{*this, "row-##-out", config.scan ? config.rows : 0, "row ## of the keypad"};
    hal::Params<std::uint32_t> rollover{*this, "key_rollover", config.scan ? 1 : 0, "maximum number of keys down at the same time", {.initial = 2}};
    hal::Params<bool> negative{*this, "negative-logic", config.scan ? 1 : 0, "TRUE: row and key are active FALSE", {.initial = true}};
    hal::Function run{*this, "", &MatrixKb::update, "decodes key codes or scans the keypad"};

    explicit MatrixKb(const hal_host* host) : Component(host) {
        for (long r = 0; r < config.rows; ++r)
            for (long c = 0; c < config.columns; ++c) {
                const std::string name = "key.r" + std::to_string(r) + "c" + std::to_string(c);
                keys[static_cast<std::size_t>(r * stride_ + c)].emplace(*this, name.c_str(), "TRUE while this key is down");
            }
    }

    void update(hal::Cycle) noexcept {
        if (!config.scan) return obey(code_in[0]);
        std::uint32_t code = 0x40;
        for (long c = 0; c < config.columns; ++c) {
            const auto key = static_cast<std::size_t>(driven_ * stride_ + c);
            const bool pressed = column[static_cast<std::size_t>(c)] != negative[0];
            const bool certain = pressed == seen_[key];  // equal in two scans: debounced
            seen_[key] = pressed;
            hal::Out<bool>& out = *keys[key];
            if (!certain || pressed == out || (pressed && down_ >= rollover[0])) continue;
            if (code != 0x40) continue;  // one change per cycle, so that each has its own code
            out = pressed;
            if (pressed) ++down_;
            else --down_;
            code = (pressed ? 0xC0u : 0x80u) + static_cast<std::uint32_t>(key);
        }
        code_out[0] = code;
        driven_ = (driven_ + 1) % config.rows;
        for (long r = 0; r < config.rows; ++r) row[static_cast<std::size_t>(r)] = (r == driven_) != negative[0];
    }

private:
    void obey(std::uint32_t code) noexcept {
        if ((code & ~0x7Fu) != 0x80u) return;  // neither up nor down
        if (auto& key = keys[code & 0x3Fu]) *key = (code & 0x40u) != 0;
    }
    std::array<bool, 64> seen_{};
    std::uint32_t down_ = 0;
    long driven_ = 0;
};

}  // namespace

HAL_COMPONENT(MatrixKb, "matrix_kb", "Keys of a keypad, from its key codes or by scanning rows and columns", R"(
`config=` has an element per keypad: rows, an x, columns.

Without s at the end the keypad has a controller: `keycode` 0xC0 + key sets the pin of the key, 0x80 + key clears it, other codes change
nothing. The number of a key is row * w + column, where w is the number of columns rounded up to a power of two.

With s the keypad is scanned: one row is driven per cycle, and the columns are read in the next. A key change is accepted if it is equal in two
scans. With `key_rollover` keys down, further keys are ignored, because most keypads then report ghost keys; increase it for keypads with
diodes. `negative-logic` is for inputs that are TRUE when open. Use a slow thread.

The default name of an instance is `matrix_kb.N`.

    loadrt matrix_kb config=4x4s names=pad
    addf pad slow
    net row-0 <= pad.row-00-out
    net col-0 => pad.col-00-in
    net start-key <= pad.key.r0c0
)")
