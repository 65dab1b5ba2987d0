// SPDX-License-Identifier: MIT
// The modules of a modular device, and the comments of the device and of each module.
#include <algorithm>
#include <charconv>
#include <set>

#include "eds_reader.hpp"

namespace hal::canopen::eds {

void read_comments(Keys& keys, IniSection* section, std::vector<std::string>& out,
                   std::vector<OtherSection>& others) {
    if (section == nullptr) return;
    section->used = true;
    std::map<unsigned, IniKey*> lines;
    for (IniKey& key : section->keys) {
        if (key.name.size() < 5 || !same_word(key.name.substr(0, 4), "Line") ||
            same_word(key.name, "Lines")) {
            continue;
        }
        const auto number = parse_number(std::string_view(key.name).substr(4));
        if (!number || number->magnitude == 0 || number->magnitude > 0xFFFF) continue;
        lines.emplace(static_cast<unsigned>(number->magnitude), &key);
        key.used = true;
    }
    IniKey* counter = section->find("Lines");
    const auto count = keys.number(*section, "Lines", 0xFFFF);
    if (counter == nullptr) {
        keys.report(Severity::note, Topic::missing, section->at,
                    "missing 'Lines' in [" + section->name + "]",
                    "write Lines=" + std::to_string(lines.size()));
    } else if (count && *count != lines.size()) {
        keys.report(Severity::note, Topic::count, counter->value_at,
                    "'Lines' of [" + section->name + "] is " + std::to_string(*count) +
                        ", there are " + std::to_string(lines.size()),
                    "write Lines=" + std::to_string(lines.size()));
    }
    unsigned next = 1;
    for (const auto& [number, line] : lines) {
        // A missing number is an empty line, but a large gap is not filled.
        for (; next < number && number - next < 16; ++next) {
            out.emplace_back();
        }
        out.push_back(line->value);
        next = number + 1;
    }
    if (const Extras more = keys.rest(*section); !more.empty()) {
        others.push_back({section->name, more});
    }
}

namespace {

Module module(Ini& ini, Keys& keys, unsigned n, std::vector<OtherSection>& others) {
    Module out;
    out.number = n;
    const std::string prefix = "M" + std::to_string(n);
    IniSection& info = *ini.find(prefix + "ModuleInfo");
    out.product_name = keys.text(info, "ProductName");
    out.order_code = keys.text(info, "OrderCode");
    out.version = keys.text(info, "ProductVersion");
    out.revision = keys.text(info, "ProductRevision");
    out.extras = keys.rest(info);
    read_comments(keys, ini.find(prefix + "Comments"), out.comments, others);
    out.fixed = ObjectReader(ini, keys, prefix).read();
    if (IniSection* fixed = ini.find(prefix + "FixedObjects")) {
        for (const auto& [number, key] : keys.list(*fixed, "NrOfEntries")) {
            const auto index = keys.parse(*fixed, *key, 0xFFFF);
            if (index && std::none_of(out.fixed.begin(), out.fixed.end(),
                                      [&](const Object& o) { return o.index == *index; })) {
                keys.report(Severity::warning, Topic::missing, key->value_at,
                            "object " + label(static_cast<std::uint16_t>(*index)) + " of module " +
                                std::to_string(n) + " is listed but not described");
            }
        }
        fixed->used = true;
    }
    const std::string extension = prefix + "SubExt";
    if (IniSection* list = ini.find(extension + "ends")) {
        for (const auto& [number, key] : keys.list(*list, "NrOfEntries")) {
            const auto index = keys.parse(*list, *key, 0xFFFF);
            if (!index) continue;
            IniSection* section = ini.find(extension + label(static_cast<std::uint16_t>(*index)));
            if (section == nullptr) {
                keys.report(Severity::warning, Topic::missing, key->value_at,
                            "missing section [" + extension +
                                label(static_cast<std::uint16_t>(*index)) + "]");
                continue;
            }
            if (section->used) continue;
            SubExtension one;
            one.object.index = static_cast<std::uint16_t>(*index);
            one.count = keys.bare(*section, "Count");
            one.object_extend = keys.bare(*section, "ObjExtend");
            one.object.entries.push_back(EntryReader(keys).read(*section, section->name, true));
            one.object.name = one.object.entries[0].name;
            one.object.at = section->at;
            out.extensions.push_back(std::move(one));
        }
        list->used = true;
    }
    return out;
}

}  // namespace

void read_modules(Ini& ini, Keys& keys, DeviceDescription& out) {
    std::set<unsigned> numbers;
    if (IniSection* supported = ini.find("SupportedModules")) {
        supported->used = true;
        const auto count = keys.number(*supported, "NrOfEntries", 0xFFFF).value_or(0);
        for (unsigned n = 1; n <= count; ++n) {
            if (ini.find("M" + std::to_string(n) + "ModuleInfo") != nullptr) {
                numbers.insert(n);
            } else if (n <= 1000) {
                keys.report(Severity::warning, Topic::missing, supported->at,
                            "module " + std::to_string(n) + " is counted but not described",
                            "missing section [M" + std::to_string(n) + "ModuleInfo]");
            }
        }
    }
    for (const IniSection& section : ini.sections()) {  // those that are not counted
        unsigned n = 0;
        const char *begin = section.name.data() + 1,
                   *end = section.name.data() + section.name.size();
        if (section.name.size() < 2 || (section.name[0] | 0x20) != 'm') continue;
        const auto [rest, error] = std::from_chars(begin, end, n);
        if (error == std::errc() &&
            same_word(std::string_view(rest, static_cast<std::size_t>(end - rest)), "ModuleInfo") &&
            numbers.insert(n).second) {
            keys.report(Severity::warning, Topic::count, section.at,
                        "module " + std::to_string(n) +
                            " is described but not counted in [SupportedModules]");
        }
    }
    for (const unsigned n : numbers) {
        out.modules.push_back(module(ini, keys, n, out.others));
    }
    if (IniSection* connected = ini.find("ConnectedModules")) {
        for (const auto& [slot, key] : keys.list(*connected, "NrOfEntries")) {
            const auto n = keys.parse(*connected, *key, 0xFFFF);
            if (!n) continue;
            if (numbers.count(static_cast<unsigned>(*n)) == 0) {
                keys.report(Severity::warning, Topic::missing, key->value_at,
                            "slot " + std::to_string(slot) + " holds module " + std::to_string(*n) +
                                ", which is not described");
            }
            out.connected_modules.push_back(static_cast<unsigned>(*n));
        }
        connected->used = true;
    }
}

}  // namespace hal::canopen::eds
