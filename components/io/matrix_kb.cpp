// SPDX-License-Identifier: MIT
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>

#include "hal/naming.hpp"
#include "hal/retained.hpp"

namespace {

/// Parses config=: rows, columns, and whether to scan.
struct Config {
    explicit Config(const std::string& text) {
        char* end = nullptr;
        rows = std::strtol(text.c_str(), &end, 10);
        const bool by = *end == 'x' || *end == 'X';
        columns = by ? std::strtol(end + 1, &end, 10) : 0;
        scan = *end == 's' || *end == 'S';
        if (scan) {
            ++end;
        }
        if (*end != '\0' || rows < 1 || columns < 1 || rows > 32 || columns > 32) {
            throw hal::ArgumentError(
                "config", "config=" + text +
                              " is not ROWSxCOLUMNS, each 1 to 32, with an s at the end to scan");
        }
        if (rows * static_cast<long>(
                       std::bit_ceil(static_cast<unsigned long>(std::max(columns, 2L)))) >
            64) {
            throw hal::ArgumentError(
                "config", "config=" + text + " has more than 64 keys, the limit of the key code");
        }
    }
    long rows, columns;
    bool scan;
};

struct MatrixKb : hal::Component {
    hal::InstanceName instance_name{*this, "matrix_kb"};
    hal::TextArgument text{*this,
                           "config",
                           "4x8",
                           "ROWSxCOLUMNS, with an s to scan inputs and outputs",
                           {.per_instance = true}};
    const Config config{text.get()};

    // of key numbers, per row
    const long stride_ =
        static_cast<long>(std::bit_ceil(static_cast<unsigned long>(std::max(config.columns, 2L))));
    std::array<std::optional<hal::Out<bool>>, 64> keys;  // by key number
    hal::Ins<std::uint32_t> code_in{*this, "keycode", config.scan ? 0 : 1,
                                    "code of the keypad: 0xC0 + key: down, 0x80 + key: up"};
    hal::Outs<std::uint32_t> code_out{
        *this, "keycode", config.scan ? 1 : 0,
        "code of the newest change: 0xC0 + key: down, 0x80 + key: up; otherwise 0x40"};
    hal::Ins<bool> column{*this, "col-##-in", config.scan ? config.columns : 0,
                          "column ## of the keypad"};
    hal::Outs<bool> row{*this, "row-##-out", config.scan ? config.rows : 0, "row ## of the keypad"};
    hal::Params<std::uint32_t> rollover{*this,
                                        "key_rollover",
                                        config.scan ? 1 : 0,
                                        "maximum number of keys down at the same time",
                                        {.initial = 2}};
    hal::Params<bool> negative{*this,
                               "negative-logic",
                               config.scan ? 1 : 0,
                               "TRUE: row and key are active FALSE",
                               {.initial = true}};
    hal::Function run{*this, "", &MatrixKb::update, "decodes key codes or scans the keypad"};

    explicit MatrixKb(const hal_host* host) : Component(host) {
        for (long r = 0; r < config.rows; ++r) {
            for (long c = 0; c < config.columns; ++c) {
                const std::string name = "key.r" + std::to_string(r) + "c" + std::to_string(c);
                keys[static_cast<std::size_t>(r * stride_ + c)].emplace(
                    *this, name.c_str(), "TRUE while this key is down");
            }
        }
    }

    void update(hal::Cycle) noexcept {
        if (!config.scan) return obey(code_in[0]);
        scan();
        const auto driven = static_cast<std::size_t>(driven_);
        row[driven] = negative[0].get();
        driven_ = (driven_ + 1) % config.rows;
        row[static_cast<std::size_t>(driven_)] = !negative[0];
    }

private:
    /// Reads the columns of the driven row. A state counts when it is equal in two scans.
    void scan() noexcept {
        std::uint32_t pressed = 0;
        for (std::size_t c = 0; c < column.size(); ++c) {
            if (column[c] != negative[0]) {
                pressed |= std::uint32_t{1} << c;
            }
        }
        Row& seen = seen_[static_cast<std::size_t>(driven_)];
        const std::uint32_t changes = pressed == seen.newest ? pressed ^ seen.older : 0;
        seen = {.newest = pressed, .older = seen.newest};

        code_out[0] = 0x40;
        for (std::size_t c = 0; c < column.size(); ++c) {
            const std::uint32_t bit = std::uint32_t{1} << c;
            if ((changes & bit) != 0) {
                change(static_cast<std::size_t>(driven_ * stride_) + c, (pressed & bit) != 0);
            }
        }
    }

    void change(std::size_t key, bool pressed) noexcept {
        code_out[0] = (pressed ? 0xC0u : 0x80u) + static_cast<std::uint32_t>(key);
        if (pressed && down_ >= rollover[0]) return;
        if (pressed) {
            ++down_;
        }
        if (!pressed && down_ > 0) {
            --down_;
        }
        *keys[key] = pressed;
    }

    void obey(std::uint32_t code) noexcept {
        if ((code & ~0x7Fu) != 0x80u) {
            return;  // neither up nor down
        }
        if (auto& key = keys[code & 0x3Fu]) {
            *key = (code & 0x40u) != 0;
        }
    }
    /// The columns of a row in the last two scans, a bit per column.
    struct Row {
        std::uint32_t newest = 0;
        std::uint32_t older = 0;
    };
    std::array<Row, 32> seen_{};
    std::uint32_t down_ = 0;
    long driven_ = 0;
    hal::Retained retained_{*this, {{"seen", seen_}, {"down", down_}, {"driven", driven_}}};
};

}  // namespace

HAL_COMPONENT(MatrixKb, "matrix_kb",
              "Keys of a keypad, from its key codes or by scanning rows and columns", R"(
`config=` has an element per keypad: rows, an x, columns.

Without s at the end the keypad has a controller: `keycode` 0xC0 + key sets the pin of the key, 0x80 + key clears it, other codes change
nothing. The number of a key is row * w + column, where w is the number of columns rounded up to a power of two, at least 2.

With s the keypad is scanned: one row is driven per cycle, and the columns are read in the next. A
key change is accepted if it is equal in two scans. When several keys of a row change, `keycode` has
the last one. With `key_rollover` keys down, further keys are ignored, because most keypads then
report ghost keys; increase it for keypads with diodes. `negative-logic` is for inputs that are TRUE
when open. Use a slow thread.

The default name of an instance is `matrix_kb.N`.

    loadrt matrix_kb config=4x4s names=pad
    addf pad slow
    net row-0 <= pad.row-00-out
    net col-0 => pad.col-00-in
    net start-key <= pad.key.r0c0
)")
