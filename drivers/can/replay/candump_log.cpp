// SPDX-License-Identifier: MIT
// The candump log format: `(SECONDS.FRACTION) CHANNEL ID#DATA`, remote frames `ID#R` or `ID#R4`, FD
// `ID##FLAGSDATA`. Three digits are a standard identifier, eight an extended one, or an error frame
// if bit 29 is set. The time may be a date, as `candump -L -tA` writes it; a direction R or T may
// follow (`candump -x`, python-can); bytes may be separated by dots, and a raw DLC of 9 to 15 may
// follow eight of them (`_E`).
// The terminal format is `(TIME)  CHANNEL  [RX|TX - -]  ID  [LENGTH]  BYTES`, with the time only
// for `candump -t`.
#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <vector>

#include "link/capture.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"

namespace hal::can {

namespace {

bool hex(std::string_view text, std::uint32_t& value) { return parse_whole(text, value, 16); }

/// Parses the fraction; digits after the ninth are ignored.
bool time_of(std::string_view text, std::int64_t& ns) {
    std::int64_t whole = 0;
    std::int64_t fraction = 0;
    std::int64_t unit = 1'000'000'000;
    bool point = false;
    bool digits = false;
    for (const char c : text) {
        if (c == '.' && !point) {
            point = true;
        } else if (is_digit(c)) {
            digits = true;
            if (!point) {
                whole = whole * 10 + (c - '0');
            } else if (unit > 1) {
                unit /= 10;
                fraction += (c - '0') * unit;
            }
            if (whole > 9'000'000'000) return false;
        } else {
            return false;
        }
    }
    ns = whole * 1'000'000'000 + fraction;
    return digits;
}

/// Parses `2026-11-28 18:00:00.249713`, which candump writes in the time zone of its machine.
bool date_of(std::string_view text, std::int64_t& ns) {
    std::tm local{};
    int size = 0;
    const std::string copy(text);
    const int fields =
        std::sscanf(copy.c_str(), "%4d-%2d-%2d %2d:%2d:%2d%n", &local.tm_year, &local.tm_mon,
                    &local.tm_mday, &local.tm_hour, &local.tm_min, &local.tm_sec, &size);
    if (fields != 6 || local.tm_year < 1970) return false;
    local.tm_year -= 1900;
    local.tm_mon -= 1;
    local.tm_isdst = -1;
    const std::time_t seconds = std::mktime(&local);
    std::int64_t fraction = 0;
    constexpr std::time_t max_seconds = 9'000'000'000;  // as in time_of()
    if (seconds < 0 || seconds > max_seconds ||
        !time_of("0" + copy.substr(static_cast<std::size_t>(size)), fraction)) {
        return false;
    }
    ns = std::int64_t{seconds} * 1'000'000'000 + fraction;
    return true;
}

/// Takes `(TIME)` from the begin of a line.
bool parse_time(std::string_view& line, std::int64_t& ns) {
    const auto close = line.find(')');
    if (line.empty() || line[0] != '(' || close == line.npos) {
        return false;
    }
    const std::string_view text = line.substr(1, close - 1);
    line.remove_prefix(close + 1);
    return text.find(' ') == text.npos ? time_of(text, ns) : date_of(text, ns);
}

bool set_identifier(std::string_view text, Frame& f) {
    std::uint32_t id = 0;
    if ((text.size() != 3 && text.size() != 8) || !hex(text, id)) return false;
    f.extended = text.size() == 8;
    f.error = f.extended && (id & 0x20000000U) != 0;
    if (f.error) {
        f.extended = false;
    }
    f.id = f.error ? id & 0x1fffffffU : id;
    return true;
}

/// Parses `R`, `R4` or `R8_E`.
bool parse_remote(std::string_view text, Frame& f) {
    std::uint32_t length = 0;
    std::uint32_t code = 0;
    f.remote = true;
    text.remove_prefix(1);
    const auto raw = text.find('_');
    if (raw != text.npos && (!hex(text.substr(raw + 1), code) || text.size() != raw + 2)) {
        return false;
    }
    text = text.substr(0, raw);
    if (text.size() > 1 || (!text.empty() && !hex(text, length))) return false;
    f.length = static_cast<std::uint8_t>(length);
    return f.valid();
}

bool parse_bytes(std::string_view text, Frame& f) {
    const std::size_t max = f.fd ? 64 : 8;
    while (!text.empty()) {
        if (text[0] == '.') {
            text.remove_prefix(1);  // a separator, as cansend accepts it
        }
        // the raw DLC; it has no byte
        if (!f.fd && f.length == 8 && text.size() == 2 && text[0] == '_') return true;
        std::uint32_t byte = 0;
        if (f.length >= max || text.size() < 2 || !hex(text.substr(0, 2), byte)) return false;
        f.data[f.length++] = static_cast<std::uint8_t>(byte);
        text.remove_prefix(2);
    }
    return true;
}

bool parse_frame(std::string_view text, Frame& f) {
    const auto mark = text.find('#');
    if (mark == text.npos || !set_identifier(text.substr(0, mark), f)) return false;
    text.remove_prefix(mark + 1);
    if (!text.empty() && text[0] == '#') {
        std::uint32_t flags = 0;
        if (text.size() < 2 || !hex(text.substr(1, 1), flags)) return false;
        f.fd = true;
        f.bit_rate_switch = (flags & 1) != 0;
        f.error_state = (flags & 2) != 0;
        text.remove_prefix(2);
    } else if (!text.empty() && (text[0] == 'R' || text[0] == 'r')) {
        return parse_remote(text, f);
    }
    return parse_bytes(text, f) && (f.error || f.valid());
}

std::string_view next_word(std::string_view& line) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(" \t"));
    line.remove_prefix(word.size());
    return word;
}

/// The length in `[2]`, of an FD frame `[02]`, or the raw DLC in `{2}`. Returns false for anything
/// else.
bool parse_length(std::string_view word, bool& fd, std::uint32_t& length) {
    if (word.size() < 3 || word.size() > 4) return false;
    fd = word.size() == 4;
    const std::string_view digits = word.substr(1, word.size() - 2);
    if (word.front() == '{' && word.back() == '}') {
        const bool good = hex(digits, length);
        length = std::min(length, 8U);
        return good;
    }
    return word.front() == '[' && word.back() == ']' && parse_whole(digits, length) && length <= 64;
}

enum class Screen : std::uint8_t { other, frame, no_time, not_hexadecimal };

/// Parses a line of the terminal format.
Screen parse_screen_line(std::string_view line, Frame& f) {
    f = {};
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    const bool timed = !line.empty() && line[0] == '(';
    if (timed && !parse_time(line, f.time_ns)) return Screen::other;
    next_word(line);  // the channel
    std::string_view word = next_word(line);
    if (word == "RX" || word == "TX") {
        f.bit_rate_switch = next_word(line) == "B";
        f.error_state = next_word(line) == "E";
        word = next_word(line);
    }
    std::uint32_t length = 0;
    if (!set_identifier(word, f) || !parse_length(next_word(line), f.fd, length)) {
        return Screen::other;
    }
    if (!timed) return Screen::no_time;
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    if (line.starts_with("remote request")) {
        f.remote = true;
        f.length = static_cast<std::uint8_t>(length);
        return f.valid() ? Screen::frame : Screen::other;
    }
    for (std::uint32_t i = 0; i < length; ++i) {
        const std::string_view byte = next_word(line);
        // candump -i, -S
        if (byte.size() != 2 || !parse_bytes(byte, f)) return Screen::not_hexadecimal;
    }
    return f.error || f.valid() ? Screen::frame : Screen::other;
}

/// Returns the line without its end and without the colours of a terminal.
std::string plain(std::string_view line) {
    std::string text;
    for (std::size_t at = 0; at < line.size(); ++at) {
        if (line[at] == '\x1b') {
            at = std::min(line.find('m', at), line.size());
        } else {
            text += line[at];
        }
    }
    while (!text.empty() && (text.back() == '\r' || text.back() == ' ')) {
        text.pop_back();
    }
    return text;
}

bool is_xl(std::string_view line) {
    const std::string_view frame = line.substr(line.rfind(' ') + 1);
    const auto first = frame.find('#');
    return first == 5 && frame.find('#', first + 1) == first + 15;
}

struct OtherFormat {
    std::string_view begin;
    const char* name;
    bool converted;  // by python-can
};

constexpr std::array<OtherFormat, 9> other_formats{{
    {"date ", "a Vector log (.asc)", true},
    {";$FILEVERSION", "a PCAN trace (.trc)", true},
    {"timestamp,arbitration_id,", "a table of python-can (.csv)", true},
    {"LOGG", "a Vector log (.blf)", true},
    {"MDF ", "a measurement file (.mf4)", true},
    {"SQLite format 3", "a database of python-can (.db)", true},
    {"Timestamp: ", "the terminal output of python-can; record with: can_logger -f FILE.log",
     false},
    {"\x89MCAP", "an MCAP recording; hal replay and hal plot read it", false},
    {"time_s,", "a table of values; hal replay and hal plot read it", false},
}};

/// States which other format the text has; "" when it may be a log.
std::string other_format(std::string_view text) {
    for (const OtherFormat& format : other_formats) {
        if (text.starts_with(format.begin)) {
            return std::string("not a candump log: it is ") + format.name +
                   (format.converted ? "; convert it with: can_logconvert FILE FILE.log" : "");
        }
    }
    return "";
}

}  // namespace

std::string log_line(const Frame& f, std::string_view channel) {
    char text[256];
    const auto time = f.time_ns > 0 ? f.time_ns : 0;
    // Always six digits: canplayer reads the digits after the point as microseconds.
    const long long seconds = time / 1'000'000'000;
    const long long microseconds = time % 1'000'000'000 / 1000;
    int size = std::snprintf(text, sizeof text, "(%010lld.%06lld) ", seconds, microseconds);
    std::string line(text, static_cast<std::size_t>(size));
    line += channel;
    size = std::snprintf(text, sizeof text, f.extended || f.error ? " %08X#" : " %03X#",
                         f.id | (f.error ? 0x20000000U : 0U));
    line.append(text, static_cast<std::size_t>(size));
    if (f.fd) {
        line += "#";
        line += static_cast<char>('0' + (int{f.bit_rate_switch} | int{f.error_state} << 1));
    }
    if (f.remote) {
        line += f.length == 0 ? "R" : "R" + std::to_string(f.length);
    }
    for (const auto b : f.bytes()) {
        line += "0123456789ABCDEF"[b >> 4];
        line += "0123456789ABCDEF"[b & 15];
    }
    return line;
}

bool parse_log_line(std::string_view line, Frame& f) {
    f = {};
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) {
        line.remove_suffix(1);
    }
    if (line.size() >= 2 && line[line.size() - 2] == ' ' &&
        std::string_view("RTrt").find(line.back()) != std::string_view::npos) {
        line.remove_suffix(2);  // direction, as candump -x and python-can write it
    }
    if (!parse_time(line, f.time_ns)) return false;
    const auto space = line.rfind(' ');
    return space != line.npos && space > 0 && parse_frame(line.substr(space + 1), f);
}

namespace {

/// Reads the lines of a log. A line that is not a frame is reported once, and does not end the log.
class LogParser {
public:
    LogParser(std::string_view text, std::vector<Frame>& frames)
        : text_(text), frames_(frames), has_relative_times_(begins_at_zero(text)) {}

    /// Returns the first problem, or "".
    std::string parse() {
        std::size_t begin = 0;
        while (begin < text_.size() && !is_cut_off_) {
            const auto end = std::min(text_.find('\n', begin), text_.size());
            ++line_number_;
            parse_line(plain(text_.substr(begin, end - begin)), end < text_.size());
            begin = end + 1;
        }
        return problem_;
    }

private:
    /// candump -tz writes the time since the first frame, and -td that since the previous one, in
    /// the same form; both begin with 0.
    static bool begins_at_zero(std::string_view text) {
        return text.substr(std::min(text.find('('), text.size())).starts_with("(000.");
    }

    void parse_line(const std::string& line, bool has_end) {
        if (is_comment(line)) return;
        Frame frame;
        const bool is_logged = parse_log_line(line, frame);
        const Screen screen = is_logged ? Screen::other : parse_screen_line(line, frame);
        const bool is_frame = is_logged || screen == Screen::frame;
        may_have_details_ = screen == Screen::frame && frame.error;
        if (!has_end && (is_frame || !frames_.empty())) {
            is_cut_off_ = true;  // the frame does not show it: its last bytes may be missing
            report(
                "the last line has no end of line: its frame may be cut off; remove it, or end "
                "it if it is complete");
        } else if (is_frame) {
            add(frame);
        } else {
            report(invalid_line(line, screen));
        }
    }
    /// Returns whether a line is about the log, or has details of the error frame before it
    /// (candump -e), which begin with a tab.
    bool is_comment(const std::string& line) const {
        return line.empty() || line.starts_with("DROPCOUNT: ") ||
               (may_have_details_ && line[0] == '\t');
    }
    void add(const Frame& frame) {
        const bool goes_back = !frames_.empty() && frame.time_ns < frames_.back().time_ns;
        frames_.push_back(frame);
        if (has_relative_times_ && goes_back) {
            report(
                "the time goes back: differences, as candump -td prints them; record with: "
                "candump -L");
        }
    }
    /// States why a line is not a frame.
    static std::string invalid_line(const std::string& line, Screen screen) {
        if (screen == Screen::no_time) {
            return "terminal format of candump, without times; record with: candump -L, or candump "
                   "-ta";
        }
        if (screen == Screen::not_hexadecimal) {
            return "terminal format of candump, not with plain hexadecimal bytes; record with: "
                   "candump -L";
        }
        if (is_xl(line)) return "CAN XL frame; supported: classic and FD frames";
        return "invalid frame; expected `(1436509052.249713) can0 181#0102`";
    }
    /// Keeps the first problem, with the number of its line.
    void report(const std::string& sentence) {
        if (problem_.empty()) {
            problem_ = "line " + std::to_string(line_number_) + ": " + sentence;
        }
    }

    const std::string_view text_;
    std::vector<Frame>& frames_;
    const bool has_relative_times_;
    std::size_t line_number_ = 0;
    bool may_have_details_ = false;  // after an error frame of the terminal format
    bool is_cut_off_ = false;
    std::string problem_;
};

}  // namespace

std::string parse_log(std::string_view text, std::vector<Frame>& frames) {
    const std::string format = other_format(text);
    return format.empty() ? LogParser(text, frames).parse() : format;
}

}  // namespace hal::can
