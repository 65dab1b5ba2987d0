// SPDX-License-Identifier: MIT
// `hal canopen plan`: a table of messages, and whether each arrives in time.
#include <algorithm>
#include <charconv>
#include <fmt/core.h>
#include <unistd.h>

#include "base/types.hpp"
#include "canopen/plan/response_time.hpp"
#include "say.hpp"

namespace hal::tools {

namespace {

namespace plan = canopen::plan;

struct Row {
    plan::Message message;
    std::string name;
    std::size_t line = 0;
};

struct Table {
    plan::Bus bus;
    std::vector<Row> rows;
    std::vector<std::string> problems;  ///< "3: sentence"
};

std::vector<std::string_view> fields_of(std::string_view text) {
    std::vector<std::string_view> fields;
    constexpr std::string_view blanks = " \t\r";
    for (std::size_t at = text.find_first_not_of(blanks); at != text.npos; at = text.find_first_not_of(blanks, at)) {
        const std::size_t end = std::min(text.find_first_of(blanks, at), text.size());
        fields.push_back(text.substr(at, end - at));
        at = end;
    }
    return fields;
}

bool number(std::string_view text, int base, std::uint32_t& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
    return !text.empty() && error == std::errc() && end == text.data() + text.size();
}

/// 500k, 1M, 125000
bool rate_of(std::string_view text, std::uint32_t& rate) {
    std::uint32_t unit = 1;
    if (text.ends_with('k')) unit = 1000;
    if (text.ends_with('M')) unit = 1'000'000;
    if (unit > 1) text.remove_suffix(1);
    if (!number(text, 10, rate) || rate == 0 || rate > 20'000'000 / unit) return false;
    return rate *= unit, rate >= 1000;
}

/// Why the fields are no message, or empty.
std::string message_of(const std::vector<std::string_view>& fields, plan::Message& m) {
    if (fields.size() < 3 || fields.size() > 5) return "a message is ID BYTES PERIOD [DEADLINE [JITTER]] # name";
    std::string_view id = fields[0], bytes = fields[1];
    if (id.starts_with("0x")) id.remove_prefix(2);
    if (id.size() > 8 || !number(id, 16, m.id) || m.id > 0x1fffffff)
        return fmt::format("'{}' is no identifier; write it in hex, eight digits for an extended one", fields[0]);
    m.extended = id.size() == 8 || m.id > 0x7ff;
    if (bytes.ends_with("brs")) m.fd = m.bit_rate_switch = true, bytes.remove_suffix(3);
    else if (bytes.ends_with("fd")) m.fd = true, bytes.remove_suffix(2);
    else if (bytes == "R") m.remote = true, bytes = "0";
    std::uint32_t length = 0;
    if (!number(bytes, 10, length) || length > (m.fd ? 64U : 8U))
        return fmt::format("'{}' is no length; write 0 to 8, R for a remote request, or up to 64fd or 64brs for CAN FD", fields[1]);
    m.bytes = static_cast<std::uint8_t>(length);
    std::int64_t* const times[] = {&m.period, &m.deadline, &m.jitter};
    constexpr const char* names[] = {"period", "deadline", "jitter"};
    constexpr std::int64_t longest = 3'600'000'000'000;
    for (std::size_t i = 2; i < fields.size(); ++i) {
        if (i > 2 && fields[i] == "-") continue;
        const bool unit = fields[i].find_first_not_of("0123456789.") != fields[i].npos || fields[i] == "0";
        const auto ns = parse_duration_ns(fields[i], false);
        if (!unit || !ns || *ns < (i == 4 ? 0 : 1) || *ns > longest)
            return fmt::format("'{}' is no {}; write 10ms, 250us or 1s", fields[i], names[i - 2]);
        *times[i - 2] = *ns;
    }
    return {};
}

Table read(std::string_view text) {
    Table table;
    std::size_t line = 0;
    bool has_rate = false;
    while (!text.empty() && table.problems.size() < 20) {
        ++line;
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view whole = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        const std::size_t hash = std::min(whole.find('#'), whole.size());
        const auto fields = fields_of(whole.substr(0, hash));
        if (fields.empty()) continue;
        const auto problem = [&](const std::string& what) { table.problems.push_back(fmt::format("{}: {}", line, what)); };
        if (fields[0] == "bitrate" || fields[0] == "datarate") {
            std::uint32_t& rate = fields[0] == "bitrate" ? table.bus.bit_rate : table.bus.data_rate;
            has_rate = has_rate || fields[0] == "bitrate";
            if (fields.size() != 2 || !rate_of(fields[1], rate)) problem(fmt::format("'{}' needs a rate: {} 500k", fields[0], fields[0]));
            continue;
        }
        Row row;
        row.line = line;
        if (hash < whole.size()) {
            const auto words = fields_of(whole.substr(hash + 1));
            for (const auto word : words) row.name += (row.name.empty() ? "" : " ") + std::string(word);
        }
        if (const std::string what = message_of(fields, row.message); !what.empty()) {
            problem(what);
            continue;
        }
        for (const Row& other : table.rows)
            if (other.message.id == row.message.id && other.message.extended == row.message.extended &&
                other.message.remote == row.message.remote)
                problem(fmt::format("identifier {} is used in line {} too; two senders of one identifier destroy each other's frames",
                                    fields[0], other.line));
        if (table.rows.size() == 4096) {
            problem("more than 4096 messages");
            break;
        }
        table.rows.push_back(std::move(row));
    }
    if (!has_rate) table.problems.push_back("1: the bit rate is missing; write a line: bitrate 1M");
    else if (table.rows.empty() && table.problems.empty())
        table.problems.push_back("1: there is no message; write lines: ID BYTES PERIOD [DEADLINE [JITTER]] # name");
    return table;
}

/// Milliseconds, so that a column can be compared.
std::string ms(std::int64_t ns) { return ns < 0 ? "endless" : fmt::format("{:.3f}", static_cast<double>(ns) / 1e6); }

std::string id_of(const plan::Message& m) { return fmt::format("{:0{}X}", m.id, m.extended ? 8 : 3); }
std::string called(const Row& row) { return row.name.empty() ? id_of(row.message) : fmt::format("{} ({})", id_of(row.message), row.name); }

std::string table_text(const Table& table, const plan::Analysis& a) {
    std::string text = fmt::format("{:>8}  {:>6}  {:>5}  {:>10}  {:>10}  {:>10}  {:>6}\n", "id", "bytes", "bits", "period ms", "deadline",
                                   "worst", "used");
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
        const plan::Message& m = table.rows[i].message;
        const plan::Response& r = a.responses[i];
        const std::string used =
            r.worst < 0 ? "-" : fmt::format("{:.0f} %", 100.0 * static_cast<double>(r.worst) / static_cast<double>(m.limit()));
        const std::string bytes = m.remote ? "R" : fmt::format("{}{}", m.bytes, m.bit_rate_switch ? "brs" : m.fd ? "fd" : "");
        std::string line = fmt::format("{:>8}  {:>6}  {:>5}  {:>10}  {:>10}  {:>10}  {:>6}  {}{}", id_of(m), bytes, r.bits, ms(m.period),
                                       ms(m.limit()), ms(r.worst), used, r.in_time ? "" : "LATE ", table.rows[i].name);
        while (line.back() == ' ') line.pop_back();
        text += line + "\n";
    }
    return text +
           fmt::format("{} messages at {} bit/s: load {:.1f} % with all stuff bits\n", table.rows.size(), table.bus.bit_rate, 100 * a.load);
}

/// The arithmetic of one that is late.
std::string why_late(const Table& table, const std::vector<plan::Message>& messages, const plan::Analysis& a, std::size_t i) {
    const plan::Response& r = a.responses[i];
    const Row& row = table.rows[i];
    if (r.worst < 0) {
        double use = 0;
        for (std::size_t k = 0; k < messages.size(); ++k)
            if (k == i || plan::before(messages[k], messages[i]))
                use += static_cast<double>(a.responses[k].frame) / static_cast<double>(messages[k].period);
        return fmt::format("{} may wait for ever: with what goes before it it needs {:.1f} % of the bus's time", called(row), 100 * use);
    }
    std::string text = fmt::format("{} needs {} ms and has {} ms:", called(row), ms(r.worst), ms(row.message.limit()));
    if (r.blocker) text += fmt::format(" {} for {} already on the wire +", ms(r.blocking), id_of(messages[*r.blocker]));
    if (r.instance > 0) text += fmt::format(" {} for {} of its own before it +", ms(r.instance * r.frame), r.instance);
    for (std::size_t k = 0; k < messages.size(); ++k) {
        if (k == i || !plan::before(messages[k], messages[i])) continue;
        const std::int64_t times = plan::times_before(messages[k], r.queued, table.bus);
        text += fmt::format(" {} x {} for {} +", times, ms(a.responses[k].frame), id_of(messages[k]));
    }
    text += fmt::format(" {} for itself", ms(r.frame));
    if (row.message.jitter > 0) text += fmt::format(" + {} jitter", ms(row.message.jitter));
    if (r.instance > 0) text += fmt::format(" - {} since it was due", ms(r.instance * row.message.period));
    return text;
}

/// What to change, best first.
std::string help_text(const Table& table, const std::vector<plan::Message>& messages) {
    std::string text;
    if (const auto rate = plan::sufficient_bit_rate(messages, table.bus))
        text += fmt::format("  = help: at bitrate {}k everything is in time\n", *rate / 1000);
    if (const auto order = plan::sufficient_order(messages, table.bus); !order.empty()) {
        text += "  = help: in this order of identifiers, lowest first, everything is in time:";
        for (const std::size_t i : order) text += fmt::format(" {}", id_of(messages[i]));
        text += "\n";
    }
    for (std::int64_t percent = 110; percent <= 1000; percent += 10) {
        std::vector<plan::Message> slower = messages;
        for (plan::Message& m : slower) m.deadline = m.limit(), m.period = m.period * percent / 100;
        if (!plan::analyse(slower, table.bus).fits) continue;
        return text +
               fmt::format("  = help: with every period {} % longer and the deadlines as they are, everything is in time\n", percent - 100);
    }
    return text + "  = help: put several values into one message, take messages away, or use a second bus\n";
}

std::string json_text(const Table& table, const plan::Analysis& a) {
    std::string text = fmt::format(R"({{"bitrate":{},"load":{:.6f},"fits":{},"messages":[)", table.bus.bit_rate, a.load, a.fits);
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
        const plan::Response& r = a.responses[i];
        const plan::Message& m = table.rows[i].message;
        text += fmt::format(
            R"({}{{"id":{},"extended":{},"bits":{},"frame_ns":{},"period_ns":{},"deadline_ns":{},"blocking_ns":{},"worst_ns":{},"in_time":{}}})",
            i == 0 ? "\n " : ",\n ", m.id, m.extended, r.bits, r.frame, m.period, m.limit(), r.blocking,
            r.worst < 0 ? "null" : fmt::format("{}", r.worst), r.in_time);
    }
    return text + "]}\n";
}

}  // namespace

int run_canopen_plan(const Options& options) {
    if (options.words.size() != 1)
        return fail(options, fmt::format("nothing is expected at '{}'; see: hal help canopen plan", options.words[1]));
    const std::string& file = options.words[0];
    std::string text;
    if (!read_file(file, text)) return fail(options, fmt::format("cannot read '{}': {}", file, text));
    if (text.size() > 1'000'000) return fail(options, fmt::format("'{}' is larger than 1 MB; it is no plan", file));
    const Table table = read(text);
    std::string said;
    for (const std::string& problem : table.problems) said += fmt::format("{}:{}\n", file, problem);
    if (!said.empty()) return write_all(STDERR_FILENO, said), 1;
    std::vector<plan::Message> messages;
    for (const Row& row : table.rows) messages.push_back(row.message);
    const plan::Analysis a = plan::analyse(messages, table.bus);
    if (!print(options.json ? json_text(table, a) : table_text(table, a))) return 1;
    if (a.fits) return 0;
    std::size_t late = 0;
    for (std::size_t i = 0; i < messages.size(); ++i)
        if (!a.responses[i].in_time && ++late <= 3)
            said += fmt::format("{}:{}: {}\n", file, table.rows[i].line, why_late(table, messages, a, i));
    if (late > 3) said += fmt::format("{}: {} more are late\n", file, late - 3);
    write_all(STDERR_FILENO, said + help_text(table, messages));
    return 1;
}

}  // namespace hal::tools
