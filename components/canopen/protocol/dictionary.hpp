// SPDX-License-Identifier: MIT
// The object dictionary: typed values that SDO, PDO and the application share. Made once from a Description; afterwards
// nothing is added and no memory is taken. One thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "description.hpp"
#include "numbers.hpp"

namespace hal::canopen {

class Handler;
class Stream;

/// One sub-index at work. `data` holds the value as on the wire; it may lie outside (Dictionary::bind).
struct Entry {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    Access access = Access::read_write;
    Type type = Type::none;
    std::uint8_t bits = 0;          ///< 0: no fixed length
    bool rpdo = false, tpdo = false, plus_node_id = false, ranged = false;
    std::uint32_t size = 0;         ///< bytes of the value now
    std::uint32_t capacity = 0;     ///< bytes there is room for
    std::uint8_t* data = nullptr;
    Handler* handler = nullptr;
    Stream* stream = nullptr;       ///< domains: where the bytes come from and go to
    std::int64_t low = 0, high = 0;

    std::uint32_t key() const noexcept { return std::uint32_t{index} << 8 | sub; }
    std::span<const std::uint8_t> bytes() const noexcept { return {data, size}; }
};

/// Watches one object or refuses access to it. All calls come from whoever polls the device. [realtime]
class Handler {
public:
    virtual ~Handler() = default;
    /// Before the value is read by SDO or sent in a PDO: the place to refresh it.
    virtual Abort reading(Entry&) noexcept { return Abort::none; }
    /// Before an SDO writes `value`, whose length and limits are in order already.
    virtual Abort writing(Entry&, std::span<const std::uint8_t> value) noexcept { return (void)value, Abort::none; }
    /// After SDO or a PDO wrote it. A PDO writes all it carries first.
    virtual void written(Entry&) noexcept {}
};

/// The bytes of a domain, reached by their offset; a block may be read again when the bus lost a part. [realtime]
class Stream {
public:
    virtual ~Stream() = default;
    virtual Abort open_read(Entry&, std::uint32_t& size) noexcept = 0;
    /// Fills all of `room`, which lies within the size told.
    virtual Abort read(Entry&, std::uint32_t offset, std::span<std::uint8_t> room) noexcept = 0;
    /// `size` is 0 when the sender does not say.
    virtual Abort open_write(Entry&, std::uint32_t size) noexcept = 0;
    virtual Abort write(Entry&, std::uint32_t offset, std::span<const std::uint8_t>) noexcept = 0;
    /// The transfer is over; `whole`: all of it came through. What it returns is the answer to a download.
    virtual Abort close(Entry&, bool writing, bool whole) noexcept = 0;
};

class Dictionary {
public:
    explicit Dictionary(const Description&, std::uint8_t node_id = 0);  // [setup]
    Dictionary(const Dictionary&) = delete;
    Dictionary& operator=(const Dictionary&) = delete;

    /// nullptr when there is none. The pointer stays good. [realtime]
    Entry* find(std::uint16_t index, std::uint8_t sub) noexcept;
    const Entry* find(std::uint16_t index, std::uint8_t sub) const noexcept { return const_cast<Dictionary*>(this)->find(index, sub); }
    /// As find(), and says what is missing: the object or only the sub-index. [realtime]
    Entry* find(std::uint16_t index, std::uint8_t sub, Abort& why) noexcept;
    /// All entries of one index. [realtime]
    std::span<Entry> object(std::uint16_t index) noexcept;
    std::span<Entry> entries() noexcept { return entries_; }

    /// Access as an SDO has it: rights, handlers, length, limits. Domains go through their Stream instead. [realtime]
    Abort prepare_read(Entry&) noexcept;
    Abort read(std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> room, std::size_t& size) noexcept;
    Abort write(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value) noexcept;
    Abort write(Entry&, std::span<const std::uint8_t> value) noexcept;
    /// Whether a value of that length could be written at all. [realtime]
    static Abort check_length(const Entry&, std::uint64_t size) noexcept;

    /// The value itself, without rights or handlers; `otherwise` when there is none of that size. [realtime]
    template <class T>
    T get(std::uint16_t index, std::uint8_t sub, T otherwise = {}) const noexcept {
        const Entry* e = find(index, sub);
        if (e == nullptr || e->size > sizeof(T) || e->size == 0) return otherwise;
        return value<T>(*e);
    }
    template <class T>
    static T value(const Entry& e) noexcept {
        T result{};
        std::memcpy(&result, e.data, e.size < sizeof(T) ? e.size : sizeof(T));
        return result;
    }
    /// False when there is no such value or it has another size. [realtime]
    template <class T>
    bool set(std::uint16_t index, std::uint8_t sub, T value) noexcept {
        Entry* e = find(index, sub);
        if (e == nullptr || e->capacity < sizeof(T) || (e->bits != 0 && e->size != sizeof(T))) return false;
        std::memcpy(e->data, &value, sizeof(T));
        return true;
    }

    /// The value lies in `variable` from now on, which outlives the dictionary; it takes the present value. [setup]
    template <class T>
    bool bind(std::uint16_t index, std::uint8_t sub, T& variable) noexcept {
        Entry* e = find(index, sub);
        if (e == nullptr || e->bits == 0 || e->size != sizeof(T)) return false;
        std::memcpy(&variable, e->data, sizeof(T));
        e->data = reinterpret_cast<std::uint8_t*>(&variable);
        return true;
    }
    /// Of one object, all its sub-indices. False: no such object. [setup]
    bool handle(std::uint16_t index, Handler&) noexcept;
    bool stream(std::uint16_t index, std::uint8_t sub, Stream&) noexcept;

    std::uint8_t node_id() const noexcept { return node_id_; }
    void set_node_id(std::uint8_t id) noexcept { node_id_ = id; }
    /// Objects first…last take their power-on values. Domains keep theirs. [realtime]
    void reset(std::uint16_t first, std::uint16_t last) noexcept;
    /// The present values become those of power-on; `to_defaults`: those of the description do. [realtime]
    void keep(std::uint16_t first, std::uint16_t last, bool to_defaults) noexcept;
    /// Bytes of the longest value that is no domain.
    std::size_t longest() const noexcept { return longest_; }
    /// What the description had that could not be taken, a sentence each. [setup]
    const std::vector<std::string>& problems() const noexcept { return problems_; }

private:
    struct Image {
        std::uint32_t offset = 0, size = 0, default_size = 0;
    };
    void apply_node_id(Entry&) noexcept;

    std::vector<std::uint32_t> keys_;  // sorted; the position is that in entries_
    std::vector<Entry> entries_;
    std::vector<Image> images_;        // where each value lies in the three memories below
    std::vector<std::uint8_t> memory_, power_on_, defaults_;
    std::vector<std::string> problems_;
    std::size_t longest_ = 8;
    std::uint8_t node_id_;
};

}  // namespace hal::canopen
