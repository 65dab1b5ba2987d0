// SPDX-License-Identifier: MIT
// The object dictionary (CiA 301): typed values that SDO, PDO and the application share. Built once
// from a Description; afterwards it neither grows nor allocates. One thread at a time.
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

/// One sub-index. `data` points to the value, little endian; it may lie outside the dictionary
/// (Dictionary::bind).
struct Entry {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    Access access = Access::read_write;
    Type type = Type::none;
    std::uint8_t bits = 0;  ///< 0: variable length
    bool rpdo = false;
    bool tpdo = false;
    bool plus_node_id = false;
    bool ranged = false;
    std::uint32_t size = 0;  ///< length of the present value in bytes
    std::uint32_t capacity = 0;  ///< maximum length in bytes
    std::uint8_t* data = nullptr;
    Handler* handler = nullptr;
    Stream* stream = nullptr;  ///< domains: source and destination of the bytes
    std::int64_t low = 0;
    std::int64_t high = 0;

    /// Returns index and sub-index as one number. [any]
    std::uint32_t key() const noexcept { return std::uint32_t{index} << 8 | sub; }
    /// Returns the present value. [realtime]
    std::span<const std::uint8_t> bytes() const noexcept { return {data, size}; }
};

/// Observes an object, refreshes it or rejects access to it. All calls come from the thread that
/// polls the device. [realtime]
class Handler {
public:
    virtual ~Handler() = default;
    /// Called before the value is read by SDO or sent in a PDO; may refresh it. Any abort code
    /// rejects the read.
    virtual Abort reading(Entry&) noexcept { return Abort::none; }
    /// Called before SDO writes `value`, whose length and limits are valid. Any abort code rejects
    /// the write.
    virtual Abort writing(Entry&, std::span<const std::uint8_t> value) noexcept {
        return (void)value, Abort::none;
    }
    /// Called after SDO or a PDO wrote the value; a PDO writes all its values first.
    virtual void written(Entry&) noexcept {}
};

/// The bytes of a domain, addressed by their offset; a block is read again if a segment was lost.
/// Abort codes end the transfer. [realtime]
class Stream {
public:
    virtual ~Stream() = default;
    /// Begins an upload; sets `size` to the length in bytes.
    virtual Abort open_read(Entry&, std::uint32_t& size) noexcept = 0;
    /// Fills `buffer`, which lies within the size that open_read() returned.
    virtual Abort read(Entry&, std::uint32_t offset, std::span<std::uint8_t> buffer) noexcept = 0;
    /// Begins a download of `size` bytes; 0: the client did not announce the size.
    virtual Abort open_write(Entry&, std::uint32_t size) noexcept = 0;
    /// Receives bytes at `offset`.
    virtual Abort write(Entry&, std::uint32_t offset, std::span<const std::uint8_t>) noexcept = 0;
    /// Ends the transfer; `complete` is false after an abort. The result answers a download.
    virtual Abort close(Entry&, bool writing, bool complete) noexcept = 0;
};

/// The objects of one node.
class Dictionary {
public:
    /// Builds the dictionary; entries that are invalid are left out and listed in problems().
    /// [setup]
    explicit Dictionary(const Description&, std::uint8_t node_id = 0);
    Dictionary(const Dictionary&) = delete;
    Dictionary& operator=(const Dictionary&) = delete;

    /// Returns the entry or nullptr. The pointer stays valid. [realtime]
    Entry* find(std::uint16_t index, std::uint8_t sub) noexcept;
    /// Returns the entry or nullptr. The pointer stays valid. [realtime]
    const Entry* find(std::uint16_t index, std::uint8_t sub) const noexcept {
        return const_cast<Dictionary*>(this)->find(index, sub);
    }
    /// Returns the entry, or nullptr and sets `why` to Abort::no_object or Abort::no_sub.
    /// [realtime]
    Entry* find(std::uint16_t index, std::uint8_t sub, Abort& why) noexcept;
    /// Returns all sub-indices of one object. [realtime]
    std::span<Entry> object(std::uint16_t index) noexcept;
    /// Returns all entries, sorted by index and sub-index. [realtime]
    std::span<Entry> entries() noexcept { return entries_; }

    /// Checks the access right and calls the handler, as before an SDO upload. [realtime]
    Abort prepare_read(Entry&) noexcept;
    /// Reads a value as SDO does, with access right and handler; domains are read through their
    /// Stream instead. `size` is the length in bytes. [realtime]
    Abort read(std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> buffer,
               std::size_t& size) noexcept;
    /// Writes a value as SDO does, with access right, length, limits and handler; domains are
    /// written through their Stream instead. [realtime]
    Abort write(std::uint16_t index, std::uint8_t sub,
                std::span<const std::uint8_t> value) noexcept;
    /// Writes a value as SDO does. [realtime]
    Abort write(Entry&, std::span<const std::uint8_t> value) noexcept;
    /// Returns Abort::none if a value of `size` bytes fits the type of the entry. [realtime]
    static Abort check_length(const Entry&, std::uint64_t size) noexcept;

    /// Returns the value without access rights or handlers; `otherwise` if it is missing or larger
    /// than T. [realtime]
    template <class T>
    T get(std::uint16_t index, std::uint8_t sub, T otherwise = {}) const noexcept {
        const Entry* e = find(index, sub);
        if (e == nullptr || e->size > sizeof(T) || e->size == 0) return otherwise;
        return value<T>(*e);
    }
    /// Returns the value of an entry, truncated or zero-extended to T. [realtime]
    template <class T>
    static T value(const Entry& e) noexcept {
        T result{};
        std::memcpy(&result, e.data, e.size < sizeof(T) ? e.size : sizeof(T));
        return result;
    }
    /// Sets the value without access rights or handlers; returns false if it is missing or has
    /// another size. [realtime]
    template <class T>
    bool set(std::uint16_t index, std::uint8_t sub, T value) noexcept {
        Entry* e = find(index, sub);
        if (e == nullptr || e->capacity < sizeof(T) || (e->bits != 0 && e->size != sizeof(T))) {
            return false;
        }
        std::memcpy(e->data, &value, sizeof(T));
        return true;
    }

    /// Moves the value to `variable`, which outlives the dictionary. Returns false if it is missing
    /// or has another size. [setup]
    template <class T>
    bool bind(std::uint16_t index, std::uint8_t sub, T& variable) noexcept {
        Entry* e = find(index, sub);
        if (e == nullptr || e->bits == 0 || e->size != sizeof(T)) return false;
        std::memcpy(&variable, e->data, sizeof(T));
        e->data = reinterpret_cast<std::uint8_t*>(&variable);
        return true;
    }
    /// Installs a handler for all sub-indices of an object; returns false if the object does not
    /// exist. [setup]
    bool handle(std::uint16_t index, Handler&) noexcept;
    /// Installs the stream of a domain; returns false if the entry does not exist. [setup]
    bool stream(std::uint16_t index, std::uint8_t sub, Stream&) noexcept;

    /// Returns the node ID that is added to entries with $NODEID. [any]
    std::uint8_t node_id() const noexcept { return node_id_; }
    /// Sets the node ID; it applies from the next reset() on. [realtime]
    void set_node_id(std::uint8_t id) noexcept { node_id_ = id; }
    /// Sets the objects first..last to their power-on values; domains keep theirs. [realtime]
    void reset(std::uint16_t first, std::uint16_t last) noexcept;
    /// Makes the present values of first..last the power-on values (1010h); `to_defaults`: those of
    /// the description (1011h). [realtime]
    void keep(std::uint16_t first, std::uint16_t last, bool to_defaults) noexcept;
    /// Returns the length of the longest value other than domains, in bytes. [any]
    std::size_t max() const noexcept { return max_; }
    /// Returns a sentence for each entry of the description that was left out or changed. [setup]
    const std::vector<std::string>& problems() const noexcept { return problems_; }

private:
    struct Image {
        std::uint32_t offset = 0;
        std::uint32_t size = 0;
        std::uint32_t default_size = 0;
    };
    Entry make_entry(const EntryDescription&);
    void report(const EntryDescription&, const std::string& problem);
    void apply_node_id(Entry&) noexcept;

    std::vector<std::uint32_t> keys_;  // sorted, parallel to entries_
    std::vector<Entry> entries_;
    std::vector<Image> images_;  // position of each value in the three memories below
    std::vector<std::uint8_t> memory_, power_on_, defaults_;
    std::vector<std::string> problems_;
    std::size_t max_ = 8;
    std::uint8_t node_id_;
};

}  // namespace hal::canopen
