// SPDX-License-Identifier: MIT
// DDS: any sample is decoded within its bytes, or rejected without a change; what was decoded of
// plain fields is encoded the same again. Any list of fields is rejected with a message or yields a
// type whose own sample can be decoded. Whatever comes as the status of an instance is read within
// its bytes, and what is shown of it does not steer a terminal.
#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "components/dds/schema.hpp"
#include "components/dds/status_text.hpp"
#include "tests/fuzz/driver/require.hpp"
#include "tools/inspect/seen_instance.hpp"

namespace {

using namespace hal::dds;
using hal::fuzz::require;

void sample(const Schema& schema, std::span<const std::uint8_t> given) {
    // so that a byte too far is seen
    const std::vector<std::uint8_t> bytes(given.begin(), given.end());
    std::vector<hal_value> values(schema.fields.size());
    for (hal_value& v : values) {
        v.raw = 0x0123456789abcdef;
    }
    if (!decode(schema, bytes, values)) {
        for (const hal_value& v : values) {
            require(v.raw == 0x0123456789abcdef, "a rejected sample changes nothing");
        }
        return;
    }
    if (!schema.ros.empty()) return;
    std::vector<std::uint8_t> again = schema.sample;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const hal_type type = schema.places[i].type;
        const std::size_t size = type == HAL_TYPE_BIT                           ? 1
                                 : type == HAL_TYPE_S32 || type == HAL_TYPE_U32 ? 4
                                                                                : 8;
        std::memcpy(again.data() + schema.places[i].offset, &values[i], size);
    }
    std::vector<hal_value> twice(values.size());
    require(decode(schema, again, twice), "what was decoded can be encoded");
    for (std::size_t i = 0; i < values.size(); ++i) {
        require(std::memcmp(&values[i], &twice[i], sizeof values[i]) == 0, "and is the same");
    }
}

void fields(std::string_view text) {
    try {
        const Schema schema = Schema::of_fields(text);
        std::vector<hal_value> values(schema.fields.size());
        require(schema.fields.size() == schema.places.size(), "a place for each field");
        require(decode(schema, schema.sample, values), "a type's own sample is of the type");
    } catch (const std::invalid_argument& e) {
        require(*e.what() != '\0', "a rejection has a reason");
    }
}

bool plain(std::string_view text) {
    return std::none_of(text.begin(), text.end(),
                        [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
}

void status(std::span<const std::uint8_t> given) {
    const std::vector<std::uint8_t> bytes(given.begin(), given.end());
    const std::string text(status_text(bytes));
    require(status_text(status_bytes(text)) == std::string_view(text).substr(0, max_status_size),
            "what was read can be written");
    std::vector<std::string> layouts{""};
    for (const char* key : {"offers", "wants", "instance"}) {
        for (const std::string& value : values_of(text, key)) {
            require(value.find('\n') == value.npos, "a value is on one line");
            require(plain(shown(value)) && shown(value).size() <= 600,
                    "what is shown is one short line");
            for (const auto& [topic, layout] : topics_of(value)) {
                layouts.push_back(layout);
            }
        }
    }
    for (std::size_t i = 1; i < layouts.size() && i < 20; ++i) {
        require(difference(layouts[i - 1], "a", layouts[i], "b").empty() ==
                    (layouts[i - 1] == layouts[i]),
                "two layouts differ when they do");
    }
    hal::tools::SeenInstance seen;
    if (hal::tools::read_status(text, seen)) {
        require(plain(seen.instance + seen.host + seen.cell + seen.node + seen.fault),
                "hal top shows it");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Schema schemas[] = {
        Schema::of_fields("b:bit,f:float,i:s32,u:u32,l:s64,k:u64*3"),
        Schema::of_ros("std_msgs/Bool"), Schema::of_ros("geometry_msgs/WrenchStamped", {}, "base"),
        Schema::of_ros("sensor_msgs/JointState", {"a", "elbow"}, "base"),
        Schema::of_ros("sensor_msgs/Image", {}, "camera")};
    if (size == 0) return 0;
    if (data[0] < std::size(schemas)) {
        sample(schemas[data[0]], {data + 1, size - 1});
    } else if (data[0] == std::size(schemas)) {
        status({data + 1, size - 1});
    } else {
        fields({reinterpret_cast<const char*>(data), size});
    }
    return 0;
}
