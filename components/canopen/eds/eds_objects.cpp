// SPDX-License-Identifier: MIT
// The object sections: [1018], [1018sub1], [1018Name], [1018Value], [1018Denotation],
// [1018ObjectLinks].
#include <algorithm>

#include "eds_reader.hpp"

namespace hal::canopen::eds {

namespace {

const std::initializer_list<std::string_view> known_keys{
    "ParameterName",  "ObjectType", "DataType",     "AccessType", "PDOMapping",
    "DefaultValue",   "LowLimit",   "HighLimit",    "SubNumber",  "CompactSubObj",
    "ParameterValue", "Denotation", "DownloadFile", "UploadFile", "ObjFlags"};

constexpr std::size_t longest_name = 241;

}  // namespace

Entry ObjectReader::entry(IniSection& section, const std::string& what, bool is_sub) {
    Entry out;
    section.used = true;
    out.at = section.at;
    out.name = keys_.text(section, "ParameterName");
    if (out.name.empty()) {
        keys_.report(Severity::warning, Topic::missing, section.at,
                     "'ParameterName' of " + what + " is " +
                         (section.find("ParameterName") != nullptr ? "empty" : "missing"),
                     "give the object a name");
    }
    if (out.name.size() > longest_name) {
        keys_.report(
            Severity::note, Topic::value, section.find("ParameterName")->value_at,
            "the name of " + what + " has " + std::to_string(out.name.size()) + " characters",
            "the limit is 241");
    }
    bool given = false;
    out.type = object_type(section, what, given);
    if (is_sub && (out.type == ObjectType::array || out.type == ObjectType::record ||
                   out.type == ObjectType::defstruct)) {
        keys_.report(
            Severity::warning, Topic::object, section.find("ObjectType")->value_at,
            what + " is a sub-index and cannot be of type " + std::string(name_of(out.type)),
            "read as VAR; write ObjectType=0x7");
        out.type = ObjectType::var;
    }
    const bool is_value = out.type == ObjectType::var;
    out.data_type = type_of(section, what, is_value);
    if (out.data_type == 0 && out.type == ObjectType::domain) {
        out.data_type = 0x0F;
    }
    if (const DataType* type = data_type(out.data_type);
        is_value && type != nullptr && type->kind == Kind::structure) {
        keys_.report(Severity::warning, Topic::object, section.find("DataType")->value_at,
                     "data type " + hex(out.data_type) + " of " + what +
                         " is a record, but a single value is required",
                     "");
    }
    out.access = access_of(section, what, is_value);
    out.pdo_mapping = keys_.flag(section, "PDOMapping");
    value(section, "DefaultValue", out.default_value, out.data_type, what);
    value(section, "LowLimit", out.low_limit, out.data_type, what);
    value(section, "HighLimit", out.high_limit, out.data_type, what);
    value(section, "ParameterValue", out.parameter_value, out.data_type, what);
    out.denotation = keys_.text(section, "Denotation");
    out.upload_file = keys_.text(section, "UploadFile");
    out.download_file = keys_.text(section, "DownloadFile");
    out.flags =
        static_cast<std::uint32_t>(keys_.number(section, "ObjFlags", 0xFFFFFFFF).value_or(0));
    if (is_sub) {
        if (keys_.number(section, "SubNumber", 0xFF).value_or(0) != 0) {
            keys_.report(Severity::note, Topic::object, section.find("SubNumber")->at,
                         "'SubNumber' of " + what + " ignored: a sub-index has no sub-indices", "");
        }
        out.extras = keys_.rest(section, known_keys);
    }
    const auto low = comparable(out.low_limit, out.data_type, 1);

    const auto high = comparable(out.high_limit, out.data_type, 1);
    if (low && high && *low > *high) {
        keys_.report(Severity::warning, Topic::value, section.find("LowLimit")->value_at,
                     "empty range of " + what + ": " + out.low_limit + ".." + out.high_limit,
                     "are LowLimit and HighLimit exchanged?");
    } else {
        for (const auto& [key, text] :
             {std::pair<const char*, const std::string*>{"DefaultValue", &out.default_value},
              {"ParameterValue", &out.parameter_value}}) {
            const auto number = comparable(*text, out.data_type, 1);
            if (number && ((low && *number < *low) || (high && *number > *high))) {
                keys_.report(Severity::warning, Topic::value, section.find(key)->value_at,
                             "'" + std::string(key) + "' of " + what + " is out of range: " + *text,
                             "the range is " + (low ? out.low_limit : "any") + ".." +
                                 (high ? out.high_limit : "any"));
            }
        }
    }
    return out;
}

void ObjectReader::spread(Object& out, IniSection* list, std::string Entry::* field,
                          const char* what) {
    if (list == nullptr) return;
    list->used = true;
    for (const auto& [number, key] : keys_.list(*list, "NrOfEntries")) {
        Entry* entry = number <= 0xFF ? out.find(static_cast<std::uint8_t>(number)) : nullptr;
        if (entry == nullptr) {
            keys_.report(Severity::warning, Topic::count, key->at,
                         "[" + list->name + "] has a " + what + " for sub-index " + key->name +
                             ", which object " + label(out.index) + " does not have",
                         "sub-indices in this section are decimal");
            out.extras.emplace_back(list->name + "." + key->name, key->value);
            continue;
        }
        if (entry->*field != key->value && !key->value.empty()) {
            entry->*field = key->value;
        }
        if (field != &Entry::parameter_value) continue;
        const Encoded encoded = encode(key->value, entry->data_type, 1);
        const DataType* type = data_type(entry->data_type);
        if (!encoded && type != nullptr && type->kind < Kind::text) {
            keys_.report(Severity::warning, Topic::value, key->value_at,
                         "value of sub-index " + key->name + " of " + label(out.index) + ": " +
                             encoded.error,
                         "");
        }
    }
    if (IniKey* count = list->find("NrOfEntries")) {
        count->used = true;
    }
    const Extras more = keys_.rest(*list);
    for (const auto& [key, text] : more) {
        if (!key.empty()) {
            out.extras.emplace_back(list->name + "." + key, text);
        }
    }
}

void ObjectReader::expand(Object& out, IniSection& section, unsigned count) {
    Entry each = entry(section, label(out.index), false);
    each.type = ObjectType::var;
    each.denotation.clear();
    const std::string name = each.name;
    out.compact = count;
    Entry first;
    first.name = "NrOfObjects";
    first.data_type = 0x05;
    first.access = Access::ro;
    first.default_value = std::to_string(count);
    first.at = section.at;
    out.entries.push_back(first);
    for (unsigned sub = 1; sub <= count; ++sub) {
        each.sub = static_cast<std::uint8_t>(sub);
        each.name = name + std::to_string(sub);
        out.entries.push_back(each);
    }
}

void ObjectReader::check_entries(const Object& out, IniSection& section) {
    const std::size_t count = out.entries.size();
    IniKey* key = section.find("SubNumber");
    if (out.compact != 0) return;
    if (count == 0) {
        keys_.report(Severity::warning, Topic::count, section.at,
                     "object " + label(out.index) + " is of type " +
                         std::string(name_of(out.type)) + " but has no sub-indices",
                     "describe them in sections [" + label(out.index) +
                         "sub0] and so on, or with CompactSubObj");
        return;
    }
    if (key == nullptr || key->value.empty()) {
        keys_.report(
            Severity::warning, Topic::missing, section.at,
            "'SubNumber' of " + label(out.index) + " is " + (key != nullptr ? "empty" : "missing"),
            "the file describes " + std::to_string(count) +
                " sub-indices; write SubNumber=" + hex(count, 1));
    } else if (const auto said = parse_number(key->value); said && said->magnitude != count) {
        keys_.report(Severity::warning, Topic::count, key->value_at,
                     "'SubNumber' of " + label(out.index) + " is " +
                         std::to_string(said->magnitude) + ", the file describes " +
                         std::to_string(count),
                     "sub-index 0 counts as well: write SubNumber=" + hex(count, 1));
    }
    if (out.entries.front().sub != 0) {
        keys_.report(Severity::warning, Topic::missing, section.at,
                     "missing sub-index 0 of " + label(out.index),
                     "it holds the highest sub-index of an ARRAY or RECORD");
        return;
    }
    const Entry& first = out.entries.front();
    if (first.data_type != 0x05 && first.data_type != 0) {
        keys_.report(Severity::note, Topic::object, first.at,
                     "sub-index 0 of " + label(out.index) + " is not of type UNSIGNED8", "");
    }
    if (first.writable() || out.index == 0x1003) return;
    const Encoded highest = encode(first.default_value, 0x05, 1);
    if (highest && !highest.bytes.empty() && highest.bytes[0] != out.entries.back().sub) {
        keys_.report(
            Severity::note, Topic::count, first.at,
            "highest sub-index of " + label(out.index) + " is " + std::to_string(highest.bytes[0]) +
                " by sub-index 0, but the file describes " + std::to_string(out.entries.back().sub),
            "");
    }
}

Object ObjectReader::object(std::uint16_t index, Draft& draft) {
    Object out;
    out.index = index;
    const std::string what = label(index);
    if (draft.object == nullptr) {
        out.type = ObjectType::record;
        out.at = !draft.subs.empty() ? draft.subs.begin()->second->at : Span{};
        keys_.report(Severity::warning, Topic::missing, out.at,
                     "missing section [" + prefix_ + what + "]: only its sub-indices are described",
                     "read as RECORD");
    } else {
        IniSection& section = *draft.object;
        section.used = true;
        out.at = section.at;
        bool given = false;
        const std::size_t said = draft.subs.empty() ? 0 : 1;
        const ObjectType written = [&] {
            IniKey* key = section.find("ObjectType");
            const auto number = key != nullptr ? parse_number(key->value) : std::nullopt;
            if (number &&
                (number->magnitude == 8 || number->magnitude == 9 || number->magnitude == 6)) {
                return static_cast<ObjectType>(number->magnitude);
            }
            return ObjectType::var;
        }();
        const auto compact = keys_.number(section, "CompactSubObj", 0xFE).value_or(0);
        if (compact != 0) {
            expand(out, section, static_cast<unsigned>(compact));
            out.type = written == ObjectType::var ? ObjectType::array : written;
            out.name = keys_.text(section, "ParameterName");
            out.data_type = out.entries.back().data_type;
            if (!draft.subs.empty()) {
                keys_.report(
                    Severity::note, Topic::object, section.at,
                    "object " + what + " has CompactSubObj and sections for some sub-indices",
                    "the sections take precedence");
            }
        } else if (written == ObjectType::var && said == 0) {
            Entry only = entry(section, what, false);
            out.type = only.type == ObjectType::array || only.type == ObjectType::record ||
                               only.type == ObjectType::defstruct
                           ? ObjectType::var
                           : only.type;
            if (out.type != only.type) {  // spelled as a word
                out.type = only.type;
                out.name = only.name;
                check_entries(out, section);
            } else {
                if (const auto subs = keys_.number(section, "SubNumber", 0xFF); subs && *subs > 1) {
                    keys_.report(Severity::warning, Topic::count,
                                 section.find("SubNumber")->value_at,
                                 "'SubNumber' of " + what + " is " + std::to_string(*subs) +
                                     ", but it is a " + std::string(name_of(only.type)) +
                                     " without sub-indices",
                                 "delete SubNumber, or write ObjectType=0x9 and the sub-indices");
                }
                out.name = only.name;
                out.denotation = only.denotation;
                only.denotation.clear();
                out.flags = only.flags;
                only.flags = 0;
                out.entries.push_back(std::move(only));
            }
        } else {
            out.name = keys_.text(section, "ParameterName");
            if (out.name.empty()) {
                keys_.report(Severity::warning, Topic::missing, section.at,
                             "'ParameterName' of " + what + " is missing or empty",
                             "give the object a name");
            }
            out.type = object_type(section, what, given);
            if (out.single()) {
                keys_.report(Severity::warning, Topic::object,
                             given ? section.find("ObjectType")->value_at : section.at,
                             "object " + what + " is a " + std::string(name_of(out.type)) +
                                 ", but the file describes sub-indices",
                             "read as RECORD; write ObjectType=0x9");
                out.type = ObjectType::record;
            }
            out.data_type = type_of(section, what, false);
        }
        if (out.denotation.empty()) {
            out.denotation = keys_.text(section, "Denotation");
        }
        if (out.flags == 0) {
            out.flags = static_cast<std::uint32_t>(
                keys_.number(section, "ObjFlags", 0xFFFFFFFF).value_or(0));
        }
        keys_.number(section, "SubNumber", 0xFFFF);
    }
    for (auto& [sub, section] : draft.subs) {
        Entry one = entry(*section, label(index, sub), true);
        one.sub = static_cast<std::uint8_t>(sub);
        if (Entry* old = out.find(one.sub)) {
            *old = std::move(one);
        } else {
            out.entries.push_back(std::move(one));
        }
    }
    std::sort(out.entries.begin(), out.entries.end(),
              [](const Entry& a, const Entry& b) { return a.sub < b.sub; });
    if (draft.object != nullptr) {
        if (!out.single()) {
            check_entries(out, *draft.object);
        }
        out.extras = keys_.rest(*draft.object, known_keys);
        if (!out.single() &&
            out.compact ==
                0) {  // keys of a RECORD that repeat those of its entries have no meaning
            std::erase_if(out.extras, [](const auto& extra) {
                return same_word(extra.first, "AccessType") ||
                       same_word(extra.first, "PDOMapping") ||
                       (same_word(extra.first, "DefaultValue") && extra.second.empty());
            });
        }
    }
    spread(out, draft.names, &Entry::name, "name");
    spread(out, draft.values, &Entry::parameter_value, "value");
    spread(out, draft.denotations, &Entry::denotation, "denotation");
    if (draft.links != nullptr) {
        draft.links->used = true;
        for (const auto& [number, key] : keys_.list(*draft.links, "ObjectLinks")) {
            if (const auto link = keys_.parse(*draft.links, *key, 0xFFFF)) {
                out.links.push_back(static_cast<std::uint16_t>(*link));
            }
        }
    }
    if (!compactable(out)) {
        out.compact = 0;
    }
    return out;
}

std::vector<Object> ObjectReader::read() {
    std::map<std::uint16_t, Draft> drafts;
    for (IniSection& section : ini_.sections()) {
        std::string_view name = section.name;
        if (name.size() < prefix_.size() || !same_word(name.substr(0, prefix_.size()), prefix_)) {
            continue;
        }
        const SectionName means = section_name(name.substr(prefix_.size()));
        using What = SectionName::What;
        if (means.what == What::other) continue;
        if (means.odd) {
            keys_.report(
                Severity::warning, Topic::syntax, section.at,
                "misspelt object section [" + section.name + "]",
                "write [" + prefix_ +
                    (means.what == What::sub ? label(means.index, means.sub) : label(means.index)) +
                    "]");
        }
        if (means.what == What::sub && means.sub > 0xFF) {
            keys_.report(Severity::warning, Topic::object, section.at,
                         "invalid sub-index " + hex(means.sub, 1),
                         "the range is 0..FF; the section was kept unchanged");
            continue;
        }
        Draft& draft = drafts[means.index];
        IniSection** place = nullptr;
        switch (means.what) {
        case What::object: place = &draft.object; break;
        case What::names: place = &draft.names; break;
        case What::values: place = &draft.values; break;
        case What::denotations: place = &draft.denotations; break;
        case What::links: place = &draft.links; break;
        default: place = &draft.subs[means.sub];
        }
        if (*place != nullptr) {
            keys_.report(Severity::warning, Topic::conflict, section.at,
                         "duplicate section [" + section.name + "]: line " +
                             std::to_string((*place)->at.line) + " describes the same",
                         "the first one is used, this one was kept unchanged");
            continue;
        }
        *place = &section;
    }
    std::vector<Object> out;
    for (auto& [index, draft] : drafts) {
        if (draft.object == nullptr && draft.subs.empty()) {
            for (IniSection* section :
                 {draft.names, draft.values, draft.denotations, draft.links}) {
                if (section != nullptr) {
                    keys_.report(
                        Severity::warning, Topic::missing, section->at,
                        "[" + section->name + "] belongs to an object that is not described",
                        "missing section [" + prefix_ + label(index) +
                            "]; this one was kept unchanged");
                }
            }
            continue;
        }
        out.push_back(object(index, draft));
    }
    return out;
}

}  // namespace hal::canopen::eds
