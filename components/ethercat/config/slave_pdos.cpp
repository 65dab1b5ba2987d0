// SPDX-License-Identifier: MIT
#include "ethercat/config/slave_pdos.hpp"

#include <algorithm>

#include "ethercat/config/pdo_rules.hpp"

namespace hal::ethercat::config {

using master::Type;

Known SlavePdos::known(std::uint16_t index, std::uint8_t sub) const {
    if (device_ != nullptr) {
        if (const esi::Object* o = device_->find(index)) {
            if (const esi::Value* v = o->find(sub); v != nullptr && v->bits != 0) {
                const TypeWord* type = type_named(v->type);
                std::string name = o->name;
                if (o->values.size() > 1) {
                    name += v->name.empty() || v->name.starts_with("SubIndex")
                                ? " " + std::to_string(sub)
                                : " " + v->name;
                }
                return {dashed(name),
                        type != nullptr ? type->type : type_of(v->bits, v->type.starts_with("INT")),
                        v->bits};
            }
        }
        for (const auto* pdos : {&device_->rx, &device_->tx}) {
            for (const esi::Pdo& p : *pdos) {
                for (const esi::Entry& e : p.entries) {
                    if (e.index == index && e.sub == sub) {
                        const TypeWord* type = type_named(e.type);
                        return {dashed(e.name),
                                type != nullptr && type->bits == e.bits
                                    ? type->type
                                    : type_of(e.bits, e.type.starts_with("INT")),
                                e.bits};
                    }
                }
            }
        }
    }
    // a description with a dictionary has all objects
    if (device_ != nullptr && !device_->objects.empty()) {
        return {};
    }
    return profile_object(
        index, sub,
        device_ != nullptr && in_.info.cia402_axes == 0 ? 0 : std::max(in_.info.cia402_axes, 1U));
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
    name_pins();
    pin_options();
}

void SlavePdos::direction(bool output) {
    const std::string key = output ? "outputs" : "inputs";
    Keys& keys = in_.keys;
    const std::size_t before = keys.report().all.size();
    master::SyncManager sm;
    sm.output = output;
    std::uint64_t number = output ? 2 : 3;
    const sii::SmType type = output ? sii::SmType::outputs : sii::SmType::inputs;
    if (device_ != nullptr) {
        const auto& list = device_->sync_managers;
        const auto at = std::find_if(list.begin(), list.end(),
                                     [&](const esi::SyncManager& s) { return s.type == type; });
        if (at != list.end()) {
            number = static_cast<std::uint64_t>(at - list.begin());
        }
    }
    keys.take_number((key + ".sync-manager").c_str(), number, 0, 15);
    sm.number = static_cast<std::uint8_t>(number);
    if (device_ != nullptr && number < device_->sync_managers.size()) {
        const esi::SyncManager& s = device_->sync_managers[number];
        sm.start = s.start;
        sm.control = s.control;
        sm.watchdog = (s.control & 0x40) != 0;
        sm.write_assignment =
            device_->mailbox && device_->mailbox->coe && device_->mailbox->pdo_assign;
    } else {
        sm.write_assignment = device_ == nullptr || (device_->mailbox && device_->mailbox->coe);
    }
    if (output) {
        keys.take_flag("outputs.watchdog", sm.watchdog);
    }
    if (output && !sm.watchdog && sm.control != 0) {
        sm.control &= static_cast<std::uint8_t>(~0x40U);
    }
    keys.find(key + ".pdo");
    if (Line* line = keys.find("pdo-order")) {
        if (same_word(line->value.text, "mapping-first")) {
            sm.assignment_first = false;
        } else if (!same_word(line->value.text, "assignment-first")) {
            keys.reject(*line, "assignment-first or mapping-first");
        }
    }
    const Line* line = keys.find(key);
    std::vector<master::SyncManager> more;  // of a default that uses several
    if (line != nullptr && !same_word(line->value.text, "default")) {
        if (!same_word(line->value.text, "none")) {
            list(*line, sm);
        }
    } else {
        if (line != nullptr && device_ == nullptr) {
            keys.report().error(Topic::object, line->value.at,
                                "'" + key + " = default' needs a description of the device",
                                "write esi = FILE, or list the objects");
        }
        for (const esi::Pdo& p : described(output)) {
            if (!p.sync_manager) continue;
            if (*p.sync_manager == number) {
                assign(p, sm);
                continue;
            }
            auto at = std::find_if(more.begin(), more.end(),
                                   [&](const auto& s) { return s.number == *p.sync_manager; });
            if (at == more.end()) {
                master::SyncManager other = sm;
                other.pdos.clear();
                other.number = *p.sync_manager;
                other.start = 0;

                other.control = 0;
                if (other.number < device_->sync_managers.size()) {
                    other.start = device_->sync_managers[other.number].start;

                    other.control = device_->sync_managers[other.number].control;
                }
                at = more.insert(more.end(), other);
            }
            assign(p, *at);
        }
    }
    if (!sm.pdos.empty()) {
        more.insert(more.begin(), std::move(sm));
    }
    if (device_ != nullptr && keys.report().all.size() == before) {
        check_pdos(*device_, in_.info.type, more, output, key,
                   line != nullptr ? line->value.at : in_.info.at, keys.report());
    }
    for (auto& s : more) {
        in_.slave.sync_managers.push_back(std::move(s));
    }
}

void SlavePdos::assign(const esi::Pdo& from, master::SyncManager& to) {
    master::Pdo p;
    p.index = from.index;
    for (const esi::Entry& e : from.entries) {
        master::Entry entry;
        entry.index = e.index;
        entry.sub = e.sub;
        entry.bits = e.bits;
        if (e.index != 0) {
            const TypeWord* type = type_named(e.type);
            entry.type =
                type != nullptr && type->bits == e.bits
                    ? type->type
                    : type_of(e.bits, e.type.starts_with("INT") || e.type.starts_with("DINT"));
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

void SlavePdos::list(const Line& line, master::SyncManager& sm) {
    std::vector<master::Entry> entries;
    const text::Word spaced = line.value;
    // Objects are separated by commas or blanks; a type or a number of bits follows its object.
    std::vector<Word> items;
    for (const Word& word : words_of(spaced, ",")) {
        const bool follows =
            !items.empty() && (type_named(word.text) != nullptr ||
                               (items.back().text == "gap" && parse_natural(word.text)));
        if (follows) {
            items.back().text += " " + word.text;
        } else {
            items.push_back(word);
        }
    }
    for (const Word& item : items) {
        const auto at = address(item.text);
        if (at && !at->has_sub &&
            ((at->index >= 0x1600 && at->index <= 0x17ff) ||
             (at->index >= 0x1a00 && at->index <= 0x1bff))) {
            const auto& pdos = described(sm.output);
            const auto found = std::find_if(
                pdos.begin(), pdos.end(), [&](const esi::Pdo& p) { return p.index == at->index; });
            if (found != pdos.end()) {
                assign(*found, sm);
                continue;
            }
            std::vector<std::string> names;
            for (const esi::Pdo& p : pdos) {
                names.push_back(address_text(p.index, 0).substr(0, 4));
            }
            in_.keys.report().error(Topic::object, item.at, "unknown PDO '" + item.text + "'",
                                    device_ == nullptr ? "write esi = FILE, or list the objects"
                                    : names.empty() ? "the description has none in this direction"
                                                    : "the PDOs are: " + listed(names));
            continue;
        }
        for (const Word& one : range(item)) {
            master::Entry e;
            if (!entry(one, sm, e)) break;
            entries.push_back(std::move(e));
        }
    }
    if (!entries.empty()) {
        place(line, sm, entries);
    }
}

std::vector<Word> SlavePdos::range(const Word& item) {
    const std::size_t dots = item.text.find("..");
    const std::size_t colon = item.text.rfind(':', dots);

    const std::size_t blank = std::min(item.text.find(' '), item.text.size());
    if (dots > blank || colon == std::string::npos) {
        return {item};
    }
    const auto first = address(item.text.substr(0, dots));

    const auto last =
        address(item.text.substr(0, colon + 1) + item.text.substr(dots + 2, blank - dots - 2));
    if (!first || !last || first->sub > last->sub) {
        in_.keys.report().error(
            Topic::object, item.at, "invalid range '" + item.text.substr(0, blank) + "'",
            "write the first and the last sub-index in hexadecimal, as in 6000:1..10 bit");
        return {};
    }
    std::vector<Word> all;
    for (unsigned sub = first->sub; sub <= last->sub; ++sub) {
        all.push_back(
            {address_text(first->index, static_cast<std::uint8_t>(sub)) + item.text.substr(blank),
             item.at});
    }
    return all;
}

bool SlavePdos::entry(const Word& item, master::SyncManager& sm, master::Entry& e) {
    Report& report = in_.keys.report();
    const auto words = words_of(item);
    if (words[0].text == "gap") {
        const auto bits = words.size() == 2 ? parse_natural(words[1].text) : std::nullopt;
        if (!bits || *bits < 1 || *bits > 255) {
            report.error(Topic::value, item.at, "invalid gap",
                         "write gap 8 for 8 bits, at most 255");

            return false;
        }
        e.bits = static_cast<std::uint16_t>(*bits);
        return true;
    }
    const auto at = address(words[0].text);
    if (!at) {
        report.error(Topic::value, item.at, "invalid object '" + words[0].text + "'",
                     "write it in hexadecimal, as in 6040 or 60FE:1, or with its type: 2000:1 u16");

        return false;
    }
    e.index = at->index;
    e.sub = at->sub;
    Known k = known(at->index, at->sub);
    if (words.size() > 1) {
        const TypeWord* type = type_named(words[1].text);
        if (k.bits != 0 && k.bits != type->bits && device_ != nullptr) {
            report.error(Topic::object, item.at,
                         "object " + address_text(e.index, e.sub) + " of '" + in_.info.type +
                             "' has " + std::to_string(k.bits) + " bits, not " +
                             std::to_string(type->bits),
                         "leave out the type");
        }
        k.type = type->type;
        k.bits = type->bits;
    }
    if (k.bits == 0) {
        const std::string label = address_text(e.index, e.sub);
        report.error(Topic::object, item.at,
                     device_ != nullptr ? "object " + label + " is not in the description of '" +
                                              in_.info.type + "'"
                                        : "object " + label + " has no known type",
                     "write its type, as in " + words[0].text + " u16; the types are " +
                         std::string(type_words));

        return false;
    }
    for (const auto& p : sm.pdos) {
        for (const auto& other : p.entries) {
            if (other.index == e.index && other.sub == e.sub) {
                report.error(Topic::object, item.at,
                             "duplicate object " + address_text(e.index, e.sub),
                             "delete one of them");

                return false;
            }
        }
    }
    e.bits = static_cast<std::uint16_t>(std::min(k.bits, 65535U));
    e.type = k.type;

    e.is_signed = is_signed(k.type);
    e.name = k.bits > 64 ? "" : k.name;
    if (e.name.empty() && k.bits <= 64) {
        e.name = lower(address_text(e.index, e.sub));
        std::replace(e.name.begin(), e.name.end(), ':', '-');
    }
    return true;
}

void SlavePdos::place(const Line& line, master::SyncManager& sm,
                      std::vector<master::Entry>& entries) {
    Keys& keys = in_.keys;
    const auto& pdos = described(sm.output);
    for (const esi::Pdo& p : pdos) {  // exactly one of the description: nothing has to be written
        const bool same = p.entries.size() == entries.size() &&
                          std::equal(entries.begin(), entries.end(), p.entries.begin(),
                                     [](const auto& a, const auto& b) {
            return a.index == b.index && a.sub == b.sub && a.bits == b.bits;
        });
        if (same && sm.pdos.empty()) {
            sm.pdos.push_back({p.index, std::move(entries), false});
            return;
        }
    }
    std::vector<std::string> names;
    for (const esi::Pdo& p : pdos) {
        names.push_back(pdo_text(p.index));
    }
    const std::string instead =
        names.empty() ? "delete the line" : "delete the line, or assign PDOs: " + listed(names);
    if (device_ != nullptr && !(device_->mailbox && device_->mailbox->coe)) {
        return keys.report().error(Topic::object, line.value.at,
                                   "the PDOs of '" + in_.info.type +
                                       "' are fixed: it has no CoE mailbox to map objects with",
                                   instead);
    }
    if (device_ != nullptr && !device_->mailbox->pdo_config) {
        return keys.report().error(
            Topic::object, line.value.at,
            "the PDOs of '" + in_.info.type + "' are fixed: its description has no PdoConfig",
            instead);
    }
    std::vector<std::uint16_t> free =
        device_ != nullptr ? mappable(*device_, sm.output) : std::vector<std::uint16_t>{};
    std::erase_if(free, [&](std::uint16_t f) {  // with PDOs that the line names
        return std::any_of(sm.pdos.begin(), sm.pdos.end(), [&](const master::Pdo& p) {
            const esi::Pdo *a = device_->find_pdo(p.index), *b = device_->find_pdo(f);
            return p.index == f || (a != nullptr && b != nullptr && exclude_each_other(*a, *b));
        });
    });
    if (!pdos.empty() && free.empty()) {
        return keys.report().error(
            Topic::object, line.value.at,
            "all PDOs of '" + in_.info.type + "' in this direction are fixed",
            "assign one of them, as in " + line.key.text + " = " + pdo_text(pdos[0].index));
    }
    const std::string key = line.key.text + ".pdo";
    if (Line* chosen = keys.find(key)) {
        const auto at = address(chosen->value.text);
        if (!at || at->has_sub) return keys.reject(*chosen, "the index of a PDO, as in 1601");
        if (device_ != nullptr && std::find(free.begin(), free.end(), at->index) == free.end()) {
            return keys.report().error(
                Topic::object, chosen->value.at,
                "PDO " + pdo_text(at->index) + " of '" + in_.info.type + "' cannot be mapped",
                "write " + key + " = " + pdo_text(free[0]) + ", or delete the line");
        }
        free.assign(1, at->index);
    }
    const auto first =
        static_cast<std::uint16_t>(free.empty() ? (sm.output ? 0x1600 : 0x1a00) : free[0]);
    const auto all = entries.size();
    std::string taken;  // of the PDOs, for a message
    for (std::size_t i = 0, used = 0; i < all; ++used) {
        if (!pdos.empty() && used == free.size()) {
            return keys.report().error(Topic::object, line.value.at,
                                       counted(static_cast<unsigned>(all), "object") +
                                           " do not fit in the PDOs of '" + in_.info.type +
                                           "': " + taken,
                                       "leave out " + std::to_string(all - i) + " of them" +
                                           (limit_ != 0 ? ", or raise entries-per-pdo" : ""));
        }
        master::Pdo p;
        p.index = used < free.size() ? free[used] : static_cast<std::uint16_t>(first + used);
        p.write_mapping = true;
        const std::uint64_t described_limit =
            device_ != nullptr ? most_entries(*device_, p.index) : 0;
        const std::uint64_t limit = limit_ == 0            ? described_limit
                                    : described_limit == 0 ? limit_
                                                           : std::min(limit_, described_limit);
        for (; i < all && (limit == 0 || p.entries.size() < limit); ++i) {
            p.entries.push_back(std::move(entries[i]));
        }
        taken +=
            (taken.empty() ? "" : ", ") + pdo_text(p.index) + " takes " + std::to_string(limit);
        sm.pdos.push_back(std::move(p));
    }
}

void SlavePdos::name_pins() {
    std::set<std::string> names;
    for (auto& sm : in_.slave.sync_managers) {
        for (auto& p : sm.pdos) {
            for (auto& e : p.entries) {
                if (e.name.empty()) continue;
                std::string name = e.name;
                if (names.contains(name) && !sm.output) {
                    name += "-feedback";
                }
                for (unsigned n = 2; !names.insert(name).second; ++n) {
                    name = e.name + "-" + std::to_string(n);
                }
                e.name = name;
            }
        }
    }
}

void SlavePdos::pin_options() {
    for (Line* line : in_.keys.all()) {
        const std::size_t dot = line->key.text.rfind('.');
        if (line->used || dot == std::string::npos || line->key.text.starts_with("sdo ")) continue;
        line->used = true;
        option(*line);
    }
    for (auto& sm : in_.slave.sync_managers) {
        for (auto& p : sm.pdos) {
            for (auto& e : p.entries) {
                if (!e.name.empty() && in_.info.find(e.name) == nullptr) {
                    in_.info.pins.push_back({e.name, {"", address_text(e.index, e.sub)}});
                }
            }
        }
    }
}

void SlavePdos::option(const Line& line) {
    Report& report = in_.keys.report();
    const std::size_t dot = line.key.text.rfind('.');
    const std::string object = line.key.text.substr(0, dot);

    const std::string property = line.key.text.substr(dot + 1);
    const auto at = address(object);
    master::Entry* entry = nullptr;
    std::vector<std::string> names;
    for (auto& sm : in_.slave.sync_managers) {
        for (auto& p : sm.pdos) {
            for (auto& e : p.entries) {
                if (e.index != 0 && !e.name.empty()) {
                    names.push_back(e.name);
                }
                if (e.index != 0 &&
                    ((at && e.index == at->index && e.sub == at->sub) || e.name == object)) {
                    entry = &e;
                }
            }
        }
    }
    if (entry == nullptr) {
        return report.error(Topic::object, line.key.at,
                            "no PDO of this slave has an object '" + object + "'",
                            suggestion(object, names, "the objects are"));
    }
    auto info = std::find_if(in_.info.pins.begin(), in_.info.pins.end(),
                             [&](const auto& p) { return p.first == entry->name; });
    if (info == in_.info.pins.end()) {
        info =
            in_.info.pins.insert(info, {entry->name, {"", address_text(entry->index, entry->sub)}});
    }
    const std::string& value = line.value.text;
    const auto reject = [&](const std::string& instead) { in_.keys.reject(line, instead); };
    // object = pin * scale + offset; the setup has the inverse
    if (property == "scale" || property == "offset") {
        const std::size_t slash = std::min(value.find('/'), value.size());
        const auto over = parse_real(trimmed(std::string_view(value).substr(0, slash)));
        const auto below = slash < value.size()
                               ? parse_real(trimmed(std::string_view(value).substr(slash + 1)))
                               : std::optional<double>(1.0);
        if (!over || !below || *below == 0 || (property == "scale" && *over == 0)) {
            return reject("a number other than 0, or a fraction such as 65536/360");
        }
        const double object_scale = property == "scale" ? *over / *below : 1 / entry->scale;
        const double object_offset =
            property == "offset" ? *over / *below : -entry->offset / entry->scale;
        entry->scale = 1 / object_scale;
        entry->offset = -object_offset / object_scale;

        entry->scaled = true;
    } else if (property == "name") {
        const std::string name = dashed(value) == value ? value : "";
        if (name.empty()) return reject("a name of lower-case letters, digits and dashes");
        if (std::find(names.begin(), names.end(), name) != names.end() && name != entry->name) {
            return report.error(Topic::slave, line.value.at, "duplicate pin name '" + name + "'",
                                "choose another one");
        }
        entry->name = name;
        info->first = name;
    } else if (property == "unit") {
        info->second.unit = value;
        entry->scaled = true;
    } else if (property == "type") {
        if (same_word(value, "float")) {
            entry->scaled = true;
            return;
        }
        const TypeWord* type = type_named(value);
        if (type == nullptr || type->bits < entry->bits ||
            (type->type == Type::bit && entry->bits != 1)) {
            return reject("float, or one of " + std::string(type_words) + " with at least " +
                          counted(entry->bits, "bit"));
        }
        entry->type = type->type;
        entry->is_signed = is_signed(type->type);
    } else {
        report.error(Topic::line, line.key.at, "unknown property '" + property + "' of an object",
                     suggestion(property, {"scale", "offset", "name", "unit", "type"},
                                "the properties are"));
    }
}

}  // namespace hal::ethercat::config
