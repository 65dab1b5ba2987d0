// SPDX-License-Identifier: MIT
// The messages about a configuration, at their place in the file.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "hal/texts.hpp"
#include "text/config_text.hpp"

namespace hal::bus {

/// Reports the messages about the text of `file`, and ends the constructor when there is an error
/// among them: it throws their texts where the host does not show messages. Notes are not reported;
/// the `check` command of the bus prints them. `code_of(Topic)` is found beside the topics. [setup]
template <class Topic>
void report(const hal::Texts& texts, const std::vector<text::Message<Topic>>& messages,
            const std::string& file, std::string_view text) {
    const bool is_good = text::good(messages);
    if (!texts.offered() && !is_good) {
        throw std::invalid_argument(text::errors_text(messages, file));
    }
    texts.begin(file, text);
    for (const text::Message<Topic>& m : messages) {
        if (m.severity == hal::Severity::note) continue;
        texts.report(static_cast<hal_severity>(m.severity), code_of(m.topic), m.at.offset,
                     m.at.offset + m.at.length, m.sentence, m.label, m.help);
    }
    if (!is_good) {
        hal::Texts::fail();
    }
}

}  // namespace hal::bus
