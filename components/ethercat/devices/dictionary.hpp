// SPDX-License-Identifier: MIT
// The object dictionary of an emulated slave. It is filled in setup; after finish() nothing moves,
// so that firmware may keep pointers.
//
//     Dictionary dictionary;
//     dictionary.variable(0x6041, "Statusword", coe::type::u16, coe::access::read | coe::access::tx_mappable);
//     dictionary.finish();
//     std::uint8_t* statusword = dictionary.at(0x6041, 0);
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/wire/coe.hpp"
#include "ethercat/wire/states.hpp"

namespace hal::ethercat::devices {

struct DictionaryEntry {
    std::uint8_t sub = 0;
    std::uint16_t type = 0;
    std::uint16_t bits = 0;
    std::uint16_t access = 0;
    std::uint32_t offset = 0;  ///< of its data
    std::uint8_t* bound = nullptr;  ///< the value of a device that holds the data instead
    std::string name;
    bool limited = false;
    std::int64_t low = 0;
    std::int64_t high = 0;

    std::size_t bytes() const noexcept { return (bits + 7U) / 8U; }
    bool text() const noexcept {
        return type == coe::type::visible_string || type == coe::type::octet_string;
    }
};

struct DictionaryObject {
    std::uint16_t index = 0;
    std::uint16_t type = 0;
    coe::ObjectCode code{};
    std::string name;
    std::vector<DictionaryEntry> entries;  ///< by sub-index
};

/// Watches writes of the master.
class DictionaryGuard {
public:
    virtual ~DictionaryGuard() = default;
    /// Returns why the value is rejected, or Abort::none to accept it. Called after the checks of
    /// the dictionary. [realtime]
    virtual coe::Abort check(const DictionaryObject&, const DictionaryEntry&,
                             std::span<const std::uint8_t> value) noexcept = 0;
    /// Called after an accepted value was written. [realtime]
    virtual void written(const DictionaryObject&, const DictionaryEntry&) noexcept {}
};

class Dictionary {
public:
    // Setup; all [setup].
    /// Adds an object with one value.
    void variable(std::uint16_t index, std::string name, std::uint16_t type, std::uint16_t access,
                  std::uint64_t initial = 0);
    /// Adds an object whose value is a text of fixed length.
    void text(std::uint16_t index, std::string name, std::string_view initial,
              std::uint16_t access = coe::access::read);
    /// Adds an object whose value is `bytes` long.
    void bytes(std::uint16_t index, std::string name, std::size_t bytes, std::uint16_t access);
    /// Adds an object with sub-indices; sub-index 0 holds `count`.
    void record(std::uint16_t index, std::string name, std::uint8_t count,
                coe::ObjectCode code = coe::ObjectCode::record,
                std::uint16_t sub0_access = coe::access::read, std::uint16_t type = 0);
    /// Adds an entry to the newest record.
    void sub(std::uint8_t sub, std::string name, std::uint16_t type, std::uint16_t access,
             std::uint64_t initial = 0);
    /// Adds an object without entries; entry() adds them.
    void object(std::uint16_t index, std::string name, coe::ObjectCode code, std::uint16_t type);
    /// Adds an entry of any type and length to the newest object; `initial` may be shorter.
    void entry(std::uint8_t sub, std::string name, std::uint16_t type, std::uint16_t bits,
               std::uint16_t access, std::span<const std::uint8_t> initial = {});
    /// Limits the newest entry.
    void limit(std::int64_t low, std::int64_t high);
    /// Sorts the objects. Nothing may be added after it.
    void finish();
    /// Makes `value`, which outlives the dictionary, the data of an entry. After finish(). The
    /// initial value is written to it at power-on. Throws std::logic_error without an entry of this
    /// size.
    template <class T>
    void bind(std::uint16_t index, std::uint8_t sub, T& value) {
        bind(index, sub, reinterpret_cast<std::uint8_t*>(&value), sizeof value);
    }

    // Run time.
    /// Restores the initial values. [realtime]
    void power_on() noexcept;
    const std::vector<DictionaryObject>& objects() const noexcept { return objects_; }
    /// nullptr: missing. [realtime]
    const DictionaryObject* find(std::uint16_t index) const noexcept;
    /// nullptr: missing. [realtime]
    const DictionaryEntry* find(std::uint16_t index, std::uint8_t sub) const noexcept;
    /// [realtime]
    std::uint8_t* data(const DictionaryEntry& e) noexcept {
        return e.bound != nullptr ? e.bound : memory_.data() + e.offset;
    }
    const std::uint8_t* data(const DictionaryEntry& e) const noexcept {
        return e.bound != nullptr ? e.bound : memory_.data() + e.offset;
    }
    /// Returns the data of an entry; nullptr: missing. [realtime]
    std::uint8_t* at(std::uint16_t index, std::uint8_t sub) noexcept;
    /// Returns the value of sub-index 0, a count. [realtime]
    std::uint8_t count(const DictionaryObject& o) const noexcept {
        return *data(o.entries.front());
    }

    /// Reads an entry, or all entries from `sub` on, into `to`; returns why it failed, or
    /// Abort::none with `length`. [realtime]
    coe::Abort read(std::uint16_t index, std::uint8_t sub, bool complete, State state,
                    std::span<std::uint8_t> to, std::size_t& length) const noexcept;
    /// Writes an entry, or all entries from `sub` on; returns why it failed. [realtime]
    coe::Abort write(std::uint16_t index, std::uint8_t sub, bool complete, State state,
                     std::span<const std::uint8_t> from) noexcept;
    /// Returns why a write of `bytes` would fail, before its data is known. [realtime]
    coe::Abort check_write(std::uint16_t index, std::uint8_t sub, bool complete, State state,
                           std::size_t bytes) const noexcept;
    void guard_with(DictionaryGuard* guard) noexcept { guard_ = guard; }  ///< [setup]

private:
    DictionaryEntry& add(DictionaryObject&, std::uint8_t sub, std::string name, std::uint16_t type,
                         std::size_t bits, std::uint16_t access);
    void bind(std::uint16_t index, std::uint8_t sub, std::uint8_t* value, std::size_t bytes);
    coe::Abort write_entry(const DictionaryObject&, const DictionaryEntry&, State,
                           std::span<const std::uint8_t> from) noexcept;
    coe::Abort write_part(const DictionaryObject&, const DictionaryEntry&, State,
                          std::span<const std::uint8_t> from, std::size_t bit) noexcept;
    coe::Abort read_complete(const DictionaryObject&, std::uint8_t sub, State,
                             std::span<std::uint8_t> to, std::size_t& length) const noexcept;
    coe::Abort write_complete(const DictionaryObject&, std::uint8_t sub, State,
                              std::span<const std::uint8_t> from) noexcept;

    std::vector<DictionaryObject> objects_;
    std::vector<std::uint8_t> memory_, initial_;
    DictionaryGuard* guard_ = nullptr;
};

}  // namespace hal::ethercat::devices
