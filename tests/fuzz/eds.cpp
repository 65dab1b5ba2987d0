// SPDX-License-Identifier: MIT
// Device descriptions, EDS, DCF and XML, and concise DCFs: read, written, read again.
#include <algorithm>
#include <cstdint>
#include <string_view>

#include "components/canopen/eds/concise_dcf.hpp"
#include "components/canopen/eds/xdd.hpp"
#include "tests/fuzz/driver/require.hpp"

using hal::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace hal::canopen::eds;
    if (const auto writes = parse_concise({data, size})) {
        const auto bytes = concise(*writes);
        require(bytes.size() == size && std::equal(bytes.begin(), bytes.end(), data),
                "a concise DCF is what it is made of");
    }
    const ReadResult reading = read_description({reinterpret_cast<const char*>(data), size});
    for (const Message& message : reading.messages) {
        require(message.at.offset + std::size_t{message.at.length} <= reading.text.size(),
                "a place lies in the text");
        require(!message.sentence.empty(), "a message is not empty");
    }
    if (!reading.description) {
        require(reading.count(Severity::error) > 0, "a rejection has a reason");
        return 0;
    }
    for (const Object& object : reading.description->objects) {
        for (const Entry& entry : object.entries) {
            value_of(entry, 127);
            comparable(entry.default_value, entry.data_type, 127);
        }
    }
    const Configuration configuration = configuration_of(*reading.description, 127);
    require(parse_concise(concise(configuration.writes)) == configuration.writes,
            "writes survive the way into bytes and back");
    const std::string once = write_eds(*reading.description);
    const ReadResult again = read_eds(once);
    require(again.description.has_value(), "what was written is read");
    // Texts out of XML may have line breaks and blanks that a line cannot keep; after one round
    // nothing changes any more.
    const std::string twice = write_eds(*again.description);
    const ReadResult third = read_eds(twice);
    require(third.description && *third.description == *again.description,
            "reading and writing change nothing");
    DeviceDescription joined = *reading.description;
    std::vector<Message> messages;
    connect_modules(joined, messages);
    return 0;
}
