// SPDX-License-Identifier: MIT
#include "dds/schema.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "hal/pin_type.hpp"
#include "hal/rejection.hpp"

namespace hal::dds {
namespace {

static_assert(std::endian::native == std::endian::little, "values are stored in native byte order");

constexpr std::size_t header = 4;
constexpr std::size_t max_fields = 1024;
constexpr std::size_t max_bytes = 60'000;

struct TypeName {
    std::string_view name;
    hal_type type;
    char letter;  // in Schema::layout
    std::uint32_t size;
};
constexpr std::array types{
    TypeName{"bit", HAL_TYPE_BIT, 'b', 1}, TypeName{"float", HAL_TYPE_FLOAT, 'f', 8},
    TypeName{"s32", HAL_TYPE_S32, 'i', 4}, TypeName{"u32", HAL_TYPE_U32, 'u', 4},
    TypeName{"s64", HAL_TYPE_S64, 'l', 8}, TypeName{"u64", HAL_TYPE_U64, 'k', 8},
};

const TypeName& row(hal_type type) {
    return *std::find_if(types.begin(), types.end(),
                         [type](const TypeName& t) { return t.type == type; });
}

/// Appends to a sample.
class Writer {
public:
    explicit Writer(std::vector<std::uint8_t>& to) : to_(to) { to_ = {0, 1, 0, 0}; }
    std::uint32_t zeros(std::uint32_t size) {
        while ((to_.size() - header) % size != 0) {
            to_.push_back(0);
        }
        to_.insert(to_.end(), size, 0);
        return static_cast<std::uint32_t>(to_.size() - size);
    }
    void number(std::uint32_t value) {
        const std::uint32_t at = zeros(4);
        std::memcpy(to_.data() + at, &value, sizeof value);
    }
    void text(std::string_view value) {
        number(static_cast<std::uint32_t>(value.size() + 1));
        to_.insert(to_.end(), value.begin(), value.end());
        to_.push_back(0);
    }

private:
    std::vector<std::uint8_t>& to_;
};

[[noreturn]] void reject(const std::string& argument, const std::string& why) {
    throw ArgumentError(argument, why);
}

hal_value value_of(std::string_view text, hal_type type, const std::string& whole) {
    hal_value value{};
    const char *first = text.data(), *last = first + text.size();
    std::from_chars_result got{first, std::errc{}};
    visit_type(type, [&]<class T>(std::type_identity<T>) {
        T parsed{};
        if constexpr (std::is_same_v<T, bool>) {
            parsed = text == "1" || text == "true" || text == "TRUE";
            const bool valid = parsed || text == "0" || text == "false" || text == "FALSE";
            got = {last, valid ? std::errc{} : std::errc::invalid_argument};
        } else {
            got = std::from_chars(first, last, parsed);
        }
        value = to_value(parsed);
    });
    if (got.ec != std::errc{} || got.ptr != last || text.empty()) {
        reject("fields", "fields: '" + whole + "': '" + std::string(text) + "' is not a " +
                             std::string(row(type).name));
    }
    return value;
}

void name_ok(std::string_view name, const std::string& whole,
             const std::string& argument = "fields") {
    const auto good = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '-' || c == '_' || c == '.';
    };
    if (name.empty() || !std::all_of(name.begin(), name.end(), good)) {
        reject(argument, argument + ": '" + whole + "': '" + std::string(name) +
                             "' is not a valid pin name; use letters, digits, - _ and .");
    }
}

/// "NAME:TYPE[*N][=SAFE]" to one or N fields.
void parse(const std::string& whole, std::vector<Field>& to) {
    const auto colon = whole.find(':');
    if (colon == std::string::npos) {
        reject("fields",
               "fields: '" + whole + "' has no type; write NAME:TYPE, as in angle:float,ready:bit");
    }
    std::string_view name = std::string_view(whole).substr(0, colon),
                     rest = std::string_view(whole).substr(colon + 1), safe;
    bool has_safe = false;
    if (const auto at = rest.find('='); at != std::string_view::npos) {
        safe = rest.substr(at + 1);
        rest = rest.substr(0, at);
        has_safe = true;
    }
    std::size_t count = 1;
    bool is_row = false;
    if (const auto at = rest.find('*'); at != std::string_view::npos) {
        const std::string_view digits = rest.substr(at + 1);
        const auto got = std::from_chars(digits.data(), digits.data() + digits.size(), count);
        if (got.ec != std::errc{} || got.ptr != digits.data() + digits.size() || count == 0 ||
            count > max_fields) {
            reject("fields", "fields: '" + whole + "': invalid count after *; write 1.." +
                                 std::to_string(max_fields));
        }
        rest = rest.substr(0, at);
        is_row = true;
    }
    const auto type = std::find_if(types.begin(), types.end(),
                                   [rest](const TypeName& t) { return t.name == rest; });
    if (type == types.end()) {
        reject("fields", "fields: '" + whole + "': unknown type '" + std::string(rest) +
                             "'; types are bit, float, s32, u32, s64, u64");
    }
    for (std::size_t i = 0; i < count; ++i) {
        std::string own(name);
        if (is_row) {
            own += "-" + std::to_string(i);
        }
        name_ok(own, whole);
        if (std::any_of(to.begin(), to.end(), [&own](const Field& f) { return f.name == own; })) {
            reject("fields", "fields: duplicate field '" + own + "'");
        }
        Field field{std::move(own), type->type, {}};
        if (has_safe) {
            field.safe = value_of(safe, type->type, whole);
        }
        to.push_back(std::move(field));
    }
    if (to.size() > max_fields) {
        reject("fields", "fields: more than " + std::to_string(max_fields) +
                             " fields; split them into two topics");
    }
}

void place(Schema& schema, Writer& writer, std::string name, hal_type type) {
    schema.places.push_back({writer.zeros(row(type).size), type});
    schema.layout += row(type).letter;
    schema.fields.push_back({std::move(name), type, {}});
}

/// std_msgs/Header: time, frame.
void ros_header(Schema& schema, Writer& writer, std::string_view frame) {
    schema.stamp = writer.zeros(4);
    writer.zeros(4);
    writer.text(frame);
    schema.layout += "UUs";
}

void joint_state(Schema& schema, Writer& writer, const std::vector<std::string>& names) {
    if (names.empty()) {
        reject("ros",
               "ros=sensor_msgs/JointState: missing joint names; write joints=shoulder,elbow");
    }
    if (names.size() > 256) {
        reject("joints", "joints: more than 256 joints; split them into two topics");
    }
    writer.number(static_cast<std::uint32_t>(names.size()));
    for (const std::string& n : names) {
        name_ok(n, n, "joints");
        if (std::count(names.begin(), names.end(), n) > 1) {
            reject("joints", "joints: duplicate joint '" + n + "'");
        }
        writer.text(n);
    }
    for (const char* what : {"-position", "-velocity", "-effort"}) {
        writer.number(static_cast<std::uint32_t>(names.size()));
        for (const std::string& n : names) {
            schema.places.push_back({writer.zeros(8), HAL_TYPE_FLOAT});
            schema.fields.push_back({n + what, HAL_TYPE_FLOAT, {}});
        }
    }
    schema.names = names;
    schema.layout += 'j';
}

/// Walks a sample; every length is checked against what is there.
class Walk {
public:
    explicit Walk(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
        if (bytes.size() < header || bytes[0] != 0) return;
        // CDR_BE, CDR_LE; and of XCDR2, where nothing is aligned to more than 4, PLAIN_CDR2_BE,
        // PLAIN_CDR2_LE
        good_ = bytes[1] <= 1 || bytes[1] == 6 || bytes[1] == 7;
        swapped_ = (bytes[1] & 1) == 0;
        max_ = bytes[1] >= 6 ? 4 : 8;
    }
    template <class T>
    T get() noexcept {
        align(sizeof(T));
        T value{};
        if (!has(sizeof(T))) return value;
        std::uint8_t raw[sizeof(T)];
        std::memcpy(raw, bytes_.data() + at_, sizeof(T));
        if (swapped_) {
            std::reverse(raw, raw + sizeof(T));
        }
        std::memcpy(&value, raw, sizeof(T));
        at_ += sizeof(T);
        return value;
    }
    /// Returns the string without its terminating 0; empty if the 0 is missing.
    std::string_view text() noexcept {
        const auto size = get<std::uint32_t>();
        if (!has(size)) {
            return {};
        }
        const std::string_view all(reinterpret_cast<const char*>(bytes_.data()) + at_, size);
        at_ += size;
        return size == 0 ? all : all.substr(0, size - 1);
    }
    void skip(std::size_t size) noexcept {
        if (has(size)) {
            at_ += size;
        }
    }
    bool has(std::size_t size) noexcept { return good_ = good_ && size <= bytes_.size() - at_; }
    bool good() const noexcept { return good_; }
    /// Nothing but padding follows.
    bool at_end() const noexcept { return good_ && bytes_.size() - at_ < 4; }

private:
    void align(std::size_t size) noexcept {
        const std::size_t to = std::min(size, max_);
        const std::size_t over = (at_ - header) % to;
        if (over != 0) {
            skip(to - over);
        }
    }
    std::span<const std::uint8_t> bytes_;
    std::size_t at_ = header;
    std::size_t max_ = 8;
    bool good_ = false;
    bool swapped_ = false;
};

/// Matches joints by name, in any order; a missing one keeps its value.
void walk_joints(const Schema& schema, Walk& walk, hal_value* to,
                 std::span<bool> has_joint) noexcept {
    const auto ours = schema.names.size();
    const auto count = walk.get<std::uint32_t>();
    if (!walk.has(std::size_t{count} * 4)) return;
    std::array<std::uint16_t, 1024> which;
    if (count > which.size()) {
        walk.has(SIZE_MAX);
        return;
    }
    for (std::uint32_t i = 0; i < count && walk.good(); ++i) {
        const std::string_view name = walk.text();
        const auto at = std::find(schema.names.begin(), schema.names.end(), name);
        which[i] = static_cast<std::uint16_t>(at - schema.names.begin());
    }
    for (std::size_t part = 0; part < 3; ++part) {
        const auto values = walk.get<std::uint32_t>();
        if (values != 0 && values != count) {
            walk.has(SIZE_MAX);
            return;
        }
        for (std::uint32_t i = 0; i < values && walk.good(); ++i) {
            const auto value = walk.get<double>();
            if (to == nullptr || which[i] >= ours) continue;
            to[part * ours + which[i]].real = value;
            if (!has_joint.empty()) {
                has_joint[which[i]] = true;
            }
        }
    }
}

/// `to` may be nullptr: then it only looks whether all is well.
bool walk_all(const Schema& schema, std::span<const std::uint8_t> bytes, hal_value* to,
              std::span<bool> has_joint = {}) noexcept {
    Walk walk(bytes);
    hal_value ignored;
    std::size_t next = 0;
    const auto place = [&]() -> hal_value& {
        hal_value& value = to != nullptr ? to[next] : ignored;
        ++next;
        value.raw = 0;
        return value;
    };
    for (const char c : schema.layout) {
        switch (c) {
        case 'b': place().bit = walk.get<std::uint8_t>() != 0; break;
        case 'f': place().real = walk.get<double>(); break;
        case 'i': place().s32 = walk.get<std::int32_t>(); break;
        case 'u': place().u32 = walk.get<std::uint32_t>(); break;
        case 'l': place().s64 = walk.get<std::int64_t>(); break;
        case 'k': place().u64 = walk.get<std::uint64_t>(); break;
        case 'U': walk.get<std::uint32_t>(); break;
        case 'B': walk.get<std::uint8_t>(); break;
        case 's': walk.text(); break;
        case 'q': walk.skip(walk.get<std::uint32_t>()); break;
        case 'j': walk_joints(schema, walk, to, has_joint); break;
        default: return false;
        }
        if (!walk.good()) return false;
    }
    return walk.at_end();
}

/// Returns geometry_msgs/Twist for geometry_msgs/msg/Twist, the spelling of `ros2 topic list -t`.
std::string without_msg(std::string_view ros) {
    constexpr std::string_view folder = "/msg/";
    std::string name(ros);
    if (const auto at = name.find(folder); at != std::string::npos) {
        name.replace(at, folder.size(), "/");
    }
    return name;
}

}  // namespace

Schema Schema::of_fields(std::string_view text, std::string type) {
    Schema schema;
    std::vector<Field> fields;
    std::string identity;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        parse(std::string(text.substr(at, end - at)), fields);
        at = end + 1;
    }
    Writer writer(schema.sample);
    for (Field& f : fields) {
        identity += f.name + ":" + std::string(row(f.type).name) + ",";
        place(schema, writer, f.name, f.type);
    }
    for (std::size_t i = 0; i < fields.size(); ++i) {
        schema.fields[i].safe = fields[i].safe;
    }
    schema.type = std::move(type);
    if (schema.type.empty()) {
        std::uint64_t hash = 14695981039346656037u;  // FNV-1a, 64 bits (RFC 9923)
        for (const char c : identity) {
            hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211u;
        }
        char digits[17];
        std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
        schema.type = std::string("hal::Pins_") + digits;
    }
    return schema;
}

Schema Schema::of_ros(std::string_view written, const std::vector<std::string>& names,
                      std::string_view frame, std::string_view encoding) {
    const std::string ros = without_msg(written);
    struct Plain {
        std::string_view ros;
        hal_type type;
    };
    static constexpr std::array plain{
        Plain{"std_msgs/Float64", HAL_TYPE_FLOAT}, Plain{"std_msgs/Bool", HAL_TYPE_BIT},
        Plain{"std_msgs/Int32", HAL_TYPE_S32},     Plain{"std_msgs/UInt32", HAL_TYPE_U32},
        Plain{"std_msgs/Int64", HAL_TYPE_S64},     Plain{"std_msgs/UInt64", HAL_TYPE_U64},
    };
    Schema schema;
    schema.ros = ros;
    schema.prefix = "rt/";
    Writer writer(schema.sample);
    const auto six = [&](std::string_view first, std::string_view second) {
        for (const std::string_view part : {first, second}) {
            for (const char* axis : {"-x", "-y", "-z"}) {
                place(schema, writer, std::string(part) + axis, HAL_TYPE_FLOAT);
            }
        }
    };
    if (const auto p = std::find_if(plain.begin(), plain.end(),
                                    [&ros](const Plain& x) { return x.ros == ros; });
        p != plain.end()) {
        place(schema, writer, "data", p->type);
    } else if (ros == "geometry_msgs/Twist") {
        six("linear", "angular");
    } else if (ros == "geometry_msgs/WrenchStamped") {
        ros_header(schema, writer, frame);
        six("force", "torque");
    } else if (ros == "sensor_msgs/JointState") {
        ros_header(schema, writer, frame);
        joint_state(schema, writer, names);
    } else if (ros == "sensor_msgs/Image") {
        ros_header(schema, writer, frame);
        place(schema, writer, "height", HAL_TYPE_U32);
        place(schema, writer, "width", HAL_TYPE_U32);
        writer.text(encoding);
        writer.zeros(1);  // is_bigendian
        schema.layout += "sB";
        place(schema, writer, "step", HAL_TYPE_U32);
        writer.number(0);  // data
        schema.layout += 'q';
    } else {
        reject("ros", "ros=" + std::string(written) +
                          ": unsupported message type; supported are std_msgs/Float64 Bool Int32 "
                          "UInt32 Int64 UInt64, geometry_msgs/Twist " +
                          "WrenchStamped, sensor_msgs/JointState Image; other types that consist "
                          "of plain numbers: fields= and type=");
    }
    if (schema.sample.size() > max_bytes) {
        reject("ros", "ros=" + std::string(written) + ": the message exceeds " +
                          std::to_string(max_bytes) +
                          " bytes; shorten joints=, frame= or encoding=");
    }
    const auto slash = ros.find('/');
    schema.type = ros.substr(0, slash) + "::msg::dds_::" + ros.substr(slash + 1) + "_";
    return schema;
}

bool decode(const Schema& schema, std::span<const std::uint8_t> bytes, std::span<hal_value> values,
            std::span<bool> has_joint) noexcept {
    if (values.size() < schema.fields.size() || !walk_all(schema, bytes, nullptr)) return false;
    return walk_all(schema, bytes, values.data(), has_joint);
}

}  // namespace hal::dds
