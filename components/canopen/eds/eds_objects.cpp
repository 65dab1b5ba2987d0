// SPDX-License-Identifier: MIT
// The object sections: [1018], [1018sub1], [1018Name], [1018Value], [1018Denotation],
// [1018ObjectLinks].
#include <algorithm>

#include "eds_reader.hpp"

namespace hal::canopen::eds {

namespace {

/// Returns the object type that a section gives as a number, if objects of it have sub-indices;
/// else VAR.
ObjectType structured_type(IniSection& section) {
    IniKey* key = section.find("ObjectType");
    if (key == nullptr) return ObjectType::var;
    const auto number = parse_number(key->value);
    if (!number) return ObjectType::var;
    switch (number->magnitude) {
    case 6:
    case 8:
    case 9: return static_cast<ObjectType>(number->magnitude);
    default: return ObjectType::var;
    }
}

bool has_sub_indices(ObjectType type) {
    return type == ObjectType::array || type == ObjectType::record || type == ObjectType::defstruct;
}

}  // namespace

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
    Entry each = entries_.read(section, label(out.index), false);
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
    if (draft.object != nullptr) {
        head(out, *draft.object, !draft.subs.empty());
    } else {
        out.type = ObjectType::record;
        out.at = !draft.subs.empty() ? draft.subs.begin()->second->at : Span{};
        keys_.report(
            Severity::warning, Topic::missing, out.at,
            "missing section [" + prefix_ + label(index) + "]: only its sub-indices are described",
            "read as RECORD");
    }
    add_subs(out, draft);
    if (draft.object != nullptr) {
        finish(out, *draft.object);
    }
    spread(out, draft.names, &Entry::name, "name");
    spread(out, draft.values, &Entry::parameter_value, "value");
    spread(out, draft.denotations, &Entry::denotation, "denotation");
    add_links(out, draft.links);
    if (!compactable(out)) {
        out.compact = 0;
    }
    return out;
}

/// Reads the section of the object itself. `has_subs`: other sections describe sub-indices.
void ObjectReader::head(Object& out, IniSection& section, bool has_subs) {
    section.used = true;
    out.at = section.at;
    const ObjectType type = structured_type(section);
    const auto compact = keys_.number(section, "CompactSubObj", 0xFE).value_or(0);
    if (compact != 0) {
        expand(out, section, static_cast<unsigned>(compact));
        out.type = type == ObjectType::var ? ObjectType::array : type;
        out.name = keys_.text(section, "ParameterName");
        out.data_type = out.entries.back().data_type;
        if (has_subs) {
            keys_.report(Severity::note, Topic::object, section.at,
                         "object " + label(out.index) +
                             " has CompactSubObj and sections for some sub-indices",
                         "the sections take precedence");
        }
    } else if (type == ObjectType::var && !has_subs) {
        single(out, section);
    } else {
        structure(out, section);
    }
    if (out.denotation.empty()) {
        out.denotation = keys_.text(section, "Denotation");
    }
    if (out.flags == 0) {
        out.flags =
            static_cast<std::uint32_t>(keys_.number(section, "ObjFlags", 0xFFFFFFFF).value_or(0));
    }
    keys_.number(section, "SubNumber", 0xFFFF);
}

/// An object without sections of sub-indices: a single value, unless its type is spelled as a word.
void ObjectReader::single(Object& out, IniSection& section) {
    const std::string what = label(out.index);
    Entry only = entries_.read(section, what, false);
    out.type = only.type;
    out.name = only.name;
    if (has_sub_indices(only.type)) return check_entries(out, section);
    if (const auto subs = keys_.number(section, "SubNumber", 0xFF); subs && *subs > 1) {
        keys_.report(Severity::warning, Topic::count, section.find("SubNumber")->value_at,
                     "'SubNumber' of " + what + " is " + std::to_string(*subs) + ", but it is a " +
                         std::string(name_of(only.type)) + " without sub-indices",
                     "delete SubNumber, or write ObjectType=0x9 and the sub-indices");
    }
    out.denotation = only.denotation;
    only.denotation.clear();
    out.flags = only.flags;
    only.flags = 0;
    out.entries.push_back(std::move(only));
}

/// An object whose sub-indices have sections.
void ObjectReader::structure(Object& out, IniSection& section) {
    const std::string what = label(out.index);
    out.name = keys_.text(section, "ParameterName");
    if (out.name.empty()) {
        keys_.report(Severity::warning, Topic::missing, section.at,
                     "'ParameterName' of " + what + " is missing or empty",
                     "give the object a name");
    }
    bool given = false;
    out.type = entries_.object_type(section, what, given);
    if (out.single()) {
        keys_.report(Severity::warning, Topic::object,
                     given ? section.find("ObjectType")->value_at : section.at,
                     "object " + what + " is a " + std::string(name_of(out.type)) +
                         ", but the file describes sub-indices",
                     "read as RECORD; write ObjectType=0x9");
        out.type = ObjectType::record;
    }
    out.data_type = entries_.data_type_of(section, what, false);
}

void ObjectReader::add_subs(Object& out, Draft& draft) {
    for (auto& [sub, section] : draft.subs) {
        Entry one = entries_.read(*section, label(out.index, sub), true);
        one.sub = static_cast<std::uint8_t>(sub);
        if (Entry* old = out.find(one.sub)) {
            *old = std::move(one);
        } else {
            out.entries.push_back(std::move(one));
        }
    }
    std::sort(out.entries.begin(), out.entries.end(),
              [](const Entry& a, const Entry& b) { return a.sub < b.sub; });
}

/// Checks the entries, and keeps the keys that were not read.
void ObjectReader::finish(Object& out, IniSection& section) {
    if (!out.single()) {
        check_entries(out, section);
    }
    out.extras = keys_.rest(section, entry_keys);
    if (out.single() || out.compact != 0) return;
    // keys of a RECORD that repeat those of its entries have no meaning
    std::erase_if(out.extras, [](const auto& extra) {
        return same_word(extra.first, "AccessType") || same_word(extra.first, "PDOMapping") ||
               (same_word(extra.first, "DefaultValue") && extra.second.empty());
    });
}

void ObjectReader::add_links(Object& out, IniSection* links) {
    if (links == nullptr) return;
    links->used = true;
    for (const auto& [number, key] : keys_.list(*links, "ObjectLinks")) {
        if (const auto link = keys_.parse(*links, *key, 0xFFFF)) {
            out.links.push_back(static_cast<std::uint16_t>(*link));
        }
    }
}

/// Sorts a section into the draft of its object.
void ObjectReader::sort(IniSection& section, std::map<std::uint16_t, Draft>& drafts) {
    using What = SectionName::What;
    const std::string_view name = section.name;
    if (name.size() < prefix_.size() || !same_word(name.substr(0, prefix_.size()), prefix_)) return;
    const SectionName means = section_name(name.substr(prefix_.size()));
    if (means.what == What::other) return;
    if (means.odd) {
        const std::string right =
            means.what == What::sub ? label(means.index, means.sub) : label(means.index);
        keys_.report(Severity::warning, Topic::syntax, section.at,
                     "misspelt object section [" + section.name + "]",
                     "write [" + prefix_ + right + "]");
    }
    if (means.what == What::sub && means.sub > 0xFF) {
        keys_.report(Severity::warning, Topic::object, section.at,
                     "invalid sub-index " + hex(means.sub, 1),
                     "the range is 0..FF; the section was kept unchanged");
        return;
    }
    IniSection*& slot = drafts[means.index].slot(means);
    if (slot != nullptr) {
        keys_.report(Severity::warning, Topic::conflict, section.at,
                     "duplicate section [" + section.name + "]: line " +
                         std::to_string(slot->at.line) + " describes the same",
                     "the first one is used, this one was kept unchanged");
        return;
    }
    slot = &section;
}

IniSection*& ObjectReader::Draft::slot(const SectionName& means) {
    switch (means.what) {
    case SectionName::What::object: return object;
    case SectionName::What::names: return names;
    case SectionName::What::values: return values;
    case SectionName::What::denotations: return denotations;
    case SectionName::What::links: return links;
    default: return subs[means.sub];
    }
}

/// Reports the lists of an object without a section of its own.
void ObjectReader::report_lists_alone(std::uint16_t index, const Draft& draft) {
    for (IniSection* section : {draft.names, draft.values, draft.denotations, draft.links}) {
        if (section == nullptr) continue;
        keys_.report(
            Severity::warning, Topic::missing, section->at,
            "[" + section->name + "] belongs to an object that is not described",
            "missing section [" + prefix_ + label(index) + "]; this one was kept unchanged");
    }
}

std::vector<Object> ObjectReader::read() {
    std::map<std::uint16_t, Draft> drafts;
    for (IniSection& section : ini_.sections()) {
        sort(section, drafts);
    }
    std::vector<Object> out;
    for (auto& [index, draft] : drafts) {
        if (draft.object == nullptr && draft.subs.empty()) {
            report_lists_alone(index, draft);
        } else {
            out.push_back(object(index, draft));
        }
    }
    return out;
}

}  // namespace hal::canopen::eds
