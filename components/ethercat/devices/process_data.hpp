// SPDX-License-Identifier: MIT
// The process data of an emulated slave: what the PDO mapping (1600h…, 1A00h…) and the assignment
// (1C10h + sync manager) make of it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "ethercat/devices/dictionary.hpp"

namespace hal::ethercat::devices {

/// Copies objects to and from one sync manager.
class ProcessData {
public:
    /// `assignment` is 1C10h + the number of the sync manager; it may be missing in the dictionary.
    /// `max_bytes` limits its length. [setup]
    void attach(Dictionary&, std::uint16_t assignment, bool output, std::size_t max_bytes);
    /// Computes the copies from the present mapping. [realtime]
    void build() noexcept;
    /// Returns the length of the process data. [realtime]
    std::size_t bytes() const noexcept { return (bits_ + 7) / 8; }
    /// Copies outputs into the dictionary. [realtime]
    void unpack(std::span<const std::uint8_t> from) noexcept;
    /// Copies inputs out of the dictionary. [realtime]
    void pack(std::span<std::uint8_t> to) const noexcept;
    void clear() noexcept;  ///< Sets all mapped outputs to 0. [realtime]
    std::uint16_t assignment() const noexcept { return assignment_; }

    /// Calls f(index, sub) for each object of the process data, in its order. [realtime]
    template <class F>
    void each_object(F&& f) const noexcept {
        for (std::size_t n = 0; n < used_; ++n) {
            f(copies_[n].object.index, copies_[n].object.sub);
        }
    }

    /// Checks a write to a mapping or an assignment of this direction; Abort::none for other
    /// objects. [realtime]
    coe::Abort check(const DictionaryObject&, const DictionaryEntry&,
                     std::span<const std::uint8_t> value) const noexcept;

private:
    struct Copy {
        std::uint8_t* data = nullptr;
        std::uint32_t bit = 0;
        coe::Mapping object;
    };
    void add(const DictionaryObject& pdo) noexcept;
    coe::Abort check_assigning(const DictionaryObject& assignment,
                               std::span<const std::uint8_t> value) const noexcept;
    coe::Abort check_assigned(const DictionaryObject& assignment, unsigned count) const noexcept;
    coe::Abort check_mapping(const DictionaryObject& pdo,
                             std::span<const std::uint8_t> value) const noexcept;
    coe::Abort check_mapped(const DictionaryObject& pdo, unsigned count) const noexcept;
    coe::Abort check_length(std::size_t bits) const noexcept;
    std::size_t pdo_bits(const DictionaryObject& pdo, unsigned entries) const noexcept;
    bool is_pdo(std::uint16_t index) const noexcept;

    Dictionary* dictionary_ = nullptr;
    std::uint16_t assignment_ = 0;
    bool output_ = false;
    std::size_t bits_ = 0;
    std::size_t max_bytes_ = 0;
    std::size_t used_ = 0;
    std::vector<Copy> copies_;
};

}  // namespace hal::ethercat::devices
