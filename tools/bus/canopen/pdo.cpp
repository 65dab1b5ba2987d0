// SPDX-License-Identifier: MIT
// `hal can pdo`: lists the PDOs of a node and their mapping, prints received values, and changes a
// mapping in the order of CiA 301.
#include "bus/canopen/pdo.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <optional>
#include <span>
#include <vector>

#include "bus/canopen/pdo_settings.hpp"
#include "bus/json_text.hpp"
#include "cli/output.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using canopen::Abort;
using canopen::SdoRequest;

namespace {

/// Parses ADDRESS NODE and, with `with_pdo`, PDO.
bool read_words(const PdoOptions& options, bool with_pdo, std::uint8_t& node, ObjectNames& names,
                PdoSettings* pdo) {
    if (options.words.size() < (with_pdo ? 3U : 2U)) {
        fail(options, fmt::format("expected ADDRESS NODE{1}; type: {0} ADDRESS NODE{1}",
                                  options.program, with_pdo ? " PDO" : ""));

        return false;
    }
    if (!node_of(options, options.words[1], node) || !names.load(options, options.eds)) {
        return false;
    }
    if (with_pdo && !parse_pdo(options.words[2], *pdo)) {
        fail(options, fmt::format("invalid PDO '{}'; write rpdo1 to rpdo512 or tpdo1 to tpdo512",
                                  options.words[2]));

        return false;
    }
    return true;
}

std::string item_text(const PdoSettings::Item& item) {
    return fmt::format("{:04X}:{:X}/{}{}", item.object.index, item.object.sub, item.bits,
                       item.object.name.empty() ? "" : " " + item.object.name);
}

std::string json_of(const PdoSettings& p) {
    std::string mapping;
    for (const auto& item : p.mapping) {
        mapping +=
            fmt::format(R"({}{{"index":{},"sub":{},"bits":{},"name":{}}})",
                        mapping.empty() ? "" : ",", item.object.index, item.object.sub, item.bits,
                        item.object.name.empty() ? "null" : json_text(item.object.name));
    }
    return fmt::format(
        R"({{"pdo":"{}","on":{},"id":{},"transmission":{},"inhibit_us":{},"event_ms":{},"sync_start":{},"mapping":[{}]}})"
        "\n",
        p.name(), p.on(), canopen::cob_id(p.cob), p.transmission, p.inhibit_100us * 100, p.event_ms,
        p.sync_start, mapping);
}

/// Formats a PDO as a line, and a line for each mapped object.
std::string lines_of(const PdoSettings& p) {
    std::string text = fmt::format("{:7} {:>8}  {}", p.name(), p.identifier(), p.timing());
    if (p.is_multiplexed()) {
        return text + (p.count == 0xff ? ", multiplexed: to an object of another node\n"
                                       : ", multiplexed: from an object of its own\n");
    }
    if (p.mapping.empty()) return text + ", empty\n";
    text += '\n';
    for (const auto& item : p.mapping) {
        const std::string location =
            fmt::format("{:04X}:{:X}/{}", item.object.index, item.object.sub, item.bits);
        text += item.object.name.empty()
                    ? fmt::format("                  {}\n", location)
                    : fmt::format("                  {:10} {}\n", location, item.object.name);
    }
    return text;
}

}  // namespace

int run_can_pdo_show(const PdoShowOptions& options) {
    std::uint8_t node = 0;
    ObjectNames names;
    if (!read_words(options, false, node, names, nullptr)) return 1;
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0])) return 1;
    std::vector<PdoSettings> pdos;
    if (!read_pdos(station, options, node, names, pdos)) return 1;
    std::string text;
    for (const PdoSettings& p : pdos) {
        text += options.json ? json_of(p) : lines_of(p);
    }
    return exit_code(print(text));
}

namespace {

/// One write of a re-mapping, and its purpose.
struct Step {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint32_t value;
    std::uint8_t bytes;
    std::string what;
};

/// Returns the writes in the order of CiA 301: PDO off, mapping off, the entries, mapping on, the
/// parameters, PDO on.
std::vector<Step> steps_to(const PdoSettings& p, std::uint32_t old_cob) {
    const std::uint16_t communication = p.communication_index();
    const std::uint16_t mapping = p.mapping_index();
    std::vector<Step> steps{
        {communication, 1, old_cob | canopen::cob_invalid, 4, "disable the PDO"},
        {mapping, 0, 0, 1, "disable the mapping"}};
    for (std::size_t n = 0; n < p.mapping.size(); ++n) {
        steps.push_back({mapping, static_cast<std::uint8_t>(n + 1), p.mapping[n].entry(), 4,
                         "map " + item_text(p.mapping[n])});
    }
    steps.push_back(
        {mapping, 0, static_cast<std::uint32_t>(p.mapping.size()), 1, "enable the mapping"});
    steps.push_back({communication, 2, p.transmission, 1,
                     fmt::format("set the transmission type {}", p.transmission)});
    if (p.has_inhibit) {
        steps.push_back({communication, 3, p.inhibit_100us, 2, "set the inhibit time"});
    }
    if (p.has_event) {
        steps.push_back({communication, 5, p.event_ms, 2, "set the event timer"});
    }
    steps.push_back({communication, 1, p.cob, 4, p.on() ? "enable the PDO" : "set the identifier"});
    return steps;
}

bool write_steps(NodeClient& station, std::uint8_t node, const std::vector<Step>& steps,
                 const Step*& failed, SdoRequest& last) {
    for (const Step& step : steps) {
        std::uint8_t bytes[4];
        canopen::store(bytes, step.value);
        last = {.index = step.index,
                .sub = step.sub,
                .data = std::span<const std::uint8_t>(bytes, step.bytes)};
        if (station.transfer(node, last)) continue;
        failed = &step;
        return false;
    }
    return true;
}

/// Determines the length of an object in bits: as typed, as described, or as read from the node.
bool parse_item(NodeClient& station, std::uint8_t node, const ObjectNames& names,
                const std::string& word, PdoSettings::Item& item, std::string& problem) {
    // A name may contain a slash; only digits after the last one are a length.
    const auto slash = word.rfind('/');
    unsigned bits = 0;
    const bool sized = slash != word.npos && parse_whole(word.substr(slash + 1), bits);
    if (sized && (bits < 1 || bits > 64)) {
        problem = fmt::format("invalid length in '{}'; an object in a PDO has 1..64 bits", word);

        return false;
    }
    if (!names.find(sized ? word.substr(0, slash) : word, item.object, problem)) return false;
    item.bits = bits;
    if (item.bits == 0) {
        item.bits = canopen::bits_of(item.object.type);
    }
    if (item.bits == 0 && item.object.index <= 0x1b) {
        item.bits = canopen::bits_of(static_cast<canopen::Type>(item.object.index));
    }
    if (item.bits != 0) return true;
    std::uint8_t buffer_bytes[8];
    SdoRequest request{
        .index = item.object.index, .sub = item.object.sub, .upload = true, .buffer = buffer_bytes};
    if (station.transfer(node, request) && request.size > 0) {
        item.bits = static_cast<unsigned>(request.size) * 8;
        return true;
    }
    problem = fmt::format("cannot read the length of {0} ({1}); write it in bits: {2:04X}:{3:X}/16",
                          item.object.label(), canopen::to_string(request.abort), item.object.index,
                          item.object.sub);

    return false;
}

bool parse_options(const PdoMapOptions& options, PdoSettings& p) {
    const auto problem = [&](const std::string& text) {
        fail(options, text);
        return false;
    };
    if (options.transmission >= 0) {
        p.transmission = static_cast<std::uint8_t>(options.transmission);
    }
    if (!options.id.empty()) {
        can::Filter id;
        std::string why;
        if (options.id.find('/') != std::string::npos || !parse_filter(options.id, id, why)) {
            return problem(
                fmt::format("invalid identifier '{}'; write it in hex: 181, or eight digits for an "
                            "extended one",
                            options.id));
        }
        p.cob = id.id | (id.extended ? canopen::cob_extended : 0) | (p.cob & canopen::cob_flag30);
    }
    if (options.inhibit_ns >= 0) {
        if (p.received || !p.has_inhibit) return problem(p.name() + " has no inhibit time");
        if (options.inhibit_ns > 6'553'500'000) {
            return problem("inhibit time out of range; at most 6.5535 s");
        }
        p.inhibit_100us = static_cast<std::uint16_t>((options.inhibit_ns + 50'000) / 100'000);
    }
    if (options.event_ns >= 0) {
        if (!p.has_event) return problem(p.name() + " has no event timer");
        if (options.event_ns > 65'535'000'000) {
            return problem("event timer out of range; at most 65.535 s");
        }
        p.event_ms = static_cast<std::uint16_t>((options.event_ns + 500'000) / 1'000'000);
    }
    return true;
}

/// Reads the PDO given by the words. Returns false after printing the reason.
bool present(NodeClient& station, const Options& options, std::uint8_t node,
             const ObjectNames& names, PdoSettings& p) {
    const Abort why = read_pdo(station, node, names, p);
    if (why == Abort::none) return true;
    SdoRequest request{.index = p.communication_index(), .sub = 1};
    request.abort = why;
    request.aborted_by_server = why != Abort::timeout;
    if (why == Abort::no_object || why == Abort::no_sub) {
        fail(options, fmt::format("node {} has no {}; to list its PDOs: hal can pdo show {} {}",
                                  node, p.name(), options.words[0], node));

        return false;
    }
    station.fail_transfer(node, request, ObjectName{p.communication_index(), 1, {}, {}}.label());

    return false;
}

/// Replaces the mapping by the objects after the PDO on the command line, if there are any. Returns
/// false after printing the reason.
bool map_objects(const PdoMapOptions& options, NodeClient& station, std::uint8_t node,
                 const ObjectNames& names, PdoSettings& p) {
    const std::span<const std::string> objects = std::span(options.words).subspan(3);
    if (!objects.empty()) {
        p.mapping.clear();
    }
    for (const std::string& word : objects) {
        PdoSettings::Item item;
        std::string problem;
        if (!parse_item(station, node, names, word, item, problem)) {
            fail(options, problem);
            return false;
        }
        p.mapping.push_back(std::move(item));
    }
    if (p.bits() > 64) {
        fail(options,
             fmt::format(
                 "mapping too long: {} bits, a PDO holds 64; map {} bits less, or use a second PDO",
                 p.bits(), p.bits() - 64));
        return false;
    }
    return true;
}

/// Writes the new settings; at a failure the old ones again. Returns the exit status.
int write_or_restore(const PdoMapOptions& options, NodeClient& station, std::uint8_t node,
                     const PdoSettings& before, const PdoSettings& after) {
    SdoRequest last;
    const Step* failed = nullptr;
    const std::vector<Step> steps = steps_to(after, before.cob);
    if (write_steps(station, node, steps, failed, last)) return 0;
    const std::string step =
        fmt::format("{:04X}:{:X} (to {})", failed->index, failed->sub, failed->what);
    const int status = station.fail_transfer(node, last, step);
    const std::vector<Step> back = steps_to(before, before.cob);
    const bool restored =
        !station.bus.stop.requested() && write_steps(station, node, back, failed, last);
    fail(options, restored ? fmt::format("{} restored", before.name())
                           : fmt::format("{} may be disabled now; to check: hal can pdo show",
                                         before.name()));
    return status;
}

bool are_equal(const PdoSettings& a, const PdoSettings& b) {
    return std::ranges::equal(a.mapping, b.mapping, {}, &PdoSettings::Item::entry,
                              &PdoSettings::Item::entry) &&
           a.transmission == b.transmission && a.cob == b.cob;
}

/// Prints what the node has after the writes. Returns the exit status.
int print_written(const PdoMapOptions& options, NodeClient& station, std::uint8_t node,
                  const ObjectNames& names, const PdoSettings& written) {
    PdoSettings now = written;
    if (read_pdo(station, node, names, now) != Abort::none) {
        return fail(options, "cannot read back the written values");
    }
    const bool printed = print(lines_of(now));
    if (!are_equal(now, written)) {
        return fail(options, "the node accepted every write but has other values now, as shown");
    }
    return exit_code(printed);
}

}  // namespace

int run_can_pdo_map(const PdoMapOptions& options) {
    std::uint8_t node = 0;
    ObjectNames names;
    PdoSettings before;
    if (!read_words(options, true, node, names, &before)) return 1;
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0]) || !present(station, options, node, names, before)) {
        return 1;
    }
    PdoSettings after = before;
    if (!map_objects(options, station, node, names, after)) return 1;
    if (!parse_options(options, after)) return 1;
    after.cob &= ~canopen::cob_invalid;
    if (canopen::cob_id(after.cob) == 0) {
        const unsigned default_id = (after.received ? 0x200U : 0x180U) + node;
        return fail(options, fmt::format("{} has no identifier; add --id, such as --id {:X}",
                                         after.name(), default_id));
    }
    const int status = write_or_restore(options, station, node, before, after);
    if (status != 0) return status;
    return print_written(options, station, node, names, after);
}

namespace {

int set_on(const PdoSwitchOptions& options, bool on) {
    std::uint8_t node = 0;
    ObjectNames names;
    PdoSettings p;
    if (!read_words(options, true, node, names, &p)) return 1;
    if (options.words.size() > 3) {
        return fail(options, fmt::format("unexpected argument '{}'", options.words[3]));
    }
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0]) || !present(station, options, node, names, p)) return 1;
    if (on && canopen::cob_id(p.cob) == 0) {
        return fail(
            options,
            fmt::format("{0} has no identifier; type: hal can pdo map {1} {2} {3} --id {4:X}",
                        p.name(), options.words[0], node, options.words[2],
                        (p.received ? 0x200U : 0x180U) + node));
    }
    std::uint8_t bytes[4];
    canopen::store(bytes, on ? p.cob & ~canopen::cob_invalid : p.cob | canopen::cob_invalid);
    SdoRequest request{.index = p.communication_index(), .sub = 1, .data = bytes};
    if (station.transfer(node, request)) return 0;
    return station.fail_transfer(node, request,
                                 ObjectName{p.communication_index(), 1, {}, {}}.label());
}

/// Extracts a value from a frame, lowest bit first.
std::vector<std::uint8_t> field(const can::Frame& f, unsigned first, unsigned bits) {
    std::vector<std::uint8_t> bytes((bits + 7) / 8);
    for (unsigned n = 0; n < bits; ++n) {
        if ((f.data[(first + n) / 8] >> ((first + n) % 8) & 1) != 0) {
            bytes[n / 8] |= static_cast<std::uint8_t>(1U << n % 8);
        }
    }
    return bytes;
}

std::string values_of(const PdoSettings& p, const can::Frame& f, bool json) {
    std::string text;
    unsigned first = 0;
    for (const PdoSettings::Item& item : p.mapping) {
        if (first + item.bits > f.length * 8U) {
            if (!json) {
                text += fmt::format("  short: {} of {} bytes", f.length, (p.bits() + 7) / 8);
            }
            break;
        }
        const auto bytes = field(f, first, item.bits);
        first += item.bits;
        if (item.object.name == "dummy") continue;
        const canopen::Type type = canopen::bits_of(item.object.type) == item.bits
                                       ? item.object.type
                                       : canopen::Type::none;
        const std::string number = fmt::format("{:04X}:{:X}", item.object.index, item.object.sub);
        if (json) {
            text += fmt::format(R"({}"{}":{})", text.empty() ? "" : ",", number,
                                value_json(bytes, type));
        } else {
            text += fmt::format("  {} = {}", item.object.name.empty() ? number : item.object.name,
                                value_text(bytes, type));
        }
    }
    return text;
}

/// Reads the enabled PDOs of a node; on a capture, where no node can be read, from its description.
/// Returns an empty vector after printing the reason.
std::vector<PdoSettings> enabled_pdos(const PdoWatchOptions& options, NodeClient& station,
                                      std::uint8_t node, const ObjectNames& names) {
    std::vector<PdoSettings> pdos;
    if (station.bus.is_capture()) {
        pdos = described_pdos(names, node);
        if (pdos.empty()) {
            fail(options,
                 "cannot read the PDOs of a node from a capture; add --eds FILE, an EDS or "
                 "DCF that describes them");
            return pdos;
        }
    } else if (!read_pdos(station, options, node, names, pdos)) {
        return {};
    }
    std::erase_if(pdos, [](const PdoSettings& p) { return !p.on(); });
    if (pdos.empty()) {
        fail(options,
             fmt::format("all PDOs of node {} are disabled; to enable one: hal can pdo enable",
                         node));
    }
    return pdos;
}

/// Prints the values of received PDOs, with their times since the first frame.
class PdoPrinter {
public:
    /// `max_count`: number of PDOs after which it is done; 0: unlimited.
    PdoPrinter(const std::vector<PdoSettings>& pdos, bool json, std::uint64_t max_count)
        : pdos_(pdos), json_(json), max_count_(max_count) {}

    /// Prints those of a batch. Returns whether to continue: not after `max_count`, nor after a
    /// failure to print.
    bool print_batch(std::span<const can::Frame> batch) {
        std::string text;
        for (const can::Frame& frame : batch) {
            if (!first_ns_) {
                first_ns_ = frame.time_ns;
            }
            const PdoSettings* const pdo = find(frame);
            if (!pdo) continue;
            text += line(*pdo, frame);
            ++count_;
            if (is_done()) break;
        }
        printed_ = print(text);
        return printed_ && !is_done();
    }
    /// Returns whether everything could be printed.
    bool succeeded() const { return printed_; }

private:
    bool is_done() const { return max_count_ != 0 && count_ == max_count_; }
    /// Returns the PDO that a node sent in this frame, or nullptr.
    const PdoSettings* find(const can::Frame& frame) const {
        if (frame.own || frame.error) return nullptr;
        const auto pdo = std::ranges::find_if(
            pdos_, [&](const PdoSettings& candidate) { return candidate.matches(frame); });
        return pdo == pdos_.end() ? nullptr : &*pdo;
    }
    std::string line(const PdoSettings& pdo, const can::Frame& frame) const {
        const double time_s = static_cast<double>(frame.time_ns - *first_ns_) / 1e9;
        const std::string values = values_of(pdo, frame, json_);
        if (json_) {
            return fmt::format("{{\"time\":{:.6f},\"pdo\":\"{}\",\"values\":{{{}}}}}\n", time_s,
                               pdo.name(), values);
        }
        return fmt::format("{:12.6f}  {:6}{}\n", time_s, pdo.name(), values);
    }

    const std::vector<PdoSettings>& pdos_;
    const bool json_;
    const std::uint64_t max_count_;
    std::uint64_t count_ = 0;
    std::optional<std::int64_t> first_ns_;  // time of the first frame, of a PDO or not
    bool printed_ = true;
};

}  // namespace

int run_can_pdo_enable(const PdoSwitchOptions& options) { return set_on(options, true); }
int run_can_pdo_disable(const PdoSwitchOptions& options) { return set_on(options, false); }

int run_can_pdo_watch(const PdoWatchOptions& options) {
    std::uint8_t node = 0;
    ObjectNames names;
    if (!read_words(options, false, node, names, nullptr)) return 1;
    NodeClient station(options, options.timeout_ns);
    if (!station.open(options.words[0])) return 1;
    const std::vector<PdoSettings> pdos = enabled_pdos(options, station, node, names);
    if (pdos.empty()) return 1;
    station.bus.announce(options);
    PdoPrinter printer(pdos, options.json, options.count);
    listen(station.bus, options.for_ns,
           [&](std::span<const can::Frame> batch) { return printer.print_batch(batch); });
    return exit_code(printer.succeeded());
}

}  // namespace hal::tools
