// SPDX-License-Identifier: MIT
#include "concise_dcf.hpp"

#include <algorithm>
#include <iterator>

#include "cia301/values.hpp"
#include "eds_reader.hpp"

namespace hal::canopen::eds {

namespace {

void append(std::vector<std::uint8_t>& out, std::uint64_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; ++i) {
        out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
}

constexpr std::uint32_t pdo_off = 0x80000000;

bool is_communication(std::uint16_t index) {
    return (index >= 0x1400 && index < 0x1600) || (index >= 0x1800 && index < 0x1A00);
}
bool is_mapping(std::uint16_t index) {
    return (index >= 0x1600 && index < 0x1800) || (index >= 0x1A00 && index < 0x1C00);
}

class Maker {
public:
    Maker(const DeviceDescription& d, unsigned node_id, bool all)
        : d_(d), node_(node_id != 0 ? node_id : d.node_id()), all_(all) {}

    Configuration make() {
        for (const Object& object : d_.objects) {
            if (is_mapping(object.index)) {
                if (d_.find(static_cast<std::uint16_t>(object.index - 0x200)) == nullptr) {
                    plain(object);
                }
                continue;  // with its communication parameters
            }
            if (is_communication(object.index)) {
                pdo(object);
            } else {
                plain(object);
            }
        }
        return std::move(out_);
    }

private:
    void leave_out(const Entry& entry, std::uint16_t index, std::string why, std::string help = "",
                   Severity severity = Severity::warning) {
        out_.messages.push_back(
            {severity, Topic::value, entry.at,
             "the value of " + label(index, entry.sub) + " is not configured: " + std::move(why),
             std::move(help)});
    }

    /// The bytes to write; none when there is nothing to do.
    std::optional<std::vector<std::uint8_t>> wanted(std::uint16_t index, const Entry& entry,
                                                    bool differing_only = true) {
        if (entry.parameter_value.empty()) {
            return {};
        }
        const Encoded value = encode(entry.parameter_value, entry.data_type, node_);
        const Encoded before = encode(entry.default_value, entry.data_type, node_);
        if (value && before && value.bytes == before.bytes && differing_only && !all_) {
            return {};
        }
        if (!entry.writable()) {
            if (value && before && value.bytes != before.bytes && !before.bytes.empty()) {
                leave_out(entry, index, "it is " + std::string(name_of(entry.access)),
                          "it has to be what the device holds: " + entry.default_value);
            }
            return {};
        }
        if (index == 0x1010 || index == 0x1011) {
            leave_out(entry, index, "writing it stores or restores parameters");
            return {};
        }
        if (!value) {
            leave_out(entry, index, value.error,
                      "correct ParameterValue=" + entry.parameter_value.substr(0, 60),
                      Severity::error);
            return {};
        }
        if (value.node_id && node_ == 0) {
            leave_out(entry, index, "it depends on the node-id, and no node-id is given",
                      "NodeID=… of [DeviceComissioning] gives one", Severity::error);
            return {};
        }
        return value.bytes;
    }

    void plain(const Object& object) {
        // A mapping's number of entries is written last.
        std::optional<Write> last;
        for (const Entry& entry : object.entries) {
            auto data = wanted(object.index, entry);
            if (!data) continue;
            Write write{object.index, entry.sub, std::move(*data)};
            if (entry.sub == 0 && !object.single()) {
                last = std::move(write);
            } else {
                out_.writes.push_back(std::move(write));
            }
        }
        if (last) {
            out_.writes.push_back(std::move(*last));
        }
    }

    /// Adds the writes of a PDO in the order that CiA 301 prescribes: switch it off, set the number
    /// of mapped objects to 0, write the mapping, then that number, the other parameters, and last
    /// the COB-ID that switches it on. A PDO that cannot be switched off gets its values as they
    /// are.
    void pdo(const Object& communication) {
        const Object* const mapping =
            d_.find(static_cast<std::uint16_t>(communication.index + 0x200));
        const std::vector<Write> settings = changes(communication);
        const std::vector<Write> mapped =
            mapping != nullptr ? changes(*mapping) : std::vector<Write>();
        if (settings.empty() && mapped.empty()) return;
        const Entry* const cob = communication.find(1);
        if (cob == nullptr || !cob->writable()) {  // cannot be switched off
            add_from(settings, 0);
            add_from(mapped, 0);
            return;
        }
        const std::vector<std::uint8_t> final_cob = value_of(*cob, node_);
        const bool is_known = final_cob.size() == 4;
        if (is_known) {
            add(communication.index, 1, cia301::natural_of(final_cob) | pdo_off, 4);
        }
        if (!mapped.empty()) {
            add_mapping(*mapping, mapped);
        }
        add_from(settings, 2);
        if (is_known && (cia301::natural_of(final_cob) & pdo_off) == 0) {
            out_.writes.push_back({communication.index, 1, final_cob});
        }
    }

    std::vector<Write> changes(const Object& object) {
        std::vector<Write> writes;
        for (const Entry& entry : object.entries) {
            if (auto data = wanted(object.index, entry)) {
                writes.push_back({object.index, entry.sub, std::move(*data)});
            }
        }
        return writes;
    }

    /// The number of mapped objects is 0 while the mapping is written.
    void add_mapping(const Object& mapping, const std::vector<Write>& mapped) {
        const Entry* const count = mapping.find(0);
        const bool is_counted = count != nullptr && count->writable();
        if (is_counted) {
            add(mapping.index, 0, 0, 1);
        }
        add_from(mapped, 1);
        if (!is_counted) return;
        const std::vector<std::uint8_t> number = value_of(*count, node_);
        if (!number.empty()) {
            out_.writes.push_back({mapping.index, 0, number});
        }
    }

    /// Adds those of the sub-indices from `first` on.
    void add_from(const std::vector<Write>& writes, unsigned first) {
        std::ranges::copy_if(writes, std::back_inserter(out_.writes),
                             [first](const Write& write) { return write.sub >= first; });
    }

    void add(std::uint16_t index, std::uint8_t sub, std::uint64_t value, unsigned bytes) {
        Write write{index, sub, {}};
        append(write.data, value, bytes);
        out_.writes.push_back(std::move(write));
    }

    const DeviceDescription& d_;
    unsigned node_;
    bool all_;
    Configuration out_;
};

}  // namespace

std::vector<std::uint8_t> value_of(const Entry& entry, unsigned node_id) {
    Encoded value =
        encode(entry.parameter_value.empty() ? entry.default_value : entry.parameter_value,
               entry.data_type, node_id);
    return value ? std::move(value.bytes) : std::vector<std::uint8_t>();
}

Configuration configuration_of(const DeviceDescription& dcf, unsigned node_id, bool all) {
    return Maker(dcf, node_id, all).make();
}

std::vector<std::uint8_t> concise(std::span<const Write> writes) {
    std::vector<std::uint8_t> out;
    append(out, writes.size(), 4);
    for (const Write& write : writes) {
        append(out, write.index, 2);
        append(out, write.sub, 1);
        append(out, write.data.size(), 4);
        out.insert(out.end(), write.data.begin(), write.data.end());
    }
    return out;
}

std::optional<std::vector<Write>> parse_concise(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t head = 7;
    if (bytes.size() < 4) {
        return {};
    }
    const std::uint64_t count = cia301::natural_of(bytes.first(4));
    bytes = bytes.subspan(4);
    if (count > bytes.size() / head) {
        return {};
    }
    std::vector<Write> out;
    for (std::uint64_t i = 0; i < count; ++i) {
        if (bytes.size() < head) {
            return {};
        }
        const std::uint64_t size = cia301::natural_of(bytes.subspan(3, 4));
        if (size > bytes.size() - head) {
            return {};
        }
        out.push_back(
            {static_cast<std::uint16_t>(cia301::natural_of(bytes.first(2))), bytes[2], {}});
        const auto data = bytes.subspan(head, static_cast<std::size_t>(size));
        out.back().data.assign(data.begin(), data.end());
        bytes = bytes.subspan(head + data.size());
    }
    if (!bytes.empty()) {
        return {};
    }
    return out;
}

}  // namespace hal::canopen::eds
