// SPDX-License-Identifier: MIT
// Rules between objects, and modules joined to their device.
#include <algorithm>

#include "cia301/values.hpp"
#include "eds_reader.hpp"

namespace hal::canopen::eds {

namespace {

bool has_parameter_value(const Entry& entry) { return !entry.parameter_value.empty(); }

constexpr unsigned max_pdo_bits = 64 * 8;  // CAN FD; a classic frame has 64

class Checks {
public:
    Checks(const DeviceDescription& d, std::vector<Message>& messages)
        : d_(d), messages_(messages), node_(d.node_id(1)) {}

    void run() {
        for (const Object& object : d_.objects) {
            const bool receive = object.index >= 0x1600 && object.index < 0x1800;

            const bool send = object.index >= 0x1A00 && object.index < 0x1C00;
            if (receive || send) {
                mapping(object, receive);
            }
        }
        count(0x1400, d_.device.rx_pdos, d_.device.rx_pdos_at, "NrOfRXPDO");
        count(0x1800, d_.device.tx_pdos, d_.device.tx_pdos_at, "NrOfTXPDO");
        if (!d_.commissioning) {
            values_of_eds();
        }
    }

private:
    void report(Severity severity, Topic topic, const Span& at, std::string sentence,
                std::string help = "") {
        messages_.push_back({severity, topic, at, std::move(sentence), std::move(help)});
    }

    // An EDS describes a type of device; values for one device make a DCF.
    void values_of_eds() {
        const std::size_t all = parameter_values(d_);
        for (const Object& object : d_.objects) {
            const auto entry =
                std::find_if(object.entries.begin(), object.entries.end(), has_parameter_value);
            if (entry == object.entries.end()) continue;
            const std::string where =
                object.single() ? label(object.index) : label(object.index, entry->sub);
            std::string sentence = "parameter value of " + where;
            if (all == 2) {
                sentence += " and 1 more";
            }
            if (all > 2) {
                sentence += " and " + std::to_string(all - 1) + " more";
            }
            report(Severity::note, Topic::value, entry->at,
                   sentence +
                       ": a file without [DeviceComissioning] is an EDS, and a master does not "
                       "write its parameter values",
                   "add [DeviceComissioning] with the NodeID to make it a DCF");
            return;
        }
    }

    std::optional<std::uint64_t> value(const Entry& entry) const {
        const std::string& text =
            entry.parameter_value.empty() ? entry.default_value : entry.parameter_value;
        const Encoded encoded = encode(text, entry.data_type, node_);
        if (!encoded || encoded.bytes.empty() || encoded.bytes.size() > 8) return {};
        return cia301::natural_of(encoded.bytes);
    }

    void mapping(const Object& object, bool receive) {
        const Entry* first = object.find(0);
        const auto mapped = first != nullptr ? value(*first) : std::nullopt;
        if (!mapped || *mapped == 0 || *mapped > 64) return;
        unsigned sum = 0;
        for (unsigned sub = 1; sub <= *mapped; ++sub) {
            const Entry* entry = object.find(static_cast<std::uint8_t>(sub));
            if (entry == nullptr) {
                report(Severity::warning, Topic::object, object.at,
                       label(object.index) + " maps " + std::to_string(*mapped) +
                           " objects, but sub-index " + hex(sub, 1).substr(2) +
                           " is not described");
                break;
            }
            const auto bits = value(*entry);
            if (!bits || *bits == 0) continue;
            sum += one(object, *entry, static_cast<std::uint32_t>(*bits), receive);
        }
        if (sum > max_pdo_bits) {
            report(Severity::warning, Topic::object, object.at,
                   label(object.index) + " maps " + std::to_string(sum) + " bits",
                   "that exceeds every frame");
        } else if (sum > 64) {
            report(Severity::warning, Topic::object, object.at,
                   label(object.index) + " maps " + std::to_string(sum) + " bits",
                   "a classic CAN frame carries 64, only CAN FD carries more");
        }
    }

    /// Returns the number of bits mapped by this entry.
    unsigned one(const Object& object, const Entry& entry, std::uint32_t word, bool receive) {
        const auto index = static_cast<std::uint16_t>(word >> 16);
        const auto sub = static_cast<std::uint8_t>(word >> 8);
        const unsigned bits = word & 0xFF;
        const std::string here = label(object.index, entry.sub) + " maps " +
                                 (sub == 0 ? label(index) : label(index, sub));
        const auto warn = [&](std::string sentence, std::string help = "") {
            report(Severity::warning, Topic::object, entry.at, here + std::move(sentence),
                   std::move(help));
        };
        if (index < 0x20) {  // a dummy
            const DataType* type = data_type(index);
            const bool told = std::any_of(d_.dummies.begin(), d_.dummies.end(),
                                          [&](const auto& dummy) { return dummy.first == index; });
            const bool may = std::any_of(
                d_.dummies.begin(), d_.dummies.end(),
                [&](const auto& dummy) { return dummy.first == index && dummy.second; });
            if (type == nullptr || type->bits == 0) {
                warn(", which is not a data type with a length");
            } else if (!may && told) {
                warn(", which [DummyUsage] does not allow", "write Dummy" + label(index) + "=1");
            }
            return bits;
        }
        const Entry* target = d_.find(index, sub);
        if (target == nullptr) {
            warn(", which is not described");
            return bits;
        }
        const DataType* type = data_type(target->data_type);
        if (type != nullptr && type->bits != 0 && type->bits != bits) {
            warn(" with " + std::to_string(bits) + " bits; it has " + std::to_string(type->bits),
                 "write " + hex((word & ~0xFFu) | type->bits, 8));
        }
        if (!target->pdo_mapping) {
            report(Severity::note, Topic::object, entry.at, here + ", which has no PDOMapping=1");
        }
        if (receive ? !target->writable() : !target->readable()) {
            warn(receive ? ", which is not writable" : ", which is not readable",
                 "its AccessType is " + std::string(name_of(target->access)));
        }
        return bits;
    }

    void count(std::uint16_t base, unsigned said, const Span& at, const char* key) {
        const auto there = std::count_if(
            d_.objects.begin(), d_.objects.end(),
            [&](const Object& o) { return o.index >= base && o.index < base + 0x200; });
        if (said == static_cast<unsigned>(there) || d_.objects.empty()) return;
        if (said == 0 && d_.file.eds_version.empty()) {
            return;  // a DCF made by hand
        }
        report(Severity::note, Topic::count, at,
               "'" + std::string(key) + "' is " + std::to_string(said) + ", but " +
                   std::to_string(there) + " are described",
               "write " + std::string(key) + "=" + std::to_string(there) + " in [DeviceInfo]");
    }

    const DeviceDescription& d_;
    std::vector<Message>& messages_;
    unsigned node_;
};

/// Adds the objects of one connected module to those of its bus coupler, CiA 306-1 "Modular
/// devices".
class ModuleConnection {
public:
    ModuleConnection(DeviceDescription& device, const Module& module,
                     std::vector<Message>& messages)
        : objects_(device.objects), module_(module), messages_(messages) {}

    void run() {
        for (const Object& fixed : module_.fixed) {
            Object& there = object(fixed.index, fixed);
            if (there.entries.size() <= 1 && there.type == ObjectType::array) {
                there = fixed;
            }
        }
        for (const SubExtension& extension : module_.extensions) {
            extend(extension);
        }
    }

private:
    static constexpr unsigned max_sub = 0xFE;

    /// Returns the object with this index, which is made when the device has none.
    Object& object(std::uint16_t index, const Object& like) {
        const auto at =
            std::lower_bound(objects_.begin(), objects_.end(), index,
                             [](const Object& o, std::uint16_t i) { return o.index < i; });
        if (at != objects_.end() && at->index == index) return *at;
        return *objects_.insert(at, empty_array(index, like));
    }

    static Object empty_array(std::uint16_t index, const Object& like) {
        Entry first;
        first.name = "Highest sub-index supported";
        first.data_type = 0x05;
        first.access = Access::ro;
        first.default_value = "0";
        first.at = like.at;
        const bool is_manufacturers = index >= 0x2000 && index < 0x6000;
        Object made;
        made.index = index;
        made.name = like.name;
        made.at = like.at;
        made.type = ObjectType::array;
        made.category = is_manufacturers ? Category::manufacturer : Category::optional;
        made.entries.push_back(std::move(first));
        return made;
    }

    static bool is_full(const Object& object) { return object.entries.back().sub >= max_sub; }

    /// Adds `Count` sub-indices; with `ObjExtend` the next object takes what the first has no
    /// sub-index for.
    void extend(const SubExtension& extension) {
        const auto count = parse_number(extension.count);
        if (!count || count->node_id || count->magnitude == 0 || count->magnitude > max_sub) {
            report_count(extension);
            return;
        }
        const auto next = parse_number(extension.object_extend);
        const bool may_continue = next && next->magnitude != 0;
        std::uint16_t index = extension.object.index;
        for (std::uint64_t i = 0; i < count->magnitude; ++i) {
            while (is_full(object(index, extension.object)) && may_continue && index < 0xFFFF) {
                ++index;
            }
            Object& to = object(index, extension.object);
            if (is_full(to)) {
                report_full(extension, index);
                return;
            }
            append(to, extension.object.entries.at(0));
        }
    }

    static void append(Object& object, Entry entry) {
        entry.sub = static_cast<std::uint8_t>(object.entries.back().sub + 1);
        object.entries.push_back(std::move(entry));
        if (Entry* const highest = object.find(0)) {
            highest->default_value = std::to_string(object.entries.back().sub);
        }
    }

    void report_count(const SubExtension& extension) {
        messages_.push_back({Severity::warning, Topic::value, extension.object.at,
                             "'Count' of module " + std::to_string(module_.number) + " for " +
                                 label(extension.object.index) + " is not a plain number: '" +
                                 extension.count + "'",
                             "its sub-indices were not added"});
    }

    void report_full(const SubExtension& extension, std::uint16_t index) {
        messages_.push_back({Severity::warning, Topic::count, extension.object.at,
                             "object " + label(index) + " has no free sub-index for module " +
                                 std::to_string(module_.number),
                             ""});
    }

    std::vector<Object>& objects_;
    const Module& module_;
    std::vector<Message>& messages_;
};

}  // namespace

std::string misfit(const DeviceDescription& dcf, unsigned node_id, std::uint32_t bit_rate) {
    if (!dcf.commissioning) return "";
    const unsigned its_node = dcf.commissioning->node_id;
    const unsigned its_rate = dcf.commissioning->baud_rate;
    if (its_node != 0 && its_node != node_id) {
        return "it is for node " + std::to_string(its_node) + ", not for node " +
               std::to_string(node_id);
    }
    if (its_rate == 0 || bit_rate == 0 || its_rate * 1000 == bit_rate) return "";
    return "it is for a bus of " + std::to_string(its_rate) + " kbit/s, not of " +
           std::to_string(bit_rate / 1000) + " kbit/s";
}

std::size_t parameter_values(const DeviceDescription& description) {
    std::size_t count = 0;
    for (const Object& object : description.objects) {
        count += static_cast<std::size_t>(
            std::count_if(object.entries.begin(), object.entries.end(), has_parameter_value));
    }
    return count;
}

void check_objects(const DeviceDescription& description, std::vector<Message>& messages) {
    Checks(description, messages).run();
}

void connect_modules(DeviceDescription& d, std::vector<Message>& messages) {
    for (const unsigned number : d.connected_modules) {
        const auto module = std::find_if(d.modules.begin(), d.modules.end(),
                                         [&](const Module& m) { return m.number == number; });
        if (module == d.modules.end()) continue;  // reported by the reader
        ModuleConnection(d, *module, messages).run();
    }
}

}  // namespace hal::canopen::eds
