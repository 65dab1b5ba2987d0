// SPDX-License-Identifier: MIT
// The object sections: [1018], [1018sub1], [1018Name], [1018Value], [1018Denotation], [1018ObjectLinks].
#include <algorithm>
#include <array>

#include "eds_reader.hpp"

namespace hal::canopen::eds {

namespace {

struct AccessWord {
    std::string_view word;
    Access           access;
    bool             proper;
};
constexpr AccessWord access_words[] = {
    {"ro", Access::ro, true},
    {"wo", Access::wo, true},
    {"rw", Access::rw, true},
    {"rwr", Access::rwr, true},
    {"rww", Access::rww, true},
    {"const", Access::constant, true},
    {"constant", Access::constant, false},
    {"cons", Access::constant, false},
    {"r", Access::ro, false},
    {"read", Access::ro, false},
    {"readonly", Access::ro, false},
    {"read-only", Access::ro, false},
    {"r/o", Access::ro, false},
    {"w", Access::wo, false},
    {"write", Access::wo, false},
    {"writeonly", Access::wo, false},
    {"w/o", Access::wo, false},
    {"r/w", Access::rw, false},
    {"wr", Access::rw, false},
    {"readwrite", Access::rw, false},
    {"read/write", Access::rw, false},
    {"read-write", Access::rw, false},
    {"rw/r", Access::rwr, false},
    {"rw/w", Access::rww, false},
    {"c", Access::constant, false},
};

struct TypeWord {
    std::string_view word;
    ObjectType       type;
};
constexpr TypeWord object_types[] = {
    {"NULL", ObjectType::null}, {"DOMAIN", ObjectType::domain}, {"DEFTYPE", ObjectType::deftype}, {"DEFSTRUCT", ObjectType::defstruct},
    {"VAR", ObjectType::var},   {"ARRAY", ObjectType::array},   {"RECORD", ObjectType::record},
};

const std::initializer_list<std::string_view> known_keys{"ParameterName",  "ObjectType", "DataType",     "AccessType", "PDOMapping",
                                                         "DefaultValue",   "LowLimit",   "HighLimit",    "SubNumber",  "CompactSubObj",
                                                         "ParameterValue", "Denotation", "DownloadFile", "UploadFile", "ObjFlags"};

constexpr std::size_t longest_name = 241;

}  // namespace

std::string_view name_of(ObjectType type) {
    for (const TypeWord& row : object_types)
        if (row.type == type) return row.word;
    return "?";
}

std::string_view name_of(Access access) {
    for (const AccessWord& row : access_words)
        if (row.access == access) return row.word;
    return "?";
}

ObjectType ObjectReader::object_type(IniSection& section, const std::string& what, bool& given) {
    IniKey* key = section.find("ObjectType");
    given = key != nullptr;
    if (key == nullptr) return ObjectType::var;
    key->used = true;
    keys_.cut_comment(*key);
    if (key->value.empty()) {
        given = false;
        keys_.say(Severity::warning, Topic::missing, key->value_at, "'ObjectType' of " + what + " is empty", "taken for 0x7, a VAR");
        return ObjectType::var;
    }
    for (const TypeWord& row : object_types)
        if (same_word(row.word, key->value)) {
            keys_.say(Severity::warning, Topic::object, key->value_at, "'ObjectType' of " + what + " is a word",
                      "write " + hex(static_cast<unsigned>(row.type), 1));
            return row.type;
        }
    const auto number = keys_.parse(section, *key, 0xFF);
    for (const TypeWord& row : object_types)
        if (number && static_cast<unsigned>(row.type) == *number) return row.type;
    if (number)
        keys_.say(Severity::warning, Topic::object, key->value_at, "there is no object type " + key->value,
                  "0x2 DOMAIN, 0x5 DEFTYPE, 0x6 DEFSTRUCT, 0x7 VAR, 0x8 ARRAY, 0x9 RECORD; taken for a VAR");
    given = false;
    return ObjectType::var;
}

std::uint16_t ObjectReader::type_of(IniSection& section, const std::string& what, bool needed) {
    IniKey* key = section.find("DataType");
    if (key != nullptr) key->used = true, keys_.cut_comment(*key);
    if (key == nullptr || key->value.empty()) {
        if (needed)
            keys_.say(Severity::warning, Topic::missing, key != nullptr ? key->value_at : section.at,
                      "'DataType' of " + what + " is " + (key != nullptr ? "empty" : "missing"),
                      "such an object can be sent and received as bytes only; write for example DataType=0x0007 for UNSIGNED32");
        return 0;
    }
    if (const DataType* named = data_type(std::string_view(key->value)); named != nullptr) {
        keys_.say(Severity::warning, Topic::object, key->value_at, "'DataType' of " + what + " is a word", "write " + hex(named->code));
        return named->code;
    }
    const auto number = keys_.parse(section, *key, 0xFFFF);
    if (!number) return 0;
    const auto code = static_cast<std::uint16_t>(*number);
    if (data_type(code) == nullptr && (code < 0x20 || code > 0x25F))
        keys_.say(Severity::warning, Topic::object, key->value_at, "there is no data type " + hex(code),
                  "0x0001 to 0x001B are the simple ones, 0x0005 is UNSIGNED8");
    return code;
}

Access ObjectReader::access_of(IniSection& section, const std::string& what, bool needed) {
    IniKey* key = section.find("AccessType");
    if (key != nullptr) key->used = true, keys_.cut_comment(*key);
    if (key == nullptr || key->value.empty()) {
        if (needed)
            keys_.say(Severity::warning, Topic::missing, key != nullptr ? key->value_at : section.at,
                      "'AccessType' of " + what + " is " + (key != nullptr ? "empty" : "missing"),
                      "taken for rw; ro, wo, rw, rwr, rww and const are possible");
        return Access::rw;
    }
    for (const AccessWord& row : access_words) {
        if (!same_word(row.word, key->value)) continue;
        if (!row.proper)
            keys_.say(Severity::warning, Topic::object, key->value_at, "there is no access type '" + key->value + "'",
                      "taken for " + std::string(name_of(row.access)));
        return row.access;
    }
    keys_.say(Severity::warning, Topic::object, key->value_at, "there is no access type '" + key->value.substr(0, 40) + "'",
              "taken for rw; ro, wo, rw, rwr, rww and const are possible");
    return Access::rw;
}

void ObjectReader::value(IniSection& section, const char* name, std::string& out, std::uint16_t type, const std::string& what) {
    IniKey* key = section.find(name);
    if (key == nullptr) return;
    key->used = true;
    const DataType* known = data_type(type);
    const bool      number = known != nullptr && known->kind < Kind::text;
    if (number) keys_.cut_comment(*key);
    out = key->value;
    if (out.empty() || known == nullptr || known->kind == Kind::structure || known->kind == Kind::domain) return;
    const Encoded     encoded = encode(out, type, 1);
    const std::string it = "'" + key->name + "' of " + what;
    if (!encoded) {
        const auto parsed = parse_number(out);
        const bool bare_hex = number && !parsed && out.size() <= 8 && out.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
        keys_.say(Severity::warning, Topic::value, key->value_at, it + ": " + encoded.error,
                  bare_hex ? "write 0x" + out : "the object counts as one without this value");
        return;
    }
    const auto odd = [&](Severity severity, std::string sentence, std::string help) {
        keys_.say(severity, Topic::value, key->value_at, std::move(sentence), std::move(help));
    };
    switch (encoded.spelling) {
    case Spelling::octal:
        odd(Severity::warning, it + " begins with 0 and is read as an octal number: " + spell(encoded.bytes, type),
            "leave the 0 out if it is decimal, write 0x if it is hexadecimal");
        break;
    case Spelling::decimal_with_zero:
        odd(Severity::warning, it + " begins with 0, yet is no octal number; read as decimal", "leave the 0 out");
        break;
    case Spelling::unsigned_for_negative:
        if (known->kind == Kind::integer)
            odd(Severity::note, it + " is the bit pattern of a negative number: " + spell(encoded.bytes, type),
                "write " + spell(encoded.bytes, type));
        else
            odd(Severity::warning, it + " is negative, " + std::string(known->name) + " is not; read as " + spell(encoded.bytes, type),
                "write " + spell(encoded.bytes, type));
        break;
    case Spelling::number_as_real: odd(Severity::warning, it + " is written as a fraction", "write " + spell(encoded.bytes, type)); break;
    case Spelling::real_as_bits:
        odd(Severity::warning, it + " is taken for the bits of " + spell(encoded.bytes, type),
            "other tools take it for a number; write " + spell(encoded.bytes, type));
        break;
    case Spelling::words: odd(Severity::warning, it + " is a word", "write " + spell(encoded.bytes, type)); break;
    case Spelling::plain: break;
    }
}

Entry ObjectReader::entry(IniSection& section, const std::string& what, bool is_sub) {
    Entry out;
    section.used = true;
    out.at = section.at;
    out.name = keys_.text(section, "ParameterName");
    if (out.name.empty())
        keys_.say(Severity::warning, Topic::missing, section.at,
                  "'ParameterName' of " + what + " is " + (section.find("ParameterName") != nullptr ? "empty" : "missing"),
                  "every object has a name");
    if (out.name.size() > longest_name)
        keys_.say(Severity::note, Topic::value, section.find("ParameterName")->value_at,
                  "the name of " + what + " has " + std::to_string(out.name.size()) + " characters", "241 are allowed");
    bool given = false;
    out.type = object_type(section, what, given);
    if (is_sub && (out.type == ObjectType::array || out.type == ObjectType::record || out.type == ObjectType::defstruct)) {
        keys_.say(Severity::warning, Topic::object, section.find("ObjectType")->value_at,
                  what + " is a sub-index and cannot be of type " + std::string(name_of(out.type)),
                  "taken for a VAR; write ObjectType=0x7");
        out.type = ObjectType::var;
    }
    const bool is_value = out.type == ObjectType::var;
    out.data_type = type_of(section, what, is_value);
    if (out.data_type == 0 && out.type == ObjectType::domain) out.data_type = 0x0F;
    if (const DataType* type = data_type(out.data_type); is_value && type != nullptr && type->kind == Kind::structure)
        keys_.say(Severity::warning, Topic::object, section.find("DataType")->value_at,
                  "data type " + hex(out.data_type) + " of " + what + " is a record, not that of a single value", "");
    out.access = access_of(section, what, is_value);
    out.pdo_mapping = keys_.flag(section, "PDOMapping");
    value(section, "DefaultValue", out.default_value, out.data_type, what);
    value(section, "LowLimit", out.low_limit, out.data_type, what);
    value(section, "HighLimit", out.high_limit, out.data_type, what);
    value(section, "ParameterValue", out.parameter_value, out.data_type, what);
    out.denotation = keys_.text(section, "Denotation");
    out.upload_file = keys_.text(section, "UploadFile");
    out.download_file = keys_.text(section, "DownloadFile");
    out.flags = static_cast<std::uint32_t>(keys_.number(section, "ObjFlags", 0xFFFFFFFF).value_or(0));
    if (is_sub) {
        if (keys_.number(section, "SubNumber", 0xFF).value_or(0) != 0)
            keys_.say(Severity::note, Topic::object, section.find("SubNumber")->at,
                      "a sub-index has no sub-indices: 'SubNumber' of " + what + " was left out", "");
        out.extras = keys_.rest(section, known_keys);
    }
    const auto low = comparable(out.low_limit, out.data_type, 1), high = comparable(out.high_limit, out.data_type, 1);
    if (low && high && *low > *high) {
        keys_.say(Severity::warning, Topic::value, section.find("LowLimit")->value_at,
                  "the limits of " + what + " leave no value: " + out.low_limit + " to " + out.high_limit,
                  "exchange LowLimit and HighLimit?");
    } else {
        for (const auto& [key, text] :
             {std::pair<const char*, const std::string*>{"DefaultValue", &out.default_value}, {"ParameterValue", &out.parameter_value}}) {
            const auto number = comparable(*text, out.data_type, 1);
            if (number && ((low && *number < *low) || (high && *number > *high)))
                keys_.say(Severity::warning, Topic::value, section.find(key)->value_at,
                          "'" + std::string(key) + "' of " + what + " is outside of its limits: " + *text,
                          "allowed is " + (low ? out.low_limit : "any") + " to " + (high ? out.high_limit : "any"));
        }
    }
    return out;
}

void ObjectReader::spread(Object& out, IniSection* list, std::string Entry::* field, const char* what) {
    if (list == nullptr) return;
    list->used = true;
    for (const auto& [number, key] : keys_.list(*list, "NrOfEntries")) {
        Entry* entry = number <= 0xFF ? out.find(static_cast<std::uint8_t>(number)) : nullptr;
        if (entry == nullptr) {
            keys_.say(Severity::warning, Topic::count, key->at,
                      "[" + list->name + "] has a " + what + " for sub-index " + key->name + ", which object " + label(out.index) +
                          " does not have",
                      "sub-indices here are decimal numbers");
            out.extras.emplace_back(list->name + "." + key->name, key->value);
            continue;
        }
        if (entry->*field != key->value && !key->value.empty()) entry->*field = key->value;
        if (field != &Entry::parameter_value) continue;
        const Encoded   encoded = encode(key->value, entry->data_type, 1);
        const DataType* type = data_type(entry->data_type);
        if (!encoded && type != nullptr && type->kind < Kind::text)
            keys_.say(Severity::warning, Topic::value, key->value_at,
                      "value of sub-index " + key->name + " of " + label(out.index) + ": " + encoded.error, "");
    }
    if (IniKey* count = list->find("NrOfEntries")) count->used = true;
    const Extras more = keys_.rest(*list);
    for (const auto& [key, text] : more)
        if (!key.empty()) out.extras.emplace_back(list->name + "." + key, text);
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
    IniKey*           key = section.find("SubNumber");
    if (out.compact != 0) return;
    if (count == 0) {
        keys_.say(Severity::warning, Topic::count, section.at,
                  "object " + label(out.index) + " is of type " + std::string(name_of(out.type)) + " and has no sub-indices",
                  "describe them in sections [" + label(out.index) + "sub0] and so on, or by CompactSubObj");
        return;
    }
    if (key == nullptr || key->value.empty()) {
        keys_.say(Severity::warning, Topic::missing, section.at,
                  "'SubNumber' of " + label(out.index) + " is " + (key != nullptr ? "empty" : "missing"),
                  "there are " + std::to_string(count) + " sub-indices; write SubNumber=" + hex(count, 1));
    } else if (const auto said = parse_number(key->value); said && said->magnitude != count) {
        keys_.say(Severity::warning, Topic::count, key->value_at,
                  "'SubNumber' of " + label(out.index) + " is " + std::to_string(said->magnitude) + ", the file describes " +
                      std::to_string(count),
                  "it counts sub-index 0, too: write SubNumber=" + hex(count, 1));
    }
    if (out.entries.front().sub != 0) {
        keys_.say(Severity::warning, Topic::missing, section.at, "sub-index 0 of " + label(out.index) + " is missing",
                  "it holds the highest sub-index of every ARRAY and RECORD");
        return;
    }
    const Entry& first = out.entries.front();
    if (first.data_type != 0x05 && first.data_type != 0)
        keys_.say(Severity::note, Topic::object, first.at, "sub-index 0 of " + label(out.index) + " is not of type UNSIGNED8", "");
    if (first.writable() || out.index == 0x1003) return;
    const Encoded highest = encode(first.default_value, 0x05, 1);
    if (highest && !highest.bytes.empty() && highest.bytes[0] != out.entries.back().sub)
        keys_.say(Severity::note, Topic::count, first.at,
                  "sub-index 0 of " + label(out.index) + " says that " + std::to_string(highest.bytes[0]) +
                      " is the highest, the file describes " + std::to_string(out.entries.back().sub),
                  "");
}

Object ObjectReader::object(std::uint16_t index, Draft& draft) {
    Object out;
    out.index = index;
    const std::string what = label(index);
    if (draft.object == nullptr) {
        out.type = ObjectType::record;
        out.at = !draft.subs.empty() ? draft.subs.begin()->second->at : Place{};
        keys_.say(Severity::warning, Topic::missing, out.at, "section [" + prefix_ + what + "] is missing; there are only its sub-indices",
                  "the object was taken for a RECORD");
    } else {
        IniSection& section = *draft.object;
        section.used = true;
        out.at = section.at;
        bool              given = false;
        const std::size_t said = draft.subs.empty() ? 0 : 1;
        const ObjectType  written = [&] {
            IniKey*    key = section.find("ObjectType");
            const auto number = key != nullptr ? parse_number(key->value) : std::nullopt;
            if (number && (number->magnitude == 8 || number->magnitude == 9 || number->magnitude == 6))
                return static_cast<ObjectType>(number->magnitude);
            return ObjectType::var;
        }();
        const auto compact = keys_.number(section, "CompactSubObj", 0xFE).value_or(0);
        if (compact != 0) {
            expand(out, section, static_cast<unsigned>(compact));
            out.type = written == ObjectType::var ? ObjectType::array : written;
            out.name = keys_.text(section, "ParameterName");
            out.data_type = out.entries.back().data_type;
            if (!draft.subs.empty())
                keys_.say(Severity::note, Topic::object, section.at,
                          "object " + what + " has CompactSubObj and sections of its own for some sub-indices", "the sections count");
        } else if (written == ObjectType::var && said == 0) {
            Entry only = entry(section, what, false);
            out.type = only.type == ObjectType::array || only.type == ObjectType::record || only.type == ObjectType::defstruct
                           ? ObjectType::var
                           : only.type;
            if (out.type != only.type) {  // spelled as a word
                out.type = only.type;
                out.name = only.name;
                check_entries(out, section);
            } else {
                if (const auto subs = keys_.number(section, "SubNumber", 0xFF); subs && *subs > 1)
                    keys_.say(Severity::warning, Topic::count, section.find("SubNumber")->value_at,
                              "'SubNumber' of " + what + " is " + std::to_string(*subs) + ", but it is a " +
                                  std::string(name_of(only.type)) + " without sub-indices",
                              "leave SubNumber out, or write ObjectType=0x9 and the sub-indices");
                out.name = only.name;
                out.denotation = only.denotation;
                only.denotation.clear();
                out.flags = only.flags;
                only.flags = 0;
                out.entries.push_back(std::move(only));
            }
        } else {
            out.name = keys_.text(section, "ParameterName");
            if (out.name.empty())
                keys_.say(Severity::warning, Topic::missing, section.at, "'ParameterName' of " + what + " is missing or empty",
                          "every object has a name");
            out.type = object_type(section, what, given);
            if (out.single()) {
                keys_.say(Severity::warning, Topic::object, given ? section.find("ObjectType")->value_at : section.at,
                          "object " + what + " is a " + std::string(name_of(out.type)) + ", yet the file describes sub-indices",
                          "taken for a RECORD; write ObjectType=0x9");
                out.type = ObjectType::record;
            }
            out.data_type = type_of(section, what, false);
        }
        if (out.denotation.empty()) out.denotation = keys_.text(section, "Denotation");
        if (out.flags == 0) out.flags = static_cast<std::uint32_t>(keys_.number(section, "ObjFlags", 0xFFFFFFFF).value_or(0));
        keys_.number(section, "SubNumber", 0xFFFF);
    }
    for (auto& [sub, section] : draft.subs) {
        Entry one = entry(*section, label(index, sub), true);
        one.sub = static_cast<std::uint8_t>(sub);
        if (Entry* old = out.find(one.sub)) *old = std::move(one);
        else out.entries.push_back(std::move(one));
    }
    std::sort(out.entries.begin(), out.entries.end(), [](const Entry& a, const Entry& b) { return a.sub < b.sub; });
    if (draft.object != nullptr) {
        if (!out.single()) check_entries(out, *draft.object);
        out.extras = keys_.rest(*draft.object, known_keys);
        if (!out.single() && out.compact == 0)  // what a RECORD repeats of its entries means nothing
            std::erase_if(out.extras, [](const auto& extra) {
                return same_word(extra.first, "AccessType") || same_word(extra.first, "PDOMapping") ||
                       (same_word(extra.first, "DefaultValue") && extra.second.empty());
            });
    }
    spread(out, draft.names, &Entry::name, "name");
    spread(out, draft.values, &Entry::parameter_value, "value");
    spread(out, draft.denotations, &Entry::denotation, "denotation");
    if (draft.links != nullptr) {
        draft.links->used = true;
        for (const auto& [number, key] : keys_.list(*draft.links, "ObjectLinks"))
            if (const auto link = keys_.parse(*draft.links, *key, 0xFFFF)) out.links.push_back(static_cast<std::uint16_t>(*link));
    }
    if (!compactable(out)) out.compact = 0;
    return out;
}

std::vector<Object> ObjectReader::read() {
    std::map<std::uint16_t, Draft> drafts;
    for (IniSection& section : ini_.sections()) {
        std::string_view name = section.name;
        if (name.size() < prefix_.size() || !same_word(name.substr(0, prefix_.size()), prefix_)) continue;
        const SectionName means = section_name(name.substr(prefix_.size()));
        using What = SectionName::What;
        if (means.what == What::other) continue;
        if (means.odd)
            keys_.say(Severity::warning, Topic::syntax, section.at, "[" + section.name + "] is a misspelt object section",
                      "write [" + prefix_ + (means.what == What::sub ? label(means.index, means.sub) : label(means.index)) + "]");
        if (means.what == What::sub && means.sub > 0xFF) {
            keys_.say(Severity::warning, Topic::object, section.at, "there is no sub-index " + hex(means.sub, 1),
                      "0 to FF are possible; the section was kept as it is");
            continue;
        }
        Draft&       draft = drafts[means.index];
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
            keys_.say(Severity::warning, Topic::syntax, section.at,
                      "[" + section.name + "] describes what line " + std::to_string((*place)->at.line) + " has described",
                      "the first counts, this one was kept as it is");
            continue;
        }
        *place = &section;
    }
    std::vector<Object> out;
    for (auto& [index, draft] : drafts) {
        if (draft.object == nullptr && draft.subs.empty()) {
            for (IniSection* section : {draft.names, draft.values, draft.denotations, draft.links})
                if (section != nullptr)
                    keys_.say(Severity::warning, Topic::missing, section->at,
                              "[" + section->name + "] belongs to an object that is not described",
                              "there is no section [" + prefix_ + label(index) + "]; it was kept as it is");
            continue;
        }
        out.push_back(object(index, draft));
    }
    return out;
}

}  // namespace hal::canopen::eds
