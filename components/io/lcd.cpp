// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <iterator>
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
    void add(char c, unsigned count = 1) noexcept {
        for (; count > 0 && length < capacity; --count) {
            characters[length++] = c;
        }
    }
    void add(std::string_view text) noexcept {
        for (const char c : text) {
            add(c);
        }
    }
    std::array<char, capacity> characters{};
    unsigned length = 0;
};

/// The digits of a number, the last one first, in fixed memory.
struct Digits {
    std::array<char, Text::capacity> characters{};
    unsigned count = 0;
    bool complete = true;  // the number has no more digits

    /// Formats a magnitude in `base` with `decimals` digits after the separator.
    Digits(std::uint64_t magnitude, unsigned base, unsigned decimals, char separator) noexcept {
        const unsigned at_least = decimals > 0 ? decimals + 2 : 1;
        while (count < characters.size() && (magnitude != 0 || count < at_least)) {
            if (decimals > 0 && count == decimals) {
                characters[count++] = separator;
            } else {
                characters[count++] = "0123456789ABCDEF"[magnitude % base];
                magnitude /= base;
            }
        }
        complete = magnitude == 0;
    }
};

/// Writes a number with its sign in the width of the item; asterisks if it does not fit.
void number(Text& text, const Item& item, const Digits& digits, bool negative) noexcept {
    const std::string_view plus = item.plus ? "+" : "";
    const std::string_view sign = negative ? "-" : plus;
    const unsigned needed = digits.count + static_cast<unsigned>(sign.size());
    const unsigned width = item.width != 0 ? item.width : needed;
    if (!digits.complete || needed > std::min(width, Text::capacity)) {
        return text.add('*', width < Text::capacity ? width : 1);
    }
    if (item.zeros) {
        text.add(sign);
        text.add('0', width - needed);
    } else {
        text.add(' ', width - needed);
        text.add(sign);
    }
    for (unsigned i = digits.count; i-- > 0;) {
        text.add(digits.characters[i]);
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
    number(text, item, Digits(magnitude, 10, item.precision, separator),
           std::signbit(value) && scaled != 0.0);
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
        if (item_ == 0 && contrast_changes()) {
            control_ = {contrast_code_.data(), contrast_code_.size()};
            return;
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

    /// Follows the pin; returns whether a new code is to be sent.
    bool contrast_changes() noexcept {
        const double before = contrast_;
        if (std::isfinite(contrast)) {
            contrast_ = std::clamp(contrast.get(), 0.0, 1.0);
        }
        contrast_code_[2] = static_cast<char>(0x20 + static_cast<int>(contrast_ * (0xBF - 0x20)));
        return contrast_ != before;
    }

    void write(const Item& item) noexcept {
        const char dot = static_cast<char>(separator & 0xFFu);
        switch (item.kind) {
        case 'f': return real(text_, item, std::get<0>(*item.value), dot);
        case 'd': {
            const std::int64_t value = std::get<1>(*item.value);
            const auto magnitude = static_cast<std::uint64_t>(std::abs(value));
            return number(text_, item, Digits(magnitude, 10, 0, dot), value < 0);
        }
        case 'u': return write_unsigned(item, 10);
        case 'x': return write_unsigned(item, 16);
        case 'o': return write_unsigned(item, 8);
        case 'c': return write_character(item);
        case 'b': return text_.add(std::get<3>(*item.value) ? item.character : item.other);
        default: return text_.add(item.character);
        }
    }
    void write_unsigned(const Item& item, unsigned base) noexcept {
        number(text_, item, Digits(std::get<2>(*item.value), base, 0, ' '), false);
    }
    void write_character(const Item& item) noexcept {
        const std::uint32_t code = std::get<2>(*item.value);
        if (code >= 32 && code < 256) {
            text_.add(static_cast<char>(code), std::max(item.width, 1u));
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
            } else if (c == '\\') {
                read_escape(all, i);
            } else {
                pages_.back().push_back({.character = c});
            }
        }
    }

    /// Appends what the text after a backslash stands for.
    void read_escape(const std::string& all, std::size_t& i) {
        auto& page = pages_.back();
        if (all[i] == 'n') {
            ++i;
            page.push_back({.kind = '\n'});
        } else if (all[i] == 't') {
            ++i;
            page.insert(page.end(), 4, Item{});
        } else {
            page.push_back({.character = escaped(all, i)});
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
        for (; all[i] >= '0' && all[i] <= '9'; ++i) {
            value = std::min(value * 10 + static_cast<unsigned>(all[i] - '0'), max);
        }
        return value;
    }

    void read_value(const std::string& all, std::size_t& i) {
        struct Format {
            std::string_view letters;
            char kind;  // of the item; '\0': the letter
            const Value* (Lcd::*pin)();
        };
        static constexpr Format formats[] = {{"fF", 'f', &Lcd::pin<0>},
                                             {"id", 'd', &Lcd::pin<1>},
                                             {"uoc", '\0', &Lcd::pin<2>},
                                             {"xX", 'x', &Lcd::pin<2>},
                                             {"b", 'b', &Lcd::pin<3>}};
        const std::size_t start = i - 1;
        Item item;
        const std::size_t end_of_flags = std::min(all.find_first_not_of(" 0+", i), all.size());
        const std::string flags = all.substr(i, end_of_flags - i);
        item.zeros = flags.find('0') != std::string::npos;
        item.plus = flags.find('+') != std::string::npos;
        i = end_of_flags;
        item.width = digits(all, i, 20);
        if (all[i] == '.') {
            item.precision = digits(all, ++i, 14);
        }
        const char letter = i < all.size() ? all[i++] : '\0';
        if (letter == '%') {
            return pages_.back().push_back({.character = '%'});
        }
        const auto* const row = std::ranges::find_if(
            formats, [&](const Format& f) { return f.letters.find(letter) != f.letters.npos; });
        if (row == std::end(formats)) {
            throw std::invalid_argument(
                "fmt_strings: '" + all.substr(start, i - start) +
                "' is not a valid format; it must end with one of f d i u x o c b");
        }
        item.kind = row->kind != '\0' ? row->kind : letter;
        if (item.kind == 'b') {
            item.character = choice(all, i);
            item.other = choice(all, i);
        }
        item.value = (this->*row->pin)();
        pages_.back().push_back(item);
    }

    /// Parses one of the two characters that %b shows.
    static char choice(const std::string& all, std::size_t& i) {
        if (i >= all.size()) {
            throw std::invalid_argument(
                "fmt_strings: %b must be followed by two characters, for TRUE and for FALSE");
        }
        const char c = all[i++];
        return c == '\\' ? escaped(all, i) : c;
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
`fmt_strings=` has a text per display. Each `%` format in it, as in C's printf, creates a pin
`page.PP.arg.NN`:

| format | pin | shows |
| --- | --- | --- |
| %f | float | a number, with 4 decimals by default |
| %d %i | s32 | an integer |
| %u %x %o | u32 | an integer: decimal, hexadecimal, octal |
| %c | u32 | the character with this code, repeated to the width |
| %bYN | bit | the first character when TRUE, the second when FALSE |

Between % and the letter may be 0 (leading zeros), + (always a sign), the width including sign and
separator, and `.N` decimals. NaN and values that do not fit the width are shown as asterisks. `\n`
ends a line, `\t` is four spaces, `\NN` the character with this hexadecimal code, `\\` a backslash
and `%%` a percent sign; `|` starts the next page, a comma (`\2C`) the text of the next display.

The bytes are those of an ADM-3 terminal, as for the Mesa 7I73. After a start-up of 100 cycles the
page is sent repeatedly from the top. Default names are `lcd.00`, `lcd.01` …

    loadrt lcd fmt_strings="X %+9.3f|Feed %5d" names=panel
    addf lcd slow
    net x-pos   => panel.page.00.arg.00
    net screen  => panel.page_num
    net display <= panel.out
)")
