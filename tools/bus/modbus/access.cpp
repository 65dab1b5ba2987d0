// SPDX-License-Identifier: MIT
// `hal modbus read`, `write`, `scan` and `monitor`: one request at a time.
#include <poll.h>

#include <algorithm>
#include <fmt/core.h>
#include <memory>
#include <optional>
#include <unistd.h>
#include <utility>

#include "bus/modbus/options.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "link/line.hpp"
#include "link/system.hpp"
#include "modbus/config/plan.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

using namespace modbus;

/// A line and one request at a time on it.
class Exchange {
public:
    /// Returns the problem, or "".
    std::string open(const std::string& address, const ModbusLineOptions& options) {
        auto opened = line::open(address);
        if (!opened) return opened.problem;
        line_ = std::move(opened.line);
        timeout_ns_ = options.timeout_ns;
        const bool stream = line_->description().is_stream;
        framing_ = stream && !options.rtu ? Framing::tcp : Framing::rtu;
        address_ = address;
        return connect() ? "" : address + ": no connection within 2 s";
    }
    /// Opens a line again that was lost. Returns false when that takes more than 2 s.
    bool connect() {
        const std::int64_t limit = link::monotonic_ns() + 2'000'000'000;
        while (!line_->is_open(link::monotonic_ns())) {
            if (link::monotonic_ns() > limit) return false;
            wait(10'000'000);
        }
        return true;
    }

    struct Result {
        Verdict verdict = Verdict::foreign;  ///< foreign: no answer
        std::uint8_t code = 0;
        std::vector<std::uint8_t> data;
        bool is_corrupt = false;
        bool is_sent = false;
        bool is_lost = false;  ///< the line, before the answer was complete
    };
    Framing framing() const { return framing_; }
    bool is_stream() const { return line_->description().is_stream; }
    const std::string& address() const { return address_; }

    /// Sends a request and waits for its answer.
    Result ask(std::uint8_t unit, const Pdu& request) {
        ReceiveBuffer buffer;
        discard();
        const Frame sent = encode(framing_, unit, ++transaction_, request);
        bool echo_is_due = framing_ == Framing::rtu && request.function() <= 4;
        Result result;
        result.is_sent = line_->send(sent.span(), link::monotonic_ns());
        if (!result.is_sent) {
            result.is_lost = !line_->is_open(link::monotonic_ns());
            return result;
        }
        const std::int64_t limit =
            std::max(link::monotonic_ns(), line_->sent_until_ns()) + timeout_ns_;
        while (link::monotonic_ns() < limit) {
            wait(limit - link::monotonic_ns());
            const std::size_t count = line_->receive(buffer.free_space(), link::monotonic_ns());
            if (count == 0 && !line_->is_open(link::monotonic_ns())) {
                result.is_lost = true;
                return result;
            }
            buffer.added(count);
            // an adapter without receiver disable: the answer to a read is not equal to its request
            if (echo_is_due && buffer.span().size() >= sent.size &&
                std::equal(sent.span().begin(), sent.span().end(), buffer.span().begin())) {
                echo_is_due = false;
                buffer.drop(sent.size);
            }
            Found found;
            switch (scan(framing_, Role::answers, false, buffer.span(), found)) {
            case Scan::incomplete: continue;
            case Scan::corrupt: result.is_corrupt = true; return result;
            case Scan::valid: break;
            }
            const bool is_mine = found.unit == unit &&
                                 (framing_ == Framing::rtu || found.transaction == transaction_);
            const Answer answer = is_mine ? decode(request, found.pdu, false) : Answer{};
            if (answer.verdict != Verdict::foreign) {
                result.verdict = answer.verdict;
                result.code = answer.code;
                result.data.assign(answer.data.begin(), answer.data.end());
                return result;
            }
            buffer.drop(found.length);
        }
        return result;
    }

private:
    void wait(std::int64_t ns) {
        pollfd p{line_->descriptor(), POLLIN, 0};
        const timespec time = link::to_timespec(std::clamp<std::int64_t>(ns, 0, 20'000'000));
        ppoll(&p, p.fd >= 0 ? 1 : 0, &time, nullptr);
    }
    void discard() {
        wait(5'000'000);
        std::array<std::uint8_t, 256> rest;
        while (line_->receive(rest, link::monotonic_ns()) != 0) {
        }
    }

    std::unique_ptr<line::Line> line_;
    std::string address_;
    Framing framing_ = Framing::rtu;
    std::int64_t timeout_ns_ = 0;
    std::uint16_t transaction_ = 0;
};

struct Target {
    std::uint8_t unit = 0;
    Table table = Table::none;
    std::uint16_t address = 0;
};

/// Parses SLAVE TABLE ADDRESS. Returns the problem, or "".
std::string parse_target(const std::vector<std::string>& words, Target& target) {
    if (words.size() < 4) return "missing argument; write LINE SLAVE TABLE ADDRESS";
    const auto unit = parse_natural(words[1]);
    if (!unit || *unit > 255) {
        return "invalid slave '" + words[1] + "'; write 1..247, or 0 to write to all slaves";
    }
    const std::string table = lower(words[2]);
    for (const Table one : {Table::coil, Table::discrete, Table::holding, Table::input}) {
        if (table == modbus::to_string(one)) {
            target.table = one;
        }
    }
    if (target.table == Table::none) {
        return "unknown table '" + words[2] + "'; write coil, discrete, holding or input";
    }
    const auto address = parse_natural(words[3]);
    if (!address || *address > 0xffff) {
        return "invalid address '" + words[3] + "'; write 0..0xFFFF, as on the wire";
    }
    target.unit = static_cast<std::uint8_t>(*unit);
    target.address = static_cast<std::uint16_t>(*address);
    return {};
}

/// Returns what happened to a line that was lost before the answer.
std::string loss_text(const Exchange& exchange, std::uint8_t unit) {
    if (!exchange.is_stream()) {
        return fmt::format("{} is lost; the request to slave {} has no answer", exchange.address(),
                           unit);
    }
    return fmt::format(
        "{} has closed the connection before the answer of slave {}; check its "
        "address, and whether the device accepts another connection",
        exchange.address(), unit);
}

int report(const Options& options, const Exchange& exchange, const Exchange::Result& result,
           const Pdu& request, std::uint8_t unit) {
    if (result.is_lost) return fail(options, loss_text(exchange, unit));
    if (!result.is_sent) {
        return fail(options, exchange.address() + " does not accept the request");
    }
    if (result.verdict == Verdict::exception) {
        return fail(options,
                    fmt::format("slave {} rejects '{}': {} (exception {})", unit,
                                request_text(request), exception_name(result.code), result.code));
    }
    if (result.is_corrupt) {
        return fail(options,
                    fmt::format("slave {}: answer with a wrong check sequence; check baud rate, "
                                "parity and wiring",
                                unit));
    }
    return fail(options, fmt::format("slave {} does not answer; check its address, baud rate, "
                                     "parity and wiring",
                                     unit));
}

constexpr Function read_functions[] = {Function::read_holding, Function::read_coils,
                                       Function::read_discrete, Function::read_holding,
                                       Function::read_input};

std::string values_text(const Target& target, std::uint16_t count,
                        const std::vector<std::uint8_t>& data) {
    std::string text;
    for (unsigned n = 0; n < count; ++n) {
        const unsigned address = target.address + n;
        if (is_bits(target.table)) {
            text += fmt::format("0x{:04X}  {}\n", address, data[n / 8] >> n % 8 & 1);
            continue;
        }
        const unsigned word = word_at(data, std::size_t{2} * n);
        text += fmt::format("0x{:04X}  0x{:04X}  {}", address, word, word);
        text += word >= 0x8000 ? fmt::format("  {}\n", static_cast<int>(word) - 0x10000) : "\n";
    }
    return text;
}

/// Makes the request of `hal modbus write`. Returns the problem, or "".
std::string parse_write(const std::vector<std::string>& words, const Target& target, Pdu& request) {
    if (target.table != Table::coil && target.table != Table::holding) {
        return std::string(modbus::to_string(target.table)) +
               " registers cannot be written; write coil or holding";
    }
    if (words.size() < 5) return "missing value; write LINE SLAVE TABLE ADDRESS VALUE…";
    if (words.size() - 4 > max_write_registers) return "more than 123 values in one request";
    std::vector<std::uint16_t> values;
    std::vector<std::uint8_t> bits((words.size() - 4 + 7) / 8);
    for (std::size_t n = 4; n < words.size(); ++n) {
        const bool negative = words[n].starts_with('-');
        const auto value = parse_natural(std::string_view(words[n]).substr(negative ? 1 : 0));
        const bool is_coil = target.table == Table::coil;
        const std::uint64_t max_number = negative ? 0x8000 : 0xffff;
        if (!value || *value > (is_coil ? 1 : max_number) || (negative && is_coil)) {
            return "invalid value '" + words[n] + "'; write " +
                   (is_coil ? "0 or 1" : "-32768..65535");
        }
        const auto word = static_cast<std::uint16_t>(negative ? 0x10000 - *value : *value);
        values.push_back(word);
        bits[(n - 4) / 8] = static_cast<std::uint8_t>(bits[(n - 4) / 8] | word << (n - 4) % 8);
    }
    if (target.table == Table::coil) {
        request = values.size() == 1
                      ? write_coil_request(target.address, values[0] != 0)
                      : write_coils_request(target.address,
                                            static_cast<std::uint16_t>(values.size()), bits);
    } else {
        request = values.size() == 1 ? write_register_request(target.address, values[0])
                                     : write_registers_request(target.address, values);
    }
    return {};
}

}  // namespace

int run_modbus_read(const ModbusAccessOptions& options) {
    Target target;
    if (const std::string problem = parse_target(options.words, target); !problem.empty()) {
        return fail(options, problem);
    }
    const auto count = options.words.size() > 4 ? parse_natural(options.words[4]) : 1;
    const unsigned max = is_bits(target.table) ? max_read_bits : max_read_registers;
    if (!count || *count == 0 || *count > max || options.words.size() > 5) {
        return fail(options, fmt::format("invalid count; write 1..{}", max));
    }
    const auto number = static_cast<std::uint16_t>(*count);
    const Pdu request = read_request(read_functions[static_cast<std::size_t>(target.table)],
                                     target.address, number);
    Exchange exchange;
    if (const std::string problem = exchange.open(options.words[0], options); !problem.empty()) {
        return fail(options, problem);
    }
    // over TCP it may be the device itself
    if (target.unit == broadcast_unit && exchange.framing() == Framing::rtu) {
        return fail(options,
                    "slave 0 is the broadcast address, which no slave answers; write 1..247");
    }
    const auto result = exchange.ask(target.unit, request);
    if (result.verdict != Verdict::good) {
        return report(options, exchange, result, request, target.unit);
    }
    return exit_code(print(values_text(target, number, result.data)));
}

int run_modbus_write(const ModbusAccessOptions& options) {
    Target target;
    Pdu request;
    std::string problem = parse_target(options.words, target);
    if (problem.empty()) {
        problem = parse_write(options.words, target, request);
    }
    Exchange exchange;
    if (problem.empty()) {
        problem = exchange.open(options.words[0], options);
    }
    if (!problem.empty()) return fail(options, problem);
    const auto result = exchange.ask(target.unit, request);
    const bool is_answered = result.verdict != Verdict::foreign || result.is_corrupt;
    // a broadcast is not answered, but over TCP it may be a request to the device itself
    const bool is_accepted = result.is_sent && !result.is_lost;
    if (target.unit == broadcast_unit && is_accepted && !is_answered) return 0;
    if (result.verdict == Verdict::good) return 0;
    return report(options, exchange, result, request, target.unit);
}

int run_modbus_scan(const ModbusScanOptions& options) {
    if (options.first < 1 || options.last > 247 || options.first > options.last) {
        return fail(options, "invalid range; addresses are 1..247");
    }
    Exchange exchange;
    if (const std::string problem = exchange.open(options.words[0], options); !problem.empty()) {
        return fail(options, problem);
    }
    StopRequest stop;
    int found = 0;
    std::string loss;  // the first
    for (int unit = options.first; unit <= options.last && !stop.requested(); ++unit) {
        const auto address = static_cast<std::uint8_t>(unit);
        if (!exchange.connect()) return fail(options, exchange.address() + " is lost");
        const auto result = exchange.ask(address, read_request(Function::read_holding, 0, 1));
        if (loss.empty() && result.is_lost) {
            loss = loss_text(exchange, address);
        }
        if (result.verdict == Verdict::foreign && !result.is_corrupt) continue;
        ++found;
        std::string what = "answers";
        if (result.is_corrupt) {
            what = "answers with a wrong check sequence; check baud rate and parity";
        } else if (result.verdict == Verdict::exception) {
            what =
                fmt::format("answers: {} (exception {})", exception_name(result.code), result.code);
        }
        if (!print(fmt::format("slave {} {}\n", unit, what))) return 1;
    }
    if (found == 0 && !loss.empty()) return fail(options, "no slave answers: " + loss);
    if (found == 0) {
        return fail(options,
                    "no slave answers; check baud rate, parity, wiring, and whether A and "
                    "B are swapped");
    }
    return 0;
}

namespace {

/// The bytes on a serial line, split into frames and printed.
class FramePrinter {
public:
    explicit FramePrinter(std::int64_t begin_ns) : begin_ns_(begin_ns), last_ns_(begin_ns) {}

    /// Receives what has arrived.
    void receive(line::Line& line, std::int64_t now_ns) {
        const std::size_t count = line.receive(buffer_.free_space(), now_ns);
        if (count != 0) {
            buffer_.added(count);
            last_ns_ = now_ns;
        }
    }
    /// Prints the frames that are complete: at their length where several arrived in one piece, as
    /// on a busy line, the last one after a pause of 5 ms. Returns false when nobody reads them.
    bool print_complete(std::int64_t now_ns) {
        constexpr std::int64_t pause_ns = 5'000'000;
        for (std::size_t size = first_frame(); size != 0; size = first_frame()) {
            ReceiveBuffer rest = buffer_;
            rest.drop(size);
            ReceiveBuffer first;
            std::copy_n(buffer_.span().begin(), size, first.free_space().begin());
            first.added(size);
            buffer_ = first;
            if (!flush()) return false;
            buffer_ = rest;
        }
        const bool is_over = now_ns - last_ns_ > pause_ns || buffer_.free_space().empty();
        return !is_over || flush();
    }

private:
    /// Returns the size of the first frame when it is valid and more bytes follow it, else 0.
    std::size_t first_frame() const {
        Found found;
        Scan result = scan(Framing::rtu, Role::requests, false, buffer_.span(), found);
        if (result != Scan::valid) {
            result = scan(Framing::rtu, Role::answers, false, buffer_.span(), found);
        }
        const bool is_whole = result != Scan::valid || found.length == buffer_.span().size();
        return is_whole ? 0 : found.length;
    }
    bool flush() {
        if (buffer_.empty()) return true;
        std::string hex;
        for (const std::uint8_t byte : buffer_.span()) {
            hex += fmt::format("{:02X} ", byte);
        }
        const bool valid = buffer_.span().size() >= 4 && crc16(buffer_.span()) == 0;
        const std::string text =
            fmt::format("{:12.6f}  {}{}\n", static_cast<double>(last_ns_ - begin_ns_) / 1e9, hex,
                        valid ? "" : " wrong check sequence");
        buffer_.clear();
        return print(text);
    }

    ReceiveBuffer buffer_;
    const std::int64_t begin_ns_;
    std::int64_t last_ns_;  // time of the newest bytes
};

/// Reports that the line was lost, or is open again.
void report_line(const Options& options, const line::Line& line, bool is_open) {
    const std::string& address = line.description().address;
    const char* const what = is_open ? " is open again" : " is lost; it is opened again";
    write_all(STDERR_FILENO, fmt::format("{}: {}{}\n", options.program, address, what));
}

}  // namespace

/// `hal modbus monitor`: prints the frames on a serial line.
int run_modbus_monitor(const ModbusMonitorOptions& options) {
    auto opened = line::open(options.words[0]);
    if (!opened) return fail(options, opened.problem);
    line::Line& line = *opened.line;
    StopRequest stop;
    const std::int64_t begin_ns = link::monotonic_ns();
    FramePrinter printer(begin_ns);
    bool was_open = line.is_open(begin_ns);
    while (!stop.requested()) {
        const std::int64_t now_ns = link::monotonic_ns();
        if (options.for_ns >= 0 && now_ns - begin_ns >= options.for_ns) break;
        const bool is_open = line.is_open(now_ns);
        if (std::exchange(was_open, is_open) != is_open) {
            report_line(options, line, is_open);
        }
        printer.receive(line, now_ns);
        if (!printer.print_complete(now_ns)) return 1;
        pollfd p{line.descriptor(), POLLIN, 0};
        ::poll(&p, p.fd >= 0 ? 1 : 0, 5);
    }
    return 0;
}

}  // namespace hal::tools
