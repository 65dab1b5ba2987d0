// SPDX-License-Identifier: MIT
// What the parts of the EDS reader share; not for others.
#pragma once

#include <cstdint>
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

/// What the name of a section means.
struct SectionName {
    enum class What : std::uint8_t { other, object, sub, names, values, denotations, links };
    What          what = What::other;
    std::uint16_t index = 0;
    unsigned      sub = 0;
    bool          odd = false;  ///< understood, but not spelled as CiA 306 has it
};
SectionName section_name(std::string_view name);

/// Reads keys and says what is wrong with them.
class Keys {
public:
    explicit Keys(std::vector<Message>& messages) : messages_(messages) {}

    void say(Severity severity, Topic topic, Place at, std::string sentence, std::string help = "") {
        messages_.push_back({severity, topic, at, std::move(sentence), std::move(help)});
    }
    /// The value as it is; empty when the key is not there.
    std::string text(IniSection& section, std::string_view key);
    /// The value without a comment behind it.
    std::string bare(IniSection& section, std::string_view key);
    /// None when the key is missing, empty or no number up to `most`; only the last two are said.
    std::optional<std::uint64_t> number(IniSection& section, std::string_view key, std::uint64_t most);
    bool                         flag(IniSection& section, std::string_view key, bool otherwise = false);
    /// Keys 1=, 2=, … of a list whose length is in `count_key`. A null `count_key`: nobody counts.
    std::map<unsigned, IniKey*>  list(IniSection& section, const char* count_key);
    std::optional<std::uint64_t> parse(IniSection& section, IniKey& key, std::uint64_t most);
    /// What nobody has read: comment lines and unknown keys. A key close to one of `known` is said.
    Extras rest(IniSection& section, std::initializer_list<std::string_view> known = {});
    /// Cuts " ; comment" or " # comment" off the key's value.
    void cut_comment(IniKey& key);

private:
    std::vector<Message>& messages_;
};

/// Objects of the main part or of a module, in its section-name prefix.
class ObjectReader {
public:
    ObjectReader(Ini& ini, Keys& keys, std::string prefix) : ini_(ini), keys_(keys), prefix_(std::move(prefix)) {}

    /// All objects whose sections begin with the prefix.
    std::vector<Object> read();
    /// A section as a value: of a VAR or of a sub-index. `what` names it in messages.
    Entry entry(IniSection& section, const std::string& what, bool is_sub);

private:
    struct Draft {
        IniSection *                    object = nullptr, *names = nullptr, *values = nullptr, *denotations = nullptr, *links = nullptr;
        std::map<unsigned, IniSection*> subs = {};
    };
    Object        object(std::uint16_t index, Draft& draft);
    void          expand(Object& out, IniSection& section, unsigned count);
    void          spread(Object& out, IniSection* list, std::string Entry::* field, const char* what);
    void          check_entries(const Object& out, IniSection& section);
    void          value(IniSection& section, const char* key, std::string& out, std::uint16_t type, const std::string& what);
    ObjectType    object_type(IniSection& section, const std::string& what, bool& given);
    std::uint16_t type_of(IniSection& section, const std::string& what, bool needed);
    Access        access_of(IniSection& section, const std::string& what, bool needed);

    Ini&        ini_;
    Keys&       keys_;
    std::string prefix_;
};

/// CompactSubObj can say it: entries 1..n are alike but for name and what a DCF adds, and sub-index 0 is the one everybody expects.
bool compactable(const Object& object);

/// Levenshtein distance up to 2; 3 when it is more.
unsigned distance(std::string_view a, std::string_view b);

}  // namespace hal::canopen::eds
