// SPDX-License-Identifier: MIT
// Recordings (MCAP): whatever the file is, what is read stays within it.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string_view>

#include "recording/mcap/reader.hpp"
#include "recording/mcap/rows.hpp"

using namespace hal::mcap;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Reader reader;
    if (!reader.open(open_bytes({reinterpret_cast<const char*>(data), size}))) return 0;
    reader.metadata("halcyon");
    std::map<std::uint16_t, RowReader> rows;
    for (const auto& [id, channel] : reader.channels()) {
        const auto schema = reader.schemas().find(channel.schema);
        RowReader row;
        if (schema != reader.schemas().end() && row.open(schema->second, channel)) {
            rows.emplace(id, row);
        }
    }
    std::vector<std::uint64_t> values;
    std::size_t messages = 0;
    reader.each([&](const Message& message) {
        const auto row = rows.find(message.channel);
        if (row != rows.end() && row->second.read(message.payload, values) &&
            values.size() != row->second.columns().size()) {
            std::fprintf(stderr, "broken: a row of %zu values for %zu columns\n", values.size(),
                         row->second.columns().size());
            std::abort();
        }
        return ++messages < 100'000;
    });
    return 0;
}
