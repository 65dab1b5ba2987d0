// SPDX-License-Identifier: MIT
#include "journal/journal_begin.hpp"

#include "recording/mcap/bytes.hpp"

namespace hal {

std::string to_cdr(const JournalBegin& begin) {
    std::string content;
    mcap::put(content, begin.entries);
    mcap::put(content, begin.next_entry);
    mcap::put(content, static_cast<std::uint32_t>(begin.batches.size()));
    for (const auto& [thread, sequence] : begin.batches) {
        mcap::put(content, thread);
        mcap::put(content, sequence);
    }
    content += begin.state;
    std::string payload("\0\1\0\0", 4);  // CDR, little-endian
    mcap::put_text(payload, content);
    return payload;
}

std::optional<JournalBegin> journal_begin(std::string_view payload) {
    mcap::Fields message(payload);
    message.take(4);  // the representation
    mcap::Fields fields(message.text());
    JournalBegin begin;
    begin.entries = fields.get<std::uint32_t>();
    begin.next_entry = fields.get<std::uint32_t>();
    for (auto count = fields.get<std::uint32_t>(); count > 0 && fields.good(); --count) {
        const auto thread = fields.get<std::uint32_t>();
        begin.batches[thread] = fields.get<std::uint32_t>();
    }
    begin.state = fields.rest();
    if (!message.good() || !fields.good()) return std::nullopt;
    return begin;
}

}  // namespace hal
