// SPDX-License-Identifier: MIT
// Records of cycles as bytes: differences to the record before, in as few bytes as they need.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "execute/cycle_inputs.hpp"

namespace hal {

/// A batch of records of one thread; the first one needs no earlier batch. [setup]
class CycleEncoder {
public:
    /// Appends a record with its notes.
    void add(const CycleRecord& record, std::span<const std::uint64_t> notes);
    std::size_t records() const { return records_; }
    std::size_t bytes() const { return bytes_.size(); }
    /// Returns the batch and begins the next one.
    std::string take();

private:
    std::string bytes_;
    std::size_t records_ = 0;
    CycleRecord before_;
    std::vector<std::uint64_t> notes_before_;
};

/// Reads a batch. Nothing in it is trusted. [setup]
class CycleDecoder {
public:
    explicit CycleDecoder(std::string bytes) : bytes_(std::move(bytes)) {}

    /// Reads the next record. Returns false at the end and where the batch is damaged.
    bool next(CycleRecord& record, std::vector<std::uint64_t>& notes);
    /// Returns true when next() has returned false because the batch is damaged.
    bool damaged() const { return damaged_; }

private:
    std::uint64_t number();
    std::uint64_t difference(std::uint64_t before);
    std::uint64_t word();

    const std::string bytes_;
    std::size_t at_ = 0;
    bool damaged_ = false;
    CycleRecord before_;
    std::vector<std::uint64_t> notes_before_;
};

}  // namespace hal
