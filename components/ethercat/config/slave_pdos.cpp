// SPDX-License-Identifier: MIT
#include "ethercat/config/slave_pdos.hpp"

#include <algorithm>
#include <iterator>

#include "ethercat/config/pdo_placement.hpp"
#include "ethercat/config/pdo_rules.hpp"
#include "ethercat/config/slave_pins.hpp"

namespace hal::ethercat::config {

using master::Type;

namespace {

/// Returns an object of the dictionary in a description; bits 0: it has none.
Known dictionary_object(const esi::Device& device, std::uint16_t index, std::uint8_t sub) {
    const esi::Object* object = device.find(index);
    const esi::Value* value = object != nullptr ? object->find(sub) : nullptr;
    if (value == nullptr || value->bits == 0) return {};
    std::string name = object->name;
    if (object->values.size() > 1) {
        const bool nameless = value->name.empty() || value->name.starts_with("SubIndex");
        name += " " + (nameless ? std::to_string(sub) : value->name);
    }
    return {dashed(name), described_type(value->type, value->bits), value->bits};
}

/// Returns an object that a PDO of a description maps; bits 0: none does.
Known mapped_object(const std::vector<esi::Pdo>& pdos, std::uint16_t index, std::uint8_t sub) {
    for (const esi::Pdo& p : pdos) {
        for (const esi::Entry& e : p.entries) {
            if (e.index == index && e.sub == sub) {
                return {dashed(e.name), described_type(e.type, e.bits), e.bits};
            }
        }
    }
    return {};
}

/// Returns the pin of an object without a name: "2000-10". The sub-index is decimal, as messages
/// print it, with two digits at least.
std::string unnamed_pin(const ObjectAddress& address) {
    const char* const fill = address.sub < 10 ? "-0" : "-";
    return lower(bus::index_text(address.index).substr(2) + fill + std::to_string(address.sub));
}

bool is_pdo(std::uint16_t index) {
    return (index >= 0x1600 && index <= 0x17ff) || (index >= 0x1a00 && index <= 0x1bff);
}

}  // namespace

/// Gives an integer of a drive the sign that CiA 402 has for its object: descriptions declare
/// target positions as UDINT.
void SlavePdos::correct_sign(std::uint16_t index, std::uint8_t sub, unsigned bits,
                             master::Type& type) const {
    Known profile = profile_object(index, sub, in_.info.cia402_axes);
    // descriptions name sub-indices that a variable does not have
    if (profile.bits == 0) profile = profile_object(index, 0, in_.info.cia402_axes);
    if (profile.bits == bits && !is_real(type)) type = profile.type;
}

Known SlavePdos::known(std::uint16_t index, std::uint8_t sub) const {
    if (device_ == nullptr) return profile_object(index, sub, std::max(in_.info.cia402_axes, 1U));
    const auto corrected = [&](Known found) {
        correct_sign(index, sub, found.bits, found.type);
        return found;
    };
    if (const Known found = dictionary_object(*device_, index, sub); found.bits != 0) {
        return corrected(found);
    }
    for (const auto* pdos : {&device_->rx, &device_->tx}) {
        if (const Known found = mapped_object(*pdos, index, sub); found.bits != 0) {
            return corrected(found);
        }
    }
    // a description with a dictionary has all objects
    if (!device_->objects.empty()) return {};
    return profile_object(index, sub, in_.info.cia402_axes);
}

std::optional<ObjectAddress> SlavePdos::find(std::string_view name) const {
    if (device_ != nullptr) {
        for (const esi::Object& object : device_->objects) {
            for (const esi::Value& value : object.values) {
                if (dictionary_object(*device_, object.index, value.sub).name != name) continue;
                ObjectAddress address;
                address.index = object.index;
                address.sub = value.sub;
                return address;
            }
        }
    }
    const unsigned axes = in_.info.cia402_axes;
    const auto found = profile_address(name, device_ == nullptr ? std::max(axes, 1U) : axes);
    if (!found || known(found->index, found->sub).bits == 0) return std::nullopt;
    return found;
}

const std::vector<esi::Pdo>& SlavePdos::described(bool output) const {
    static const std::vector<esi::Pdo> none;
    if (device_ == nullptr) return none;
    if (output) return device_->rx;
    return device_->tx;
}

void SlavePdos::read() {
    direction(true);
    direction(false);
    SlavePins(in_).read();
}

namespace {

/// The keys of a direction, which begin with `outputs` or `inputs`.
constexpr bus::Choice<bool> orders[] = {{"assignment-first", true}, {"mapping-first", false}};

const bus::KeyTable<master::SyncManager>& process_data_keys() {
    using S = master::SyncManager;
    static const bus::KeyTable<master::SyncManager> table{{
        {"outputs", "objects, PDOs, default, none", "`default`",
         "the process data: objects in the order of the PDO, or PDOs of the ESI as in `1600 1602`. "
         "`default`: the PDOs that the ESI assigns. `none`: no process data"},
        {"inputs", "objects, PDOs, default, none", "`default`", "the same for inputs"},
        {"outputs.pdo", "an index", "the first PDO that is not fixed",
         "PDO that receives the mapping; also `inputs.pdo`"},
        {"outputs.sync-manager", "0..15", "from the ESI; otherwise 2, 3",
         "number of the sync manager; also `inputs.sync-manager`"},
        {"outputs.watchdog", bus::flag(&S::watchdog), "from the ESI; otherwise `yes`",
         "`yes`: the outputs trigger the watchdog"},
        {"pdo-order", bus::choice(&S::assignment_first, orders), "`assignment-first`",
         "order in which the master writes the assignment and the mapping; `mapping-first` is for "
         "slaves that accept only this order"},
    }};
    return table;
}

}  // namespace

std::string process_data_reference() { return process_data_keys().reference(); }

std::vector<std::string> SlavePdos::key_names() { return process_data_keys().names(); }

std::uint8_t SlavePdos::manager_number(bool output) {
    std::uint8_t number = output ? 2 : 3;
    if (device_ != nullptr) {
        const sii::SmType type = output ? sii::SmType::outputs : sii::SmType::inputs;
        const auto& list = device_->sync_managers;
        const auto at = std::find_if(list.begin(), list.end(),
                                     [&](const esi::SyncManager& s) { return s.type == type; });
        if (at != list.end()) {
            number = static_cast<std::uint8_t>(at - list.begin());
        }
    }
    const auto get = [&](SlaveInput&) -> std::uint8_t& { return number; };
    const std::string key = output ? "outputs.sync-manager" : "inputs.sync-manager";
    in_.keys.read(key, bus::number(get, 0, 15), in_);
    return number;
}

/// Returns a sync manager without PDOs, as the description and the keys have it.
master::SyncManager SlavePdos::manager(bool output) {
    master::SyncManager sm;
    sm.output = output;
    sm.number = manager_number(output);
    const bool has_coe =
        device_ != nullptr && device_->mailbox && device_->mailbox->has(MailboxType::coe);
    if (device_ != nullptr && sm.number < device_->sync_managers.size()) {
        const esi::SyncManager& s = device_->sync_managers[sm.number];
        sm.start = s.start;
        sm.control = s.control;
        sm.watchdog = (s.control & 0x40) != 0;
        sm.write_assignment = has_coe && device_->mailbox->pdo_assign;
    } else {
        sm.write_assignment = device_ == nullptr || has_coe;
    }
    if (output) {
        in_.keys.read("outputs.watchdog", bus::flag(&master::SyncManager::watchdog), sm);
        if (!sm.watchdog && sm.control != 0) {
            sm.control &= static_cast<std::uint8_t>(~0x40U);
        }
    }
    in_.keys.read("pdo-order", bus::choice(&master::SyncManager::assignment_first, orders), sm);
    return sm;
}

void SlavePdos::direction(bool output) {
    const std::string key = output ? "outputs" : "inputs";
    const std::size_t before = in_.report.all.size();
    const Line* line = in_.keys.find(key);
    in_.keys.find(key + ".pdo");
    std::vector<master::SyncManager> managers{manager(output)};
    if (line != nullptr && !same_word(line->value.text, "default")) {
        if (!same_word(line->value.text, "none")) {
            list(*line, managers.front());
        }
    } else {
        if (line != nullptr && device_ == nullptr) {
            in_.report.error(Topic::object, line->value.at,
                             "'" + key + " = default' needs a description of the device",
                             "write esi = FILE, or list the objects");
        }
        assign_default(managers);
    }
    if (managers.front().pdos.empty()) {
        managers.erase(managers.begin());
    }
    if (device_ != nullptr && in_.report.all.size() == before) {
        const PdoContext context{*device_, mode_, in_.info.type, in_.slave.oversampling};
        check_pdos(context, managers, output, key, line != nullptr ? line->value.at : in_.info.at,
                   in_.report);
    }
    std::move(managers.begin(), managers.end(), std::back_inserter(in_.slave.sync_managers));
}

/// Assigns the PDOs of the description; those of further sync managers, to further ones.
void SlavePdos::assign_default(std::vector<master::SyncManager>& managers) {
    const auto& pdos = described(managers.front().output);
    if (mode_ == nullptr || mode_->samples() == 0) {
        for (const esi::Pdo& p : pdos) {
            if (p.sync_manager) {
                assign(p, manager_with(*p.sync_manager, managers));
            }
        }
        return;
    }
    for (const esi::OpMode::Assigned& one : mode_->assigned) {
        const auto at = std::find_if(pdos.begin(), pdos.end(),
                                     [&](const esi::Pdo& p) { return p.index == one.pdo; });
        if (at != pdos.end()) {
            assign(*at, manager_with(one.sync_manager, managers));
        }
    }
}

/// Returns the sync manager with a number, which is added if it is missing.
master::SyncManager& SlavePdos::manager_with(unsigned number,
                                             std::vector<master::SyncManager>& managers) const {
    const auto at =
        std::find_if(managers.begin(), managers.end(),
                     [&](const master::SyncManager& sm) { return sm.number == number; });
    if (at != managers.end()) return *at;
    managers.push_back(further_manager(managers.front(), number));
    return managers.back();
}

master::SyncManager SlavePdos::further_manager(const master::SyncManager& first,
                                               unsigned number) const {
    master::SyncManager sm = first;
    sm.pdos.clear();
    sm.number = static_cast<std::uint8_t>(number);
    sm.start = 0;
    sm.control = 0;
    if (number < device_->sync_managers.size()) {
        sm.start = device_->sync_managers[number].start;
        sm.control = device_->sync_managers[number].control;
    }
    return sm;
}

/// Returns whether a start-up command writes the mapping of a PDO, which the master restores then.
bool SlavePdos::is_commanded(const esi::Pdo& pdo) const {
    const bool can_map = device_->mailbox && device_->mailbox->pdo_config && !pdo.fixed;
    const auto& commands = device_->init_commands;
    return can_map && std::any_of(commands.begin(), commands.end(), [&](const esi::InitCmd& c) {
        return c.protocol == esi::InitCmd::Protocol::coe && c.index == pdo.index;
    });
}

void SlavePdos::assign(const esi::Pdo& from, master::SyncManager& to) {
    master::Pdo p;
    p.index = from.index;
    p.write_mapping = is_commanded(from);
    for (const esi::Entry& e : from.entries) {
        master::Entry entry;
        entry.index = e.index;
        entry.sub = e.sub;
        entry.bits = e.bits;
        if (e.index != 0) {
            entry.type = described_type(e.type, e.bits);
            correct_sign(e.index, e.sub, e.bits, entry.type);
            entry.is_signed = is_signed(entry.type);
            entry.name = dashed(e.name);
            if (entry.name.empty()) {
                entry.name = known(e.index, e.sub).name;
            }
            if (e.bits > 64) {
                entry.name.clear();
            }
        }
        p.entries.push_back(std::move(entry));
    }
    to.pdos.push_back(std::move(p));
}

std::vector<SlavePdos::Item> SlavePdos::items_of(const Word& value) {
    std::vector<Item> items;
    for (const Word& word : words_of(value, ",")) {
        const bool is_gap = !items.empty() && items.back().object.text == "gap";
        const bool follows = !items.empty() && items.back().type.empty() &&
                             (is_type(word.text) || (is_gap && parse_natural(word.text)));
        if (follows) {
            items.back().type = word;
        } else {
            items.push_back({word, {}});
        }
    }
    return items;
}

void SlavePdos::list(const Line& line, master::SyncManager& sm) {
    std::vector<master::Entry> entries;
    for (const Item& item : items_of(line.value)) {
        if (item.object.text == "gap") {
            add_gap(item, entries);
            continue;
        }
        for (const ObjectAddress& address : addresses_of(item.object)) {
            if (item.type.empty() && !address.has_sub && is_pdo(address.index)) {
                assign(address.index, item.object, sm);
            } else if (!add_entry(item, address, sm, entries)) {
                break;
            }
        }
    }
    if (!entries.empty()) {
        PdoPlacement(in_, device_, limit_).place(line, sm, entries);
    }
}

void SlavePdos::assign(std::uint16_t index, const Word& item, master::SyncManager& sm) {
    const auto& pdos = described(sm.output);
    const auto found =
        std::find_if(pdos.begin(), pdos.end(), [&](const esi::Pdo& p) { return p.index == index; });
    if (found != pdos.end()) return assign(*found, sm);
    std::vector<std::string> names;
    for (const esi::Pdo& p : pdos) {
        names.push_back(pdo_text(p.index));
    }
    std::string help = "the PDOs are: " + listed(names);
    if (device_ == nullptr) {
        help = "write esi = FILE, or list the objects";
    } else if (names.empty()) {
        help = "the description has none in this direction";
    }
    in_.report.error(Topic::object, item.at, "unknown PDO '" + item.text + "'", help);
}

std::vector<ObjectAddress> SlavePdos::addresses_of(const Word& item) {
    Report& report = in_.report;
    const std::size_t dots = item.text.find("..");
    const std::size_t colon = item.text.find(':');
    if (dots == item.text.npos || colon > dots) {
        if (const auto one = parse_address(item, report)) return {*one};
        report.error(Topic::value, item.at, "invalid object '" + item.text + "'",
                     "write it in hexadecimal, as in 6040 or 60FE:1, or with its type: 2000:1 u16");
        return {};
    }
    const Word last_item{item.text.substr(0, colon + 1) + item.text.substr(dots + 2), item.at};
    const auto first = parse_address(text::part(item, 0, dots), report);
    const auto last = parse_address(last_item, report);
    if (!first || !last || first->sub > last->sub) {
        report.error(Topic::object, item.at, "invalid range '" + item.text + "'",
                     "write the first and the last sub-index, as in 6000:1..8 bit");
        return {};
    }
    std::vector<ObjectAddress> all;
    for (unsigned sub = first->sub; sub <= last->sub; ++sub) {
        all.push_back(*first);
        all.back().sub = static_cast<std::uint8_t>(sub);
    }
    return all;
}

void SlavePdos::add_gap(const Item& item, std::vector<master::Entry>& entries) {
    const auto bits = parse_natural(item.type.text);
    if (!bits || *bits < 1 || *bits > 255) {
        in_.report.error(Topic::value, item.object.at, "invalid gap",
                         "write gap 8 for 8 bits, at most 255");
        return;
    }
    master::Entry gap;
    gap.bits = static_cast<std::uint16_t>(*bits);
    entries.push_back(std::move(gap));
}

bool SlavePdos::is_mapped(const ObjectAddress& address, const master::SyncManager& sm) {
    return std::any_of(sm.pdos.begin(), sm.pdos.end(), [&](const master::Pdo& p) {
        return std::any_of(p.entries.begin(), p.entries.end(), [&](const master::Entry& e) {
            return e.index == address.index && e.sub == address.sub;
        });
    });
}

bool SlavePdos::add_entry(const Item& item, const ObjectAddress& address,
                          const master::SyncManager& sm, std::vector<master::Entry>& entries) {
    Report& report = in_.report;
    const Span at = item.object.at;
    const std::string label = object_text(address.index, address.sub);
    Known k = known(address.index, address.sub);
    if (const auto type = parse_type(item.type, report)) {
        if (k.bits != 0 && k.bits != type->bits && device_ != nullptr) {
            report.error(Topic::object, at,
                         "object " + label + " of '" + in_.info.type + "' has " +
                             std::to_string(k.bits) + " bits, not " + std::to_string(type->bits),
                         "leave out the type");
        }
        k.type = type->type;
        k.bits = type->bits;
    }
    if (k.bits == 0) {
        report.error(Topic::object, at,
                     device_ != nullptr ? "object " + label + " is not in the description of '" +
                                              in_.info.type + "'"
                                        : "object " + label + " has no known type",
                     "write its type, as in " + item.object.text + " u16; the types are " +
                         value_type_names);
        return false;
    }
    if (is_mapped(address, sm)) {
        report.error(Topic::object, at, "duplicate object " + label, "delete one of them");
        return false;
    }
    master::Entry e;
    e.index = address.index;
    e.sub = address.sub;
    e.bits = static_cast<std::uint16_t>(std::min(k.bits, 65535U));
    e.type = k.type;
    e.is_signed = is_signed(k.type);
    if (k.bits <= 64) {
        e.name = k.name.empty() ? unnamed_pin(address) : k.name;
    }
    entries.push_back(std::move(e));
    return true;
}

}  // namespace hal::ethercat::config
