// SPDX-License-Identifier: MIT
// The process data of an emulated slave: what the PDO mapping (1600h…, 1A00h…) and the assignment
// (1C10h + sync manager) make of it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "ethercat/devices/dictionary.hpp"

namespace hal::ethercat::devices {

/// PDOs whose entries occur several times in the process data, once for each sample of a cycle.
struct SampledPdos {
    std::vector<std::uint16_t> indices;
    unsigned max_samples = 1;

    bool contains(std::uint16_t pdo) const noexcept {
        return std::find(indices.begin(), indices.end(), pdo) != indices.end();
    }
};

/// Copies objects to and from one sync manager.
class ProcessData {
public:
    /// `assignment` is 1C10h + the number of the sync manager; it may be missing in the dictionary.
    /// `max_bytes` limits its length. `sampled` must outlive this object. [setup]
    void attach(Dictionary&, std::uint16_t assignment, bool output, std::size_t max_bytes,
                const SampledPdos& sampled);
    /// Computes the copies from the present mapping, with so many samples. [realtime]
    void build(unsigned samples) noexcept;
    /// Returns the length of the process data. [realtime]
    std::size_t bytes() const noexcept { return (bits_ + 7) / 8; }
    std::size_t bits() const noexcept { return bits_; }  ///< the same, before rounding. [realtime]
    /// Returns whether the length depends on the number of samples. [realtime]
    bool has_samples() const noexcept { return has_samples_; }
    /// Copies outputs into the dictionary: what has no samples, and those of `sample`. [realtime]
    void unpack(std::span<const std::uint8_t> from, unsigned sample) noexcept;
    /// Copies inputs out of the dictionary: what has no samples, and those of `sample`. [realtime]
    void pack(std::span<std::uint8_t> to, unsigned sample) const noexcept;
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
    static constexpr std::uint16_t every_sample = 0xffff;
    struct Copy {
        std::uint8_t* data = nullptr;
        std::uint32_t bit = 0;
        coe::Mapping object;
        std::uint16_t sample = every_sample;

        bool belongs_to(unsigned n) const noexcept { return sample == every_sample || sample == n; }
    };
    void add(const DictionaryObject& pdo, std::uint16_t sample) noexcept;
    coe::Abort check_assigning(const DictionaryObject& assignment,
                               std::span<const std::uint8_t> value) const noexcept;
    coe::Abort check_assigned(const DictionaryObject& assignment, unsigned count) const noexcept;
    coe::Abort check_mapping(const DictionaryObject& pdo,
                             std::span<const std::uint8_t> value) const noexcept;
    coe::Abort check_mapped(const DictionaryObject& pdo, unsigned count) const noexcept;
    coe::Abort check_length(std::size_t bits) const noexcept;
    std::size_t pdo_bits(const DictionaryObject& pdo, unsigned entries) const noexcept;
    bool is_pdo(std::uint16_t index) const noexcept;
    /// Returns the right that an object needs to be in a PDO of this direction.
    std::uint16_t mappable() const noexcept {
        return output_ ? coe::access::rx_mappable : coe::access::tx_mappable;
    }

    Dictionary* dictionary_ = nullptr;
    const SampledPdos* sampled_ = nullptr;
    std::uint16_t assignment_ = 0;
    bool output_ = false;
    bool has_samples_ = false;
    std::size_t bits_ = 0;
    std::size_t max_bytes_ = 0;
    std::size_t used_ = 0;
    std::vector<Copy> copies_;
};

}  // namespace hal::ethercat::devices
