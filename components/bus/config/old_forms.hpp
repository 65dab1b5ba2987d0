// SPDX-License-Identifier: MIT
// Warnings about forms of earlier versions, which this version still reads. Each names the form to
// write. Everything here is [setup].
#pragma once

#include <string>

#include "bus/config/object_address.hpp"
#include "bus/config/value_types.hpp"
#include "text/config_text.hpp"
#include "text/quoting.hpp"

namespace hal::bus {

/// Warns about the old name of a type.
template <class Topic>
void warn_old_type(text::Messages<Topic>& report, Topic topic, const text::Word& word,
                   const TypeName& type) {
    if (!type.is_old) return;
    report.warning(topic, word.at,
                   hal::quoted(word.text) + " is the old name of the type " + type.name +
                       "; later versions reject it",
                   std::string("write ") + type.name);
}

/// Warns about a sub-index of hexadecimal digits without 0x.
template <class Topic>
void warn_bare_hex(text::Messages<Topic>& report, Topic topic, const text::Word& word,
                   const ObjectAddress& address) {
    if (address.form != SubForm::bare_hex) return;
    report.warning(topic, word.at,
                   "the sub-index of " + hal::quoted(word.text) +
                       " is hexadecimal without 0x; later versions reject it",
                   "write " + object_text(address.index, address.sub) + ", or " +
                       index_text(address.index) + ":" + hex_text(address.sub));
}

/// Warns about a sub-index that earlier versions read as hexadecimal, which no EtherCAT file may
/// change silently.
template <class Topic>
void warn_two_digits(text::Messages<Topic>& report, Topic topic, const text::Word& word,
                     const ObjectAddress& address) {
    if (address.form != SubForm::two_digits) return;
    const unsigned before = address.sub / 10 * 16 + address.sub % 10;
    const std::string index = index_text(address.index);
    report.warning(topic, word.at,
                   "the sub-index of " + hal::quoted(word.text) +
                       " is decimal; earlier versions read it as hexadecimal",
                   "write " + index + ":" + hex_text(address.sub) + " for sub-index " +
                       std::to_string(address.sub) + ", or " + index + ":" + hex_text(before) +
                       " for sub-index " + std::to_string(before));
}

}  // namespace hal::bus
