// SPDX-License-Identifier: MIT
// Names of objects to the objects. A large netlist has hundreds of thousands, and its loading is
// bounded by cache misses: a lookup reads one slot, and the name itself only when their hashes are
// equal.
//
//   slots_:  [empty] [key hash object] [erased] [key hash object] [empty] …      a power of two
//
// Open addressing with linear probing; at most three quarters of the slots are in use or erased.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

namespace hal {

/// Keys view the object's own name, which never changes. Not synchronised. [setup]
template <class T>
class NameTable {
public:
    NameTable() = default;
    NameTable(NameTable&& other) noexcept { swap(other); }
    NameTable& operator=(NameTable&& other) noexcept {
        NameTable moved(std::move(other));
        swap(moved);
        return *this;
    }

    /// Returns the object of that name, or nullptr.
    T* find(std::string_view name) const {
        const Slot* const slot = slot_of(name);
        return slot ? slot->object : nullptr;
    }
    /// Enters an object, unless the name is in the table. Throws std::bad_alloc, and then changes
    /// nothing.
    void emplace(std::string_view name, T* object) {
        const std::uint32_t hash = hash_of(name);
        if (slot_of(name, hash)) return;
        if ((used_ + 1) * 4 > slots_.size() * 3) {
            // few of them may be in use, the others erased
            resize((size_ + 1) * 2);
        }
        Slot& slot = free_slot(hash);
        used_ += slot.is_erased() ? 0 : 1;
        slot = {name.data(), static_cast<std::uint32_t>(name.size()), hash, object};
        ++size_;
    }
    /// Removes a name, if it is in the table.
    void erase(std::string_view name) noexcept {
        if (const Slot* const slot = slot_of(name)) {
            slots_[static_cast<std::size_t>(slot - slots_.data())] = Slot::erased();
            --size_;
        }
    }
    /// Begins to load the slot of a name into the cache: of many names, the misses overlap.
    void prefetch(std::string_view name) const {
        if (!slots_.empty()) {
            __builtin_prefetch(&slots_[hash_of(name) & (slots_.size() - 1)]);
        }
    }
    /// Makes emplace() not allocate until there are so many names.
    void reserve(std::size_t names) {
        if (names * 4 > slots_.size() * 3) {
            resize(names + names / 2);
        }
    }
    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    void swap(NameTable& other) noexcept {
        slots_.swap(other.slots_);
        std::swap(size_, other.size_);
        std::swap(used_, other.used_);
    }

private:
    struct Slot {
        const char* text = nullptr;  ///< nullptr: empty or erased
        std::uint32_t size = 0;  ///< of an erased slot 1
        std::uint32_t hash = 0;
        T* object = nullptr;

        static Slot erased() { return {nullptr, 1, 0, nullptr}; }
        bool is_taken() const { return text != nullptr; }
        bool is_erased() const { return !text && size == 1; }
        bool is_empty() const { return !text && size == 0; }
    };

public:
    /// Over the names with their objects, in no order.
    class Iterator {
    public:
        using iterator_category = std::input_iterator_tag;
        using value_type = std::pair<std::string_view, T*>;
        using difference_type = std::ptrdiff_t;
        using pointer = const value_type*;
        using reference = value_type;
        Iterator(const Slot* at, const Slot* end) : at_(at), end_(end) { skip(); }
        value_type operator*() const {
            return {std::string_view(at_->text, at_->size), at_->object};
        }
        Iterator& operator++() {
            ++at_;
            skip();
            return *this;
        }
        bool operator==(const Iterator& other) const { return at_ == other.at_; }

    private:
        void skip() {
            while (at_ != end_ && !at_->is_taken()) {
                ++at_;
            }
        }
        const Slot* at_;
        const Slot* end_;
    };
    Iterator begin() const { return {slots_.data(), slots_.data() + slots_.size()}; }
    Iterator end() const { return {slots_.data() + slots_.size(), slots_.data() + slots_.size()}; }

private:
    static std::uint32_t hash_of(std::string_view name) {
        return static_cast<std::uint32_t>(std::hash<std::string_view>{}(name));
    }

    const Slot* slot_of(std::string_view name) const {
        return slots_.empty() ? nullptr : slot_of(name, hash_of(name));
    }

    const Slot* slot_of(std::string_view name, std::uint32_t hash) const {
        if (slots_.empty()) return nullptr;
        const std::size_t mask = slots_.size() - 1;
        for (std::size_t at = hash & mask; !slots_[at].is_empty(); at = (at + 1) & mask) {
            const Slot& slot = slots_[at];
            const bool same = slot.is_taken() && slot.hash == hash &&
                              std::string_view(slot.text, slot.size) == name;
            if (same) return &slot;
        }
        return nullptr;
    }

    Slot& free_slot(std::uint32_t hash) {
        const std::size_t mask = slots_.size() - 1;
        std::size_t at = hash & mask;
        while (slots_[at].is_taken()) {
            at = (at + 1) & mask;
        }
        return slots_[at];
    }

    /// Makes at least `slots` slots, and enters all names again.
    void resize(std::size_t slots) {
        std::size_t size = 16;
        while (size < slots) {
            size *= 2;
        }
        std::vector<Slot> before(size);
        before.swap(slots_);
        used_ = size_;
        for (const Slot& slot : before) {
            if (slot.is_taken()) {
                free_slot(slot.hash) = slot;
            }
        }
    }

    std::vector<Slot> slots_;  // a power of two, or none
    std::size_t size_ = 0;
    std::size_t used_ = 0;  // taken or erased
};

}  // namespace hal
