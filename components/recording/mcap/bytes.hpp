// SPDX-License-Identifier: MIT
// Fields of records: little-endian integers, texts and blobs with their length before them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

namespace hal::mcap {

template <class T>
void put(std::string& to, T value) {
    static_assert(std::is_unsigned_v<T>);
    for (std::size_t i = 0; i < sizeof(T); ++i) {
        to += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i));
    }
}

inline void put_text(std::string& to, std::string_view text) {
    put(to, static_cast<std::uint32_t>(text.size()));
    to += text;
}

/// Appends a record: its opcode, its length, its content.
inline void put_record(std::string& to, std::uint8_t opcode, std::string_view content) {
    to += static_cast<char>(opcode);
    put(to, std::uint64_t{content.size()});
    to += content;
}

/// Reads fields one after the other. After the end all of them are 0 or empty, and good() is false.
class Fields {
public:
    explicit Fields(std::string_view bytes) : bytes_(bytes) {}

    template <class T>
    T get() {
        static_assert(std::is_unsigned_v<T>);
        const std::string_view part = take(sizeof(T));
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < part.size(); ++i) {
            value |= std::uint64_t{static_cast<unsigned char>(part[i])} << (8 * i);
        }
        return static_cast<T>(value);
    }
    std::string_view text() { return take(get<std::uint32_t>()); }
    std::string_view blob() { return take(get<std::uint64_t>()); }
    std::string_view rest() { return take(bytes_.size()); }
    /// Returns the next bytes, or none when there are fewer.
    std::string_view take(std::uint64_t count) {
        if (count > bytes_.size()) {
            good_ = false;
            bytes_ = {};
            return {};
        }
        const std::string_view part = bytes_.substr(0, static_cast<std::size_t>(count));
        bytes_.remove_prefix(part.size());
        return part;
    }
    bool good() const { return good_; }
    bool more() const { return good_ && !bytes_.empty(); }
    std::size_t left() const { return bytes_.size(); }

private:
    std::string_view bytes_;
    bool good_ = true;
};

}  // namespace hal::mcap
