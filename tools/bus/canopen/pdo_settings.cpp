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

/// Reads a value from the node, or from its description. Returns false when there is none.
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

Abort fill(const Source& source, const ObjectNames& names, PdoSettings& p) {
    std::uint32_t value = 0;
    const auto get = [&](std::uint16_t index, std::uint8_t sub, auto& to) {
        const Abort why = source(index, sub, value);
        if (why == Abort::none) {
            to = static_cast<std::remove_reference_t<decltype(to)>>(value);
        }
        return why;
    };
    const std::uint16_t index = p.communication_index();
    if (const Abort why = get(index, 1, p.cob); why != Abort::none) return why;
    std::vector<Abort> rest{get(index, 2, p.transmission)};
    rest.push_back(get(index, 3, p.inhibit_100us));
    p.has_inhibit = rest.back() == Abort::none;
    rest.push_back(get(index, 5, p.event_ms));
    p.has_event = rest.back() == Abort::none;
    if (!p.received) {
        rest.push_back(get(index, 6, p.sync_start));
    }
    rest.push_back(get(p.mapping_index(), 0, p.count));
    p.mapping.clear();
    for (unsigned n = 1; n <= p.count && n <= 64; ++n) {
        std::uint32_t entry = 0;
        rest.push_back(get(p.mapping_index(), static_cast<std::uint8_t>(n), entry));
        ObjectName object = names.named(static_cast<std::uint16_t>(entry >> 16),
                                        static_cast<std::uint8_t>(entry >> 8));
        if (object.index <= 7 && object.name.empty()) {
            object.name = "dummy";
        }
        p.mapping.push_back({std::move(object), entry & 0xff});
    }
    for (const Abort why : rest) {
        if (why == Abort::timeout) return why;
    }
    return Abort::none;
}

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
    return fill(of_node(station, node), names, p);
}

bool read_pdos(NodeClient& station, const Options& options, std::uint8_t node,
               const ObjectNames& names, std::vector<PdoSettings>& out) {
    const auto take = [&](bool received, unsigned number, bool& there) {
        PdoSettings p;
        p.received = received;
        p.number = number;
        const Abort why = read_pdo(station, node, names, p);
        there = why == Abort::none;
        if (there) {
            out.push_back(std::move(p));
        }
        if (why != Abort::timeout) return true;
        SdoRequest silent{.index = p.communication_index(), .sub = 1};
        silent.abort = Abort::timeout;
        station.fail_transfer(node, silent, ObjectName{p.communication_index(), 1, {}, {}}.label());

        return false;
    };
    bool there = false;
    for (const bool received : {true, false}) {
        if (const auto* d = names.description()) {
            const unsigned base = received ? 0x1400 : 0x1800;
            for (const canopen::eds::Object& object : d->objects) {
                if (object.index >= base && object.index < base + 512 &&
                    !take(received, object.index - base + 1, there)) {
                    return false;
                }
            }
            continue;
        }
        // Without a description: from the first PDO of each axis (they are 64 apart) until four
        // consecutive ones are missing.
        for (unsigned axis = 0; axis < 512; axis += 64) {
            for (unsigned n = 1, missing = 0; n <= 64 && missing < (axis == 0 ? 4U : 1U); ++n) {
                if (!take(received, axis + n, there)) return false;
                missing = there ? 0 : missing + 1;
            }
        }
    }
    if (out.empty()) {
        fail(options, fmt::format("node {} has no PDOs", node));
        return false;
    }
    return true;
}

std::vector<PdoSettings> described_pdos(const ObjectNames& names, std::uint8_t node) {
    std::vector<PdoSettings> out;
    const auto* d = names.description();
    if (!d) return out;
    for (const canopen::eds::Object& object : d->objects) {
        PdoSettings p;
        p.received = object.index < 0x1600;
        const unsigned base = p.received ? 0x1400 : 0x1800;
        if (object.index < base || object.index >= base + 512) continue;
        p.number = object.index - base + 1;
        if (fill(of_description(*d, node), names, p) == Abort::none) {
            out.push_back(std::move(p));
        }
    }
    return out;
}

}  // namespace hal::tools
