// SPDX-License-Identifier: MIT
#include "ethercat/config/data_copies.hpp"

#include <algorithm>
#include <bit>

namespace hal::ethercat::config {

namespace {

using master::Type;

constexpr unsigned max_value_bits = 64;

/// Calls `use(sync manager, pdo, entry, bit)` for each entry of the process data in a direction.
/// `bit` is its offset in the process data of the sync manager.
template <class Slave, class Use>
void for_each_entry(Slave& slave, bool output, Use use) {
    for (std::size_t n = 0; n < slave.sync_managers.size(); ++n) {
        auto& sm = slave.sync_managers[n];
        if (sm.output != output) continue;
        std::size_t bit = 0;
        for (auto& pdo : sm.pdos) {
            for (auto& entry : pdo.entries) {
                use(n, pdo, entry, bit);
                bit += entry.bits;
            }
        }
    }
}

bool is_signed_entry(const master::Entry& e) { return e.is_signed || is_signed(e.type); }

/// Returns what the value of an object is, for messages: "a bit", "unsigned".
const char* kind_of(const master::Entry& e) {
    if (e.type == Type::bit) return "a bit";
    if (is_real(e.type)) return "a real";
    return is_signed_entry(e) ? "signed" : "unsigned";
}

/// Returns the type that gives an object the kind of another one: "s16".
std::string type_like(const master::Entry& e) {
    if (is_real(e.type)) return e.bits == 64 ? "f64" : "f32";
    const unsigned bits = std::max(8U, std::bit_ceil(static_cast<unsigned>(e.bits)));
    return (is_signed_entry(e) ? "s" : "u") + std::to_string(bits);
}

std::string direction_text(bool output) { return output ? "outputs" : "inputs"; }

}  // namespace

std::optional<DataLocation> locate(const Bus& bus, std::size_t slave, bool output,
                                   std::uint16_t index, std::uint8_t sub) {
    std::optional<DataLocation> found;
    for_each_entry(bus.setup.slaves[slave], output,
                   [&](std::size_t sm, const auto&, const master::Entry& entry, std::size_t bit) {
        if (!found && entry.index == index && entry.sub == sub) {
            found = DataLocation{slave, sm, bit};
        }
    });
    return found;
}

std::size_t bits_behind(const Bus& bus, const DataLocation& location) {
    std::size_t bits = 0;
    const auto& slave = bus.setup.slaves[location.slave];
    for (const master::Pdo& pdo : slave.sync_managers[location.sync_manager].pdos) {
        for (const master::Entry& entry : pdo.entries) {
            bits += entry.bits;
        }
    }
    return bits - location.bit;
}

void DataCopyReader::read(Section& section) {
    for (Line& line : section.entries) {
        line.used = true;
        read_line(line);
    }
}

void DataCopyReader::read_line(Line& line) {
    const auto words = words_of(line.value);
    if (words.empty()) {
        report_.error(Topic::line, line.key.at, "'" + line.key.text + "' has no source",
                      "write SLAVE.OBJECT of an output = SLAVE.OBJECT of an input");
        return;
    }
    const auto to = parse_end(line.key, true);
    const auto from = parse_end(words[0], false);
    if (!to || !from || !check(*to, *from)) return;
    DataCopy rules;
    if (!parse_loss(line, words, to->parts.front().bits, rules)) return;
    for (master::Entry* entry : to->entries) {
        const auto [at, fresh] = copied_.try_emplace(entry, line.key.at.line);
        if (!fresh) {
            report_.error(Topic::slave, line.key.at,
                          "duplicate copy to '" + line.key.text + "': an output has one source",
                          "delete this line or line " + std::to_string(at->second), "duplicate");
            return;
        }
    }
    for (std::size_t n = 0; n < to->parts.size(); ++n) {
        DataCopy copy = rules;
        copy.from = from->parts[n].at;
        copy.to = to->parts[n].at;
        copy.bits = to->parts[n].bits;
        bus_.copies.push_back(copy);
    }
    for (master::Entry* entry : to->entries) {
        entry->copied = true;
    }
}

std::optional<DataCopyReader::End> DataCopyReader::parse_end(const Word& text, bool output) {
    const std::size_t dot = text.text.find('.');
    if (dot == text.text.npos) {
        report_.error(Topic::line, text.at, "invalid end of a copy: '" + text.text + "'",
                      "write SLAVE.OBJECT, as in x.6064 or x.position-actual-value");
        return std::nullopt;
    }
    const std::string name = text.text.substr(0, dot);
    auto& slaves = bus_.setup.slaves;
    const auto slave = std::find_if(slaves.begin(), slaves.end(),
                                    [&](const master::Slave& one) { return one.name == name; });
    if (slave == slaves.end()) {
        std::vector<std::string> names;
        for (const master::Slave& one : slaves) {
            names.push_back(one.name);
        }
        report_.error(Topic::slave, text::part(text, 0, dot).at, "unknown slave '" + name + "'",
                      suggestion(name, names, "the slaves are"));
        return std::nullopt;
    }
    End end;
    end.text = text;
    end.slave = static_cast<std::size_t>(slave - slaves.begin());
    end.output = output;
    const Word object = text::part(text, dot + 1, text.text.size());
    find_parts(object, end);
    if (!end.parts.empty()) return end;
    report_unknown(object, end);
    return std::nullopt;
}

/// Finds an object by its name or address, with all its samples, or a PDO by its index.
void DataCopyReader::find_parts(const Word& object, End& end) {
    const auto address = parse_address(object, report_);
    if (address && !address->has_sub) {
        find_pdo(address->index, end);
        if (!end.parts.empty()) return;
    }
    const master::Pdo* pdo_of_samples = nullptr;
    std::string name_of_samples;
    for_each_entry(bus_.setup.slaves[end.slave], end.output,
                   [&](std::size_t sm, master::Pdo& pdo, master::Entry& entry, std::size_t bit) {
        if (entry.index == 0) return;
        const bool is_address =
            address && entry.index == address->index && entry.sub == address->sub;
        const bool is_named = !entry.name.empty() && entry.name == object.text;
        const bool is_sample =
            entry.sample && &pdo == pdo_of_samples && entry.name == name_of_samples;
        const bool is_first = end.parts.empty() && (is_address || is_named);
        if (!is_sample && !is_first) return;
        if (entry.sample) {
            pdo_of_samples = &pdo;
            name_of_samples = entry.name;
        }
        end.parts.push_back({{end.slave, sm, bit}, entry.bits, &entry});
        end.entries.push_back(&entry);
    });
}

void DataCopyReader::find_pdo(std::uint16_t index, End& end) {
    for_each_entry(
        bus_.setup.slaves[end.slave], end.output,
        [&](std::size_t sm, const master::Pdo& pdo, master::Entry& entry, std::size_t bit) {
        if (pdo.index != index) return;
        if (end.parts.empty()) {
            end.parts.push_back({{end.slave, sm, bit}, 0, nullptr});
        }
        end.parts.front().bits += entry.bits;
        end.entries.push_back(&entry);
    });
}

void DataCopyReader::report_unknown(const Word& object, const End& end) {
    const master::Slave& slave = bus_.setup.slaves[end.slave];
    End other = end;
    other.output = !end.output;
    find_parts(object, other);
    std::vector<std::string> names;
    for_each_entry(slave, end.output,
                   [&](std::size_t, const auto&, const master::Entry& entry, std::size_t) {
        if (!entry.name.empty() && entry.sample.value_or(0) == 0) {
            names.push_back(entry.name);
        }
    });
    const std::string which = "the " + direction_text(end.output) + " of '" + slave.name + "'";
    const std::string list = names.empty()
                                 ? "'" + slave.name + "' has no " + direction_text(end.output)
                                 : suggestion(object.text, names, which + " are");
    if (!other.parts.empty()) {
        report_.error(Topic::object, object.at,
                      "'" + object.text + "' is one of the " + direction_text(other.output) +
                          " of '" + slave.name + "'; a copy goes from an input to an output",
                      list);
        return;
    }
    report_.error(Topic::object, object.at, "'" + object.text + "' is not among " + which, list);
}

/// Checks that both ends are alike. Returns false after reporting that they are not.
bool DataCopyReader::check(const End& to, const End& from) {
    const auto size_of = [](const End& end) {
        return "'" + end.text.text + "' has " + counted(end.parts.front().bits, "bit");
    };
    if (to.parts.size() != from.parts.size()) {
        report_.error(Topic::value, from.text.at,
                      "'" + from.text.text + "' has " + counted(from.parts.size(), "sample") +
                          ", '" + to.text.text + "' has " + std::to_string(to.parts.size()),
                      "set oversampling of both slaves to the same number");
        return false;
    }
    if (to.parts.front().bits != from.parts.front().bits) {
        report_.error(Topic::value, from.text.at,
                      size_of(from) + ", " + size_of(to).substr(0, size_of(to).rfind(' ')),
                      "copy objects of the same size, or link their pins in the netlist");
        return false;
    }
    return check_types(to, from);
}

bool DataCopyReader::check_types(const End& to, const End& from) {
    const master::Entry* const target = to.parts.front().entry;
    const master::Entry* const source = from.parts.front().entry;
    const bool have_values =
        target != nullptr && source != nullptr && target->bits <= max_value_bits;
    if (!have_values || std::string_view(kind_of(*target)) == kind_of(*source)) return true;
    std::string help = "link their pins in the netlist";
    if (source->type != Type::bit && target->type != Type::bit) {
        const std::string object = object_text(target->index, target->sub).substr(2);
        help += ", or write " + (target->sub == 0 ? object.substr(0, 4) : object) +
                ".type = " + type_like(*source) + " in the section of '" +
                bus_.setup.slaves[to.slave].name + "'";
    }
    report_.error(Topic::value, from.text.at,
                  "'" + from.text.text + "' is " + kind_of(*source) + ", '" + to.text.text +
                      "' is " + kind_of(*target),
                  help);
    return false;
}

/// Parses `safe VALUE` or `hold` behind the source; without them, 0 is sent.
bool DataCopyReader::parse_loss(const Line& line, const std::vector<Word>& words, unsigned bits,
                                DataCopy& copy) {
    if (words.size() == 1) return true;
    if (words.size() == 2 && same_word(words[1].text, "hold")) {
        copy.hold = true;
        return true;
    }
    if (words.size() != 3 || !same_word(words[1].text, "safe")) {
        report_.error(Topic::value, words[1].at, "invalid copy '" + line.value.text + "'",
                      "after the source, write hold, or safe and a value, as in safe 0");
        return false;
    }
    const bool negative = words[2].text.starts_with('-');
    const auto number = parse_natural(std::string_view(words[2].text).substr(negative ? 1 : 0));
    const std::uint64_t all_ones =
        bits >= max_value_bits ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    const std::uint64_t max = negative ? all_ones / 2 + 1 : all_ones;
    if (bits > max_value_bits || !number || *number > max) {
        report_.error(Topic::value, words[2].at, "invalid safe value '" + words[2].text + "'",
                      bits > max_value_bits
                          ? "more than 64 bits are 0 or hold their last value"
                          : "write a number of " + counted(bits, "bit") + ", decimal or with 0x");
        return false;
    }
    copy.safe = negative ? (~*number + 1) & all_ones : *number;
    return true;
}

}  // namespace hal::ethercat::config
