// SPDX-License-Identifier: MIT
#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "hal/naming.hpp"

namespace {

using Value =
    std::variant<hal::In<double>, hal::In<std::int32_t>, hal::In<std::uint32_t>, hal::In<bool>>;

/// A part of a page: a character, the end of a line, or a value.
struct Item {
    char kind = '\0';  // '\0' character, '\n' end of line, else the letter of the format
    char character = ' ';
    char other = ' ';
    bool zeros = false;
    bool plus = false;
    unsigned width = 0;
    unsigned precision = 4;
    const Value* value = nullptr;
};

/// The characters of one item, in fixed memory.
struct Text {
    static constexpr unsigned capacity = 24;
    void clear() noexcept { length = 0; }
    void add(char c) noexcept {
        if (length < capacity) {
            characters[length++] = c;
        }
    }
    std::array<char, capacity> characters{};
    unsigned length = 0;
};

/// Formats a magnitude in `base`, with its sign and `decimals` digits after the separator, in the
/// width of the item; asterisks if it does not fit.
void number(Text& text, const Item& item, std::uint64_t magnitude, bool negative, unsigned base,
            unsigned decimals, char separator) noexcept {
    std::array<char, Text::capacity> digits{};  // the last one first
    unsigned count = 0;
    while (count < digits.size() &&
           (magnitude != 0 || count < decimals + (decimals > 0 ? 2u : 1u))) {
        if (decimals > 0 && count == decimals) {
            digits[count++] = separator;
            continue;
        }
        digits[count++] = "0123456789ABCDEF"[magnitude % base];
        magnitude /= base;
    }
    const char plus = item.plus ? '+' : '\0';
    const char sign = negative ? '-' : plus;
    const unsigned needed = count + (sign ? 1u : 0u);
    const unsigned width = item.width != 0 ? item.width : needed;
    if (magnitude != 0 || needed > width || needed > Text::capacity) {
        for (unsigned i = 0; i < std::max(width < Text::capacity ? width : 1u, 1u); ++i) {
            text.add('*');
        }
        return;
    }
    if (sign && item.zeros) {
        text.add(sign);
    }
    for (unsigned i = needed; i < width; ++i) {
        text.add(item.zeros ? '0' : ' ');
    }
    if (sign && !item.zeros) {
        text.add(sign);
    }
    while (count > 0) {
        text.add(digits[--count]);
    }
}

void real(Text& text, const Item& item, double value, char separator) noexcept {
    double scaled = std::fabs(value);
    for (unsigned i = 0; i < item.precision; ++i) {
        scaled *= 10.0;
    }
    scaled = std::floor(scaled + 0.5);
    const bool possible = scaled < 1e18;  // false for NaN, too
    const std::uint64_t magnitude = possible ? static_cast<std::uint64_t>(scaled) : UINT64_MAX;
    number(text, item, magnitude, std::signbit(value) && scaled != 0.0, 10, item.precision,
           separator);
}

struct Lcd : hal::Component {
    hal::InstanceName instance_name{*this, "lcd", 2};
    hal::TextArgument format{*this,
                             "fmt_strings",
                             "%f",
                             "text, with | between pages; one element per display",
                             {.per_instance = true}};
    hal::Out<std::uint32_t> out{*this, "out", "byte to send; 0: none"};
    hal::In<std::uint32_t> page_number{*this, "page_num",
                                       "page to show; an invalid number shows an empty page"};
    hal::In<double> contrast{*this, "contrast", "contrast, 0..1; sent when it changes"};
    hal::Param<std::uint32_t> separator{
        *this, "decimal-separator", "character between units and decimals", {.initial = '.'}};
    hal::Function run{*this, "", &Lcd::update, "outputs the next byte", {.shared = true}};

    explicit Lcd(const hal_host* host) : Component(host) { read_format(format.get()); }

    void update(hal::Cycle) noexcept {
        if (waited_ < quiet) {
            ++waited_;
            out = 0;
            return;
        }
        if (control_.empty() && page_ != page_number) {
            show(page_number);
        }
        if (control_.empty() && at_ >= text_.length) {
            render();
        }
        if (!control_.empty()) {
            out = static_cast<unsigned char>(control_.front());
            control_.remove_prefix(1);
        } else {
            out = at_ < text_.length ? static_cast<unsigned char>(text_.characters[at_++]) : 0u;
        }
    }

private:
    static constexpr int quiet = 100;  // cycles for the display to start
    static constexpr std::string_view begin{"\r\n\x18\r\n\x18\r\n\x18\r\n\x18\x11\x11\x1e\x1a"};

    static constexpr std::string_view clear_screen{"\x11\x1e\x1a"};
    static constexpr std::string_view end_of_line{"\x18\n\r"};
    static constexpr std::string_view to_top{"\0\x1b=  ", 5};

    void show(std::uint32_t page) noexcept {
        page_ = page;
        item_ = 0;
        at_ = 0;
        text_.clear();
        control_ = clear_screen;
    }

    /// The next item of the page, or what stands between two rounds of it.
    void render() noexcept {
        at_ = 0;
        text_.clear();
        if (item_ == 0) {
            const double wanted =
                std::isfinite(contrast) ? std::clamp(contrast.get(), 0.0, 1.0) : contrast_;
            if (wanted != contrast_) {
                contrast_ = wanted;
                contrast_code_[2] =
                    static_cast<char>(0x20 + static_cast<int>(wanted * (0xBF - 0x20)));
                control_ = {contrast_code_.data(), contrast_code_.size()};
                return;
            }
        }
        const std::size_t count = page_ < pages_.size() ? pages_[page_].size() : 0;
        if (item_ >= count) {
            item_ = 0;
            control_ = to_top;
            return;
        }
        const Item& item = pages_[page_][item_++];
        if (item.kind == '\n') {
            control_ = end_of_line;
        } else {
            write(item);
        }
    }

    void write(const Item& item) noexcept {
        const char dot = static_cast<char>(separator & 0xFFu);
        switch (item.kind) {
        case 'f': real(text_, item, std::get<0>(*item.value), dot); break;
        case 'd': {
            const std::int64_t value = std::get<1>(*item.value);
            number(text_, item, static_cast<std::uint64_t>(value < 0 ? -value : value), value < 0,
                   10, 0, dot);
            break;
        }
        case 'u': number(text_, item, std::get<2>(*item.value), false, 10, 0, dot); break;
        case 'x': number(text_, item, std::get<2>(*item.value), false, 16, 0, dot); break;
        case 'o': number(text_, item, std::get<2>(*item.value), false, 8, 0, dot); break;
        case 'c': {
            const std::uint32_t code = std::get<2>(*item.value);
            for (unsigned i = 0; code >= 32 && code < 256 && i < std::max(item.width, 1u); ++i) {
                text_.add(static_cast<char>(code));
            }
            break;
        }
        case 'b': text_.add(std::get<3>(*item.value) ? item.character : item.other); break;
        default: text_.add(item.character);
        }
    }

    // ---- the format, read once

    void read_format(const std::string& all) {
        pages_.emplace_back();
        for (std::size_t i = 0; i < all.size();) {
            const char c = all[i++];
            if (c == '|') {
                pages_.emplace_back();
            } else if (c == '%') {
                read_value(all, i);
            } else if (c == '\\' && i < all.size() && all[i] == 'n') {
                ++i;
                pages_.back().push_back({.kind = '\n'});
            } else if (c == '\\' && i < all.size() && all[i] == 't') {
                ++i;
                pages_.back().insert(pages_.back().end(), 4, Item{});
            } else {
                pages_.back().push_back({.character = c == '\\' ? escaped(all, i) : c});
            }
        }
    }

    /// Parses the text after a backslash: two hexadecimal digits, or the character itself.
    static char escaped(const std::string& all, std::size_t& i) {
        const std::string digits = all.substr(i, 2);
        if (digits.size() == 2 &&
            digits.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos) {
            i += 2;
            return static_cast<char>(std::stoi(digits, nullptr, 16));
        }
        if (i >= all.size()) {
            throw std::invalid_argument(
                "fmt_strings ends with a single backslash; write \\\\ for the character");
        }
        return all[i++];
    }

    static unsigned digits(const std::string& all, std::size_t& i, unsigned max) {
        unsigned value = 0;
        for (; i < all.size() && all[i] >= '0' && all[i] <= '9'; ++i) {
            value = std::min(value * 10 + static_cast<unsigned>(all[i] - '0'), max);
        }
        return value;
    }

    void read_value(const std::string& all, std::size_t& i) {
        const std::size_t start = i - 1;
        Item item;
        for (; i < all.size() && (all[i] == ' ' || all[i] == '0' || all[i] == '+'); ++i) {
            if (all[i] == '0') {
                item.zeros = true;
            }
            if (all[i] == '+') {
                item.plus = true;
            }
        }
        item.width = digits(all, i, 20);
        if (i < all.size() && all[i] == '.') {
            item.precision = digits(all, ++i, 14);
        }
        const char letter = i < all.size() ? all[i++] : '\0';
        if (letter == '%') {
            return pages_.back().push_back({.character = '%'});
        }
        switch (letter) {
        case 'f':
        case 'F':
            item.kind = 'f';
            item.value = pin<0>();
            break;
        case 'i':
        case 'd':
            item.kind = 'd';
            item.value = pin<1>();
            break;
        case 'u':
        case 'o':
        case 'c':
            item.kind = letter;
            item.value = pin<2>();
            break;
        case 'x':
        case 'X':
            item.kind = 'x';
            item.value = pin<2>();
            break;
        case 'b':
            item.kind = 'b';
            for (char* choice : {&item.character, &item.other}) {
                if (i >= all.size()) {
                    throw std::invalid_argument(
                        "fmt_strings: %b must be followed by two characters, for TRUE and for "
                        "FALSE");
                }
                const char c = all[i++];
                *choice = c == '\\' ? escaped(all, i) : c;
            }
            item.value = pin<3>();
            break;
        default:
            throw std::invalid_argument(
                "fmt_strings: '" + all.substr(start, i - start) +
                "' is not a valid format; it must end with one of f d i u x o c b");
        }
        pages_.back().push_back(item);
    }

    template <std::size_t Type>
    const Value* pin() {
        const auto two = [](std::size_t n) { return (n < 10 ? "0" : "") + std::to_string(n); };
        if (pins_on_page_.size() < pages_.size()) {
            pins_on_page_.resize(pages_.size());
        }
        const std::string name =
            "page." + two(pages_.size() - 1) + ".arg." + two(pins_on_page_.back()++);
        return &values_.emplace_back(std::in_place_index<Type>, *this, name.c_str(),
                                     "value to show");
    }

    std::vector<std::vector<Item>> pages_;
    std::deque<Value> values_;  // pins must not move
    std::vector<std::size_t> pins_on_page_;

    int waited_ = 0;
    std::string_view control_ = begin;  // sent first
    std::uint32_t page_ = 0;
    std::size_t item_ = 0;
    unsigned at_ = 0;
    Text text_;
    double contrast_ = 0.0;
    std::array<char, 3> contrast_code_{'\x1b', 'C', ' '};
};

}  // namespace

HAL_COMPONENT(Lcd, "lcd", "Text and values for a character display, a byte per cycle", R"(
`fmt_strings=` has a text per display. Each `%` format in it, as in C's printf, creates a pin `page.PP.arg.NN`:

| format | pin | shows |
| --- | --- | --- |
| %f | float | a number, with 4 decimals by default |
| %d %i | s32 | an integer |
| %u %x %o | u32 | an integer: decimal, hexadecimal, octal |
| %c | u32 | the character with this code, repeated to the width |
| %bYN | bit | the first character when TRUE, the second when FALSE |

Between % and the letter may be 0 (leading zeros), + (always a sign), the width including sign and separator, and `.N` decimals. NaN and values that do
not fit the width are shown as asterisks. `\n` ends a line, `\t` is four spaces, `\NN` the character with this hexadecimal
code, `\\` a backslash and `%%` a percent sign; `|` starts the next page, a comma (`\2C`) the text of the next display.

The bytes are those of an ADM-3 terminal, as for the Mesa 7I73. After a start-up of 100 cycles the page is sent repeatedly from the
top. Default names are `lcd.00`, `lcd.01` …

    loadrt lcd fmt_strings="X %+9.3f|Feed %5d" names=panel
    addf lcd slow
    net x-pos   => panel.page.00.arg.00
    net screen  => panel.page_num
    net display <= panel.out
)")
