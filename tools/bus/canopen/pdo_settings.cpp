// SPDX-License-Identifier: MIT
#include "bus/canopen/pdo_settings.hpp"

#include <fmt/core.h>
#include <functional>

#include "cli/output.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using canopen::Abort;
using canopen::SdoRequest;

namespace {

constexpr unsigned max_pdos = 512;      // of each direction
constexpr unsigned pdos_per_axis = 64;  // CiA 402: an offset per axis
constexpr unsigned max_dummy_index = 7;  // CiA 301: objects that fill a gap in a mapping

/// Reads a value from the node, or from its description. Returns the abort code of a value that
/// cannot be read.
using Source = std::function<Abort(std::uint16_t index, std::uint8_t sub, std::uint32_t& value)>;

Source of_node(NodeClient& station, std::uint8_t node) {
    return [&station, node](std::uint16_t index, std::uint8_t sub, std::uint32_t& value) {
        std::uint8_t buffer_bytes[8] = {};
        SdoRequest request{.index = index, .sub = sub, .upload = true, .buffer = buffer_bytes};
        station.transfer(node, request);
        value = canopen::load<std::uint32_t>(buffer_bytes);
        // A missing response is not an abort.
        return request.ok() || request.aborted_by_server ? request.abort : Abort::timeout;
    };
}

Source of_description(const canopen::eds::DeviceDescription& d, std::uint8_t node) {
    return [&d, node](std::uint16_t index, std::uint8_t sub, std::uint32_t& value) {
        const canopen::eds::Entry* entry = d.find(index, sub);
        if (!entry) return Abort::no_object;
        const std::string& text =
            entry->parameter_value.empty() ? entry->default_value : entry->parameter_value;
        const auto bytes = canopen::eds::encode(text, entry->data_type, node).bytes;
        value = 0;
        for (std::size_t n = 0; n < bytes.size() && n < 4; ++n) {
            value |= std::uint32_t{bytes[n]} << (8 * n);
        }
        return Abort::none;
    };
}

/// Reads objects of one PDO. A node that did not respond once is not asked again.
class ObjectReader {
public:
    explicit ObjectReader(const Source& source) : source_(source) {}

    /// Returns whether the object was read; if not, `value` is unchanged.
    template <class Value> bool read(std::uint16_t index, std::uint8_t sub, Value& value) {
        if (timed_out()) return false;
        std::uint32_t number = 0;
        abort_ = source_(index, sub, number);
        if (abort_ != Abort::none) return false;
        value = static_cast<Value>(number);
        return true;
    }
    /// Returns why the last object was not read.
    Abort abort() const { return abort_; }
    bool timed_out() const { return abort_ == Abort::timeout; }

private:
    const Source& source_;
    Abort abort_ = Abort::none;
};

std::vector<PdoSettings::Item> read_mapping(ObjectReader& reader, const ObjectNames& names,
                                            const PdoSettings& p) {
    std::vector<PdoSettings::Item> mapping;
    if (p.is_multiplexed()) return mapping;
    for (unsigned n = 1; n <= p.count; ++n) {
        std::uint32_t entry = 0;  // of CiA 301: index, sub-index, length in bits
        reader.read(p.mapping_index(), static_cast<std::uint8_t>(n), entry);
        ObjectName object = names.named(static_cast<std::uint16_t>(entry >> 16),
                                        static_cast<std::uint8_t>(entry >> 8));
        if (object.index <= max_dummy_index && object.name.empty()) {
            object.name = "dummy";
        }
        mapping.push_back({std::move(object), entry & 0xff});
    }
    return mapping;
}

/// Reads the PDO of `p.received` and `p.number`. Returns Abort::timeout if the node stops
/// responding, and the reason if there is no such PDO. A parameter that the PDO does not have keeps
/// its default.
Abort read_settings(const Source& source, const ObjectNames& names, PdoSettings& p) {
    const std::uint16_t communication = p.communication_index();
    ObjectReader reader(source);
    if (!reader.read(communication, 1, p.cob)) return reader.abort();
    reader.read(communication, 2, p.transmission);
    p.has_inhibit = reader.read(communication, 3, p.inhibit_100us);
    p.has_event = reader.read(communication, 5, p.event_ms);
    if (!p.received) {
        reader.read(communication, 6, p.sync_start);
    }
    reader.read(p.mapping_index(), 0, p.count);
    p.mapping = read_mapping(reader, names, p);
    return reader.timed_out() ? Abort::timeout : Abort::none;
}

/// Returns the numbers of the RPDOs (`received`) or TPDOs that a description has.
std::vector<unsigned> described_numbers(const canopen::eds::DeviceDescription& description,
                                        bool received) {
    const unsigned first = PdoSettings::first_communication_index(received);
    std::vector<unsigned> numbers;
    for (const canopen::eds::Object& object : description.objects) {
        if (object.index >= first && object.index < first + max_pdos) {
            numbers.push_back(object.index - first + 1);
        }
    }
    return numbers;
}

/// Reads the PDOs of a node one after the other.
class PdoCollector {
public:
    PdoCollector(NodeClient& station, std::uint8_t node, const ObjectNames& names)
        : station_(station), node_(node), names_(names) {}

    /// Reads those that the description has. Returns false after printing why the node does not
    /// respond.
    bool read_described(const canopen::eds::DeviceDescription& description, bool received) {
        for (const unsigned number : described_numbers(description, received)) {
            if (read(received, number) == Outcome::no_response) return false;
        }
        return true;
    }
    /// Without a description: tries the PDOs of each axis in the order of their numbers, until as
    /// many are missing one after the other that there are certainly no more. Returns
    /// false after printing why the node does not respond.
    bool probe(bool received) {
        for (unsigned offset = 0; offset < max_pdos; offset += pdos_per_axis) {
            const unsigned sufficient = offset == 0 ? 4 : 1;
            unsigned missing = 0;
            for (unsigned n = 1; n <= pdos_per_axis && missing < sufficient; ++n) {
                const Outcome outcome = read(received, offset + n);
                if (outcome == Outcome::no_response) return false;
                missing = outcome == Outcome::missing ? missing + 1 : 0;
            }
        }
        return true;
    }
    std::vector<PdoSettings> take() { return std::move(pdos_); }

private:
    enum class Outcome { present, missing, no_response };

    /// Reads a PDO and adds it. Prints a missing response.
    Outcome read(bool received, unsigned number) {
        PdoSettings pdo;
        pdo.received = received;
        pdo.number = number;
        const Abort abort = read_pdo(station_, node_, names_, pdo);
        if (abort == Abort::timeout) {
            report_timeout(pdo);
            return Outcome::no_response;
        }
        if (abort != Abort::none) return Outcome::missing;
        pdos_.push_back(std::move(pdo));
        return Outcome::present;
    }
    void report_timeout(const PdoSettings& pdo) const {
        const ObjectName identifier{pdo.communication_index(), 1, {}, {}};
        SdoRequest request{.index = identifier.index, .sub = identifier.sub};
        request.abort = Abort::timeout;
        station_.fail_transfer(node_, request, identifier.label());
    }

    NodeClient& station_;
    const std::uint8_t node_;
    const ObjectNames& names_;
    std::vector<PdoSettings> pdos_;
};

}  // namespace

unsigned PdoSettings::bits() const {
    unsigned sum = 0;
    for (const Item& item : mapping) {
        sum += item.bits;
    }
    return sum;
}
std::string PdoSettings::name() const {
    return fmt::format("{}PDO{}", received ? 'R' : 'T', number);
}
std::string PdoSettings::identifier() const {
    return on() ? fmt::format("{:0{}X}", canopen::cob_id(cob),
                              (cob & canopen::cob_extended) != 0 ? 8 : 3)
                : "off";
}
std::string PdoSettings::timing() const {
    std::string text;
    if (transmission <= 240 && received) {
        text = "applied at the SYNC";
    } else if (transmission == 0) {
        text = "at the SYNC after an event";
    } else if (transmission == 1) {
        text = "every SYNC";
    } else if (transmission <= 240) {
        text = fmt::format("every {} SYNCs", transmission);
    } else if (transmission == 252) {
        text = "on request, of the last SYNC";
    } else if (transmission == 253) {
        text = "on request";
    } else if (transmission >= 254) {
        text = received ? "at once" : "on event";
    } else {
        text = fmt::format("type {}", transmission);
    }
    if (inhibit_100us != 0 && !received) {
        text += fmt::format(", inhibit time {:g} ms", inhibit_100us / 10.0);
    }
    if (event_ms != 0) {
        text += received ? fmt::format(", at least every {} ms", event_ms)
                         : fmt::format(" or after {} ms", event_ms);
    }
    if (sync_start != 0) {
        text += fmt::format(", from SYNC {}", sync_start);
    }
    return text;
}

bool parse_pdo(const std::string& text, PdoSettings& p) {
    if (text.size() < 5 || !canopen::eds::same_word(text.substr(1, 3), "pdo")) return false;
    const char kind = text[0];
    p.received = kind == 'r' || kind == 'R';
    return (p.received || kind == 't' || kind == 'T') && parse_whole(text.substr(4), p.number) &&
           p.number >= 1 && p.number <= 512;
}

Abort read_pdo(NodeClient& station, std::uint8_t node, const ObjectNames& names, PdoSettings& p) {
    return read_settings(of_node(station, node), names, p);
}

bool read_pdos(NodeClient& station, const Options& options, std::uint8_t node,
               const ObjectNames& names, std::vector<PdoSettings>& out) {
    PdoCollector collector(station, node, names);
    const canopen::eds::DeviceDescription* const description = names.description();
    for (const bool received : {true, false}) {
        const bool responds = description ? collector.read_described(*description, received)
                                          : collector.probe(received);
        if (!responds) return false;
    }
    out = collector.take();
    if (out.empty()) {
        fail(options, fmt::format("node {} has no PDOs", node));
        return false;
    }
    return true;
}

std::vector<PdoSettings> described_pdos(const ObjectNames& names, std::uint8_t node) {
    std::vector<PdoSettings> out;
    const canopen::eds::DeviceDescription* const description = names.description();
    if (!description) return out;
    const Source source = of_description(*description, node);
    for (const bool received : {true, false}) {
        for (const unsigned number : described_numbers(*description, received)) {
            PdoSettings pdo;
            pdo.received = received;
            pdo.number = number;
            if (read_settings(source, names, pdo) == Abort::none) {
                out.push_back(std::move(pdo));
            }
        }
    }
    return out;
}

}  // namespace hal::tools
