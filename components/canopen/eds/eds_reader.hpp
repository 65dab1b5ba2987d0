// SPDX-License-Identifier: MIT
// Shared by the parts of the EDS reader; internal.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "eds.hpp"

namespace hal::canopen::eds {

std::string hex(std::uint64_t value, int digits = 4);   ///< "0x1018"
std::string label(std::uint16_t index);                 ///< "1018"
std::string label(std::uint16_t index, unsigned sub);   ///< "1018sub1"

/// The meaning of a section name.
struct SectionName {
    enum class What : std::uint8_t { other, object, sub, names, values, denotations, links };
    What what = What::other;
    std::uint16_t index = 0;
    unsigned sub = 0;
    bool odd = false;  ///< recognized, but not spelled as in CiA 306
};
SectionName section_name(std::string_view name);

/// Reads keys and reports invalid ones.
class Keys {
public:
    explicit Keys(std::vector<Message>& messages) : messages_(messages) {}

    void report(Severity severity, Topic topic, Span at, std::string sentence,
                std::string help = "") {
        messages_.push_back({severity, topic, at, std::move(sentence), std::move(help)});
    }
    /// Returns a key that is being read, without a trailing comment; nullptr if it is missing.
    IniKey* read(IniSection& section, std::string_view key);
    /// Returns a key that is being read and has a value; nullptr if it has none. Reports that of
    /// the key of `what` unless `consequence` is nullptr.
    IniKey* read_value(IniSection& section, std::string_view key, const std::string& what,
                       const char* consequence);
    /// Returns the value as written; empty if the key is missing.
    std::string text(IniSection& section, std::string_view key);
    /// Returns the value without a trailing comment.
    std::string bare(IniSection& section, std::string_view key);
    /// Returns nothing if the key is missing, empty or not a number in 0..`max`; reports an
    /// invalid number.
    std::optional<std::uint64_t> number(IniSection& section, std::string_view key,
                                        std::uint64_t max);
    bool flag(IniSection& section, std::string_view key, bool otherwise = false);
    /// Returns the keys 1=, 2=, … of a list whose length is in `count_key`; without one the length
    /// is not checked.
    std::map<unsigned, IniKey*> list(IniSection& section, const char* count_key);
    std::optional<std::uint64_t> parse(IniSection& section, IniKey& key, std::uint64_t max);
    /// Returns what was not read: comment lines and unknown keys. Warns of a key that is close to
    /// one of `known`.
    Extras rest(IniSection& section, std::initializer_list<std::string_view> known = {});
    /// Cuts " ; comment" or " # comment" off the key's value.
    void cut_comment(IniKey& key);

private:
    std::vector<Message>& messages_;
};

/// What a reader of any format reports about a value.
struct ValueRemark {
    Severity severity;
    std::string sentence;
    std::string help;
};
/// Returns what is invalid or doubtful about the value `text` of the data type `type`. `it` names
/// the value: "'DefaultValue' of 6207:1".
std::optional<ValueRemark> remark_on_value(const std::string& it, const std::string& text,
                                           std::uint16_t type);

/// The keys of an object section.
extern const std::initializer_list<std::string_view> entry_keys;

/// The section of a value: a VAR or a sub-index. `what` names it in messages.
class EntryReader {
public:
    explicit EntryReader(Keys& keys) : keys_(keys) {}

    Entry read(IniSection& section, const std::string& what, bool is_sub);
    /// `given` is set to whether the section has a valid type.
    ObjectType object_type(IniSection& section, const std::string& what, bool& given);
    /// Returns 0 if the section has no valid type; `needed`: that is reported.
    std::uint16_t data_type_of(IniSection& section, const std::string& what, bool needed);

private:
    void read_name(IniSection& section, const std::string& what, Entry& out);
    void read_types(IniSection& section, const std::string& what, bool is_sub, Entry& out);
    Access access_of(IniSection& section, const std::string& what, bool needed);
    void value(IniSection& section, const char* key, std::string& out, std::uint16_t type,
               const std::string& what);
    void check_range(IniSection& section, const std::string& what, const Entry& entry);

    Keys& keys_;
};

/// Objects of the main part or of a module, in its section-name prefix.
class ObjectReader {
public:
    ObjectReader(Ini& ini, Keys& keys, std::string prefix)
        : ini_(ini), keys_(keys), entries_(keys), prefix_(std::move(prefix)) {}

    /// Reads all objects whose sections begin with the prefix.
    std::vector<Object> read();

private:
    /// The sections of one object.
    struct Draft {
        IniSection* object = nullptr;
        IniSection* names = nullptr;
        IniSection* values = nullptr;
        IniSection* denotations = nullptr;
        IniSection* links = nullptr;
        std::map<unsigned, IniSection*> subs = {};
        IniSection*& slot(const SectionName& means);
    };
    void sort(IniSection& section, std::map<std::uint16_t, Draft>& drafts);
    void report_lists_alone(std::uint16_t index, const Draft& draft);
    Object object(std::uint16_t index, Draft& draft);
    void head(Object& out, IniSection& section, bool has_subs);
    void single(Object& out, IniSection& section);
    void structure(Object& out, IniSection& section);
    void add_subs(Object& out, Draft& draft);
    void finish(Object& out, IniSection& section);
    void add_links(Object& out, IniSection* links);
    void expand(Object& out, IniSection& section, unsigned count);
    void spread(Object& out, IniSection* list, std::string Entry::* field, const char* what);
    void check_entries(const Object& out, IniSection& section);

    Ini& ini_;
    Keys& keys_;
    EntryReader entries_;
    std::string prefix_;
};

/// Reads a section of comment lines; moves its other keys to `others`.
void read_comments(Keys& keys, IniSection* section, std::vector<std::string>& out,
                   std::vector<OtherSection>& others);
void read_modules(Ini& ini, Keys& keys, DeviceDescription& out);
/// Adds the PDOs that CompactPDO describes.
void add_compact_pdos(DeviceDescription& out);

/// Returns whether CompactSubObj can describe the object: entries 1..n differ only in names and DCF
/// values, and sub-index 0 is standard.
bool compactable(const Object& object);

}  // namespace hal::canopen::eds
