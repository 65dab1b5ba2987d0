// SPDX-License-Identifier: MIT
// Tables of values and their texts: of an enumeration, of codes of a standard.
#pragma once

#include <cstddef>

namespace hal {

template <class Key>
struct TextRow {
    Key key;
    const char* text;
};

/// Returns the text of a value; `otherwise` for one that is not in the table. [any]
template <class Key, std::size_t size>
constexpr const char* find_text(const TextRow<Key> (&rows)[size], Key key,
                                const char* otherwise) noexcept {
    for (const TextRow<Key>& row : rows) {
        if (row.key == key) return row.text;
    }
    return otherwise;
}

}  // namespace hal
