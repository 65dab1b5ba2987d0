// SPDX-License-Identifier: MIT
// The section of a value: object type, data type, access type, values and their range.
#include <algorithm>

#include "eds_reader.hpp"
#include "text/find_row.hpp"

namespace hal::canopen::eds {

const std::initializer_list<std::string_view> entry_keys{
    "ParameterName",  "ObjectType", "DataType",     "AccessType", "PDOMapping",
    "DefaultValue",   "LowLimit",   "HighLimit",    "SubNumber",  "CompactSubObj",
    "ParameterValue", "Denotation", "DownloadFile", "UploadFile", "ObjFlags"};

namespace {

struct AccessWord {
    std::string_view word;
    Access access;
    bool proper;
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
    ObjectType type;
};
constexpr TypeWord object_types[] = {
    {"NULL", ObjectType::null},       {"DOMAIN", ObjectType::domain},
    {"DEFTYPE", ObjectType::deftype}, {"DEFSTRUCT", ObjectType::defstruct},
    {"VAR", ObjectType::var},         {"ARRAY", ObjectType::array},
    {"RECORD", ObjectType::record},
};

/// Returns the word of the row whose member equals `key`; "?" without one.
template <class Rows, class Key, class Member>
std::string_view word_of(const Rows& rows, Key key, Member member) {
    const auto* const row = find_row(rows, key, member);
    if (row == nullptr) return "?";
    return row->word;
}

}  // namespace

std::string_view name_of(ObjectType type) {
    return word_of(object_types, type, &TypeWord::type);
}

std::string_view name_of(Access access) {
    return word_of(access_words, access, &AccessWord::access);
}

ObjectType EntryReader::object_type(IniSection& section, const std::string& what, bool& given) {
    IniKey* const key = keys_.read(section, "ObjectType");
    given = key != nullptr;
    if (key == nullptr) return ObjectType::var;
    if (key->value.empty()) {
        given = false;
        keys_.report(Severity::warning, Topic::missing, key->value_at,
                     "'ObjectType' of " + what + " is empty", "read as 0x7 (VAR)");
        return ObjectType::var;
    }
    for (const TypeWord& row : object_types) {
        if (same_word(row.word, key->value)) {
            keys_.report(Severity::warning, Topic::object, key->value_at,
                         "'ObjectType' of " + what + " is a name, not a number",
                         "write " + hex(static_cast<unsigned>(row.type), 1));
            return row.type;
        }
    }
    const auto number = keys_.parse(section, *key, 0xFF);
    for (const TypeWord& row : object_types) {
        if (number && static_cast<unsigned>(row.type) == *number) return row.type;
    }
    if (number) {
        keys_.report(
            Severity::warning, Topic::object, key->value_at, "unknown object type " + key->value,
            "0x2 DOMAIN, 0x5 DEFTYPE, 0x6 DEFSTRUCT, 0x7 VAR, 0x8 ARRAY, 0x9 RECORD; read as VAR");
    }
    given = false;
    return ObjectType::var;
}

std::uint16_t EntryReader::data_type_of(IniSection& section, const std::string& what, bool needed) {
    IniKey* const key = keys_.read_value(
        section, "DataType", what,
        needed ? "without it the object is read and written as raw bytes; write DataType=0x0007 "
                 "for UNSIGNED32"
               : nullptr);
    if (key == nullptr) return 0;
    if (const DataType* named = data_type(std::string_view(key->value)); named != nullptr) {
        keys_.report(Severity::warning, Topic::object, key->value_at,
                     "'DataType' of " + what + " is a name, not a number",
                     "write " + hex(named->code));
        return named->code;
    }
    const auto number = keys_.parse(section, *key, 0xFFFF);
    if (!number) return 0;
    const auto code = static_cast<std::uint16_t>(*number);
    if (data_type(code) == nullptr && (code < 0x20 || code > 0x25F)) {
        keys_.report(Severity::warning, Topic::object, key->value_at,
                     "unknown data type " + hex(code),
                     "the basic types are 0x0001..0x001B; 0x0005 is UNSIGNED8");
    }
    return code;
}

Access EntryReader::access_of(IniSection& section, const std::string& what, bool needed) {
    IniKey* const key = keys_.read_value(
        section, "AccessType", what,
        needed ? "read as rw; the access types are ro, wo, rw, rwr, rww, const" : nullptr);
    if (key == nullptr) return Access::rw;
    for (const AccessWord& row : access_words) {
        if (!same_word(row.word, key->value)) continue;
        if (!row.proper) {
            keys_.report(Severity::warning, Topic::object, key->value_at,
                         "unknown access type '" + key->value + "'",
                         "read as " + std::string(name_of(row.access)));
        }
        return row.access;
    }
    keys_.report(Severity::warning, Topic::object, key->value_at,
                 "unknown access type '" + key->value.substr(0, 40) + "'",
                 "read as rw; the access types are ro, wo, rw, rwr, rww, const");
    return Access::rw;
}

std::optional<ValueRemark> remark_on_value(const std::string& it, const std::string& text,
                                           std::uint16_t type) {
    const DataType* known = data_type(type);
    if (known == nullptr) return {};
    const Encoded encoded = encode(text, type, 1);
    if (!encoded) {
        const bool bare_hex = known->kind < Kind::text && !parse_number(text) && text.size() <= 8 &&
                              text.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
        return ValueRemark{Severity::warning, it + ": " + encoded.error,
                           bare_hex ? "write 0x" + text : "the value was ignored"};
    }
    const std::string read_as = spell(encoded.bytes, type);
    switch (encoded.spelling) {
    case Spelling::octal:
        return ValueRemark{Severity::warning,
                           it + " begins with 0 and is read as octal: " + read_as,
                           "remove the 0 if it is decimal, write 0x if it is hexadecimal"};
    case Spelling::decimal_with_zero:
        return ValueRemark{Severity::warning,
                           it + " begins with 0 but is not octal; read as decimal", "remove the 0"};
    case Spelling::unsigned_for_negative:
        if (known->kind == Kind::integer) {
            return ValueRemark{Severity::note,
                               it + " is the bit pattern of a negative number: " + read_as,
                               "write " + read_as};
        }
        return ValueRemark{Severity::warning,
                           it + " is negative, but its type is " + std::string(known->name) +
                               "; read as " + read_as,
                           "write " + read_as};
    case Spelling::number_as_real:
        return ValueRemark{Severity::warning, it + " is written as a fraction", "write " + read_as};
    case Spelling::real_as_bits:
        return ValueRemark{Severity::warning, it + " is read as the bit pattern of " + read_as,
                           "other tools read it as a number; write " + read_as};
    case Spelling::words:
        return ValueRemark{Severity::warning, it + " is a word, not a number", "write " + read_as};
    case Spelling::plain: break;
    }
    return {};
}

void EntryReader::value(IniSection& section, const char* name, std::string& out, std::uint16_t type,
                        const std::string& what) {
    IniKey* key = section.find(name);
    if (key == nullptr) return;
    key->used = true;
    const DataType* known = data_type(type);
    const bool number = known != nullptr && known->kind < Kind::text;
    if (number) {
        keys_.cut_comment(*key);
    }
    out = key->value;
    if (out.empty() || known == nullptr || known->kind == Kind::structure ||
        known->kind == Kind::domain) {
        return;
    }
    const auto remark = remark_on_value("'" + key->name + "' of " + what, out, type);
    if (!remark) return;
    keys_.report(remark->severity, Topic::value, key->value_at, remark->sentence, remark->help);
}

void EntryReader::read_name(IniSection& section, const std::string& what, Entry& out) {
    constexpr std::size_t max_name = 241;
    const IniKey* key = section.find("ParameterName");
    out.name = keys_.text(section, "ParameterName");
    if (out.name.empty()) {
        keys_.report(Severity::warning, Topic::missing, section.at,
                     "'ParameterName' of " + what + " is " + (key != nullptr ? "empty" : "missing"),
                     "give the object a name");
    }
    if (out.name.size() > max_name) {
        keys_.report(
            Severity::note, Topic::value, key->value_at,
            "the name of " + what + " has " + std::to_string(out.name.size()) + " characters",
            "the limit is 241");
    }
}

void EntryReader::read_types(IniSection& section, const std::string& what, bool is_sub,
                             Entry& out) {
    bool given = false;
    out.type = object_type(section, what, given);
    const bool has_sub_indices = out.type == ObjectType::array || out.type == ObjectType::record ||
                                 out.type == ObjectType::defstruct;
    if (is_sub && has_sub_indices) {
        keys_.report(
            Severity::warning, Topic::object, section.find("ObjectType")->value_at,
            what + " is a sub-index and cannot be of type " + std::string(name_of(out.type)),
            "read as VAR; write ObjectType=0x7");
        out.type = ObjectType::var;
    }
    const bool is_value = out.type == ObjectType::var;
    out.data_type = data_type_of(section, what, is_value);
    if (out.data_type == 0 && out.type == ObjectType::domain) {
        out.data_type = 0x0F;
    }
    const DataType* type = data_type(out.data_type);
    if (is_value && type != nullptr && type->kind == Kind::structure) {
        keys_.report(Severity::warning, Topic::object, section.find("DataType")->value_at,
                     "data type " + hex(out.data_type) + " of " + what +
                         " is a record, but a single value is required",
                     "");
    }
    out.access = access_of(section, what, is_value);
}

/// Reports an empty range, or values outside of it.
void EntryReader::check_range(IniSection& section, const std::string& what, const Entry& entry) {
    const auto low = comparable(entry.low_limit, entry.data_type, 1);
    const auto high = comparable(entry.high_limit, entry.data_type, 1);
    if (low && high && *low > *high) {
        keys_.report(Severity::warning, Topic::value, section.find("LowLimit")->value_at,
                     "empty range of " + what + ": " + entry.low_limit + ".." + entry.high_limit,
                     "are LowLimit and HighLimit exchanged?");
        return;
    }
    const auto check = [&](const char* key, const std::string& text) {
        const auto number = comparable(text, entry.data_type, 1);
        const bool outside = number && ((low && *number < *low) || (high && *number > *high));
        if (!outside) return;
        keys_.report(Severity::warning, Topic::value, section.find(key)->value_at,
                     "'" + std::string(key) + "' of " + what + " is out of range: " + text,
                     "the range is " + (low ? entry.low_limit : "any") + ".." +
                         (high ? entry.high_limit : "any"));
    };
    check("DefaultValue", entry.default_value);
    check("ParameterValue", entry.parameter_value);
}

Entry EntryReader::read(IniSection& section, const std::string& what, bool is_sub) {
    Entry out;
    section.used = true;
    out.at = section.at;
    read_name(section, what, out);
    read_types(section, what, is_sub, out);
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
        out.extras = keys_.rest(section, entry_keys);
    }
    check_range(section, what, out);
    return out;
}

}  // namespace hal::canopen::eds
