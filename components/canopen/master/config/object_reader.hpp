// SPDX-License-Identifier: MIT
// Objects as lines of a node name them: by the name in the description, or by address. [setup]
#pragma once

#include "config_lines.hpp"
#include "object_catalog.hpp"

namespace hal::canopen::config {

/// An object that a word names.
struct NamedObject {
    std::optional<ObjectAddress> address;  ///< none: the word is a name
    const Known* known = nullptr;          ///< nullptr: not in the description
};

/// Returns the object of a PDO for one of the description.
Object mapped_object(const Known& known, unsigned bits);

/// Resolves the words that name objects of one node.
class ObjectReader {
public:
    /// `undescribed`: the description is invalid, which was reported; unknown objects follow from it
    /// and are not reported.
    ObjectReader(const Catalog& catalog, bool undescribed, Report& report)
        : catalog_(catalog), undescribed_(undescribed), report_(report) {}

    /// Finds an object by its name, or else by its address. Warns about a form of an earlier
    /// version.
    NamedObject find(const Word& word) const;

    /// Reads an object of a PDO: NAME, INDEX:SUB, INDEX:SUB TYPE, or in an RPDO `gap BITS`. Returns
    /// false after reporting an error.
    bool read(const Word& word, bool to_node, Object& out) const;

private:
    bool reject(const Word& word, std::string sentence, std::string help) const;
    bool read_gap(const Word& word, const std::vector<Word>& words, bool to_node,
                  Object& out) const;
    bool read_unknown(const Word& word, const Word& name, const NamedObject& object,
                      std::optional<Type> type, bool to_node, Object& out) const;
    bool read_known(const Word& word, const Known& known, std::optional<Type> type, bool to_node,
                    Object& out) const;

    const Catalog& catalog_;
    bool undescribed_;
    Report& report_;
};

}  // namespace hal::canopen::config
