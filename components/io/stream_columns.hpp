// SPDX-License-Identifier: MIT
// Shared by sampler and streamer: an array of pins of several types, and their FIFO of records.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/any_pin.hpp"
#include "hal/journal.hpp"
#include "hal/naming.h"
#include "hal/stream_times.h"

namespace stream {

// in the order of hal_type, as cfg= and hal_stream::types have them
constexpr std::string_view letters = "bfsulk";
static_assert(HAL_TYPE_BIT == 0 && HAL_TYPE_FLOAT == 1 && HAL_TYPE_S32 == 2 && HAL_TYPE_U32 == 3 &&
              HAL_TYPE_S64 == 4 && HAL_TYPE_U64 == 5);

/// Sets the number of instances as LinuxCNC counts channels: up to the first one without letters in
/// cfg= or without a depth above 0. An argument that is not given has its default for all of them.
/// A member after the arguments.
class ChannelCount {
public:
    explicit ChannelCount(hal::Component&) {
        const std::optional<std::size_t> by_cfg =
            count("cfg", [](const std::string& cfg) { return !cfg.empty(); });
        const std::optional<std::size_t> by_depth =
            count("depth", [](const std::string& depth) { return std::atoll(depth.c_str()) > 0; });
        const std::size_t channels =
            std::min(by_cfg.value_or(SIZE_MAX), by_depth.value_or(SIZE_MAX));
        const auto* naming = hal::extension<hal_naming>(HAL_NAMING);
        if (naming == nullptr || channels == 0 || channels == SIZE_MAX) return;
        naming->count(hal::detail::creating, by_cfg == channels ? "cfg" : "depth", channels);
    }

private:
    /// Returns how many elements of a list come before the first that is not valid, or nothing when
    /// the argument is not given.
    template <class Valid>
    static std::optional<std::size_t> count(const char* name, Valid valid) {
        const std::string list = hal::Argument::ask(name, "", "", {});
        if (list.empty()) return std::nullopt;
        std::size_t elements = 0;
        for (std::size_t from = 0; from <= list.size(); ++elements) {
            const std::size_t end = std::min(list.find(',', from), list.size());
            if (!valid(list.substr(from, end - from))) break;
            from = end + 1;
        }
        return elements;
    }
};

/// The pins `pin.0`, `pin.1` … one per letter of cfg, and the memory of the FIFO. As in LinuxCNC, a
/// FIFO of depth N holds N - 1 records. With several samples in a cycle, each letter has a pin for
/// each of them: `pin.0-00`, `pin.0-01` …
template <hal_dir direction>
class Columns {
public:
    /// Where a pin is in the records of a cycle.
    struct Slot {
        std::size_t column = 0;
        std::size_t sample = 0;
    };

    /// Throws when cfg has another letter than b f s u l k (either case) or the FIFO would be too
    /// large. [setup]
    Columns(hal::Component& component, const std::string& cfg, std::int64_t depth, bool to_machine,
            const char* doc, std::int64_t samples = 1)
        : samples_(static_cast<std::size_t>(samples)) {
        if (cfg.empty()) {
            throw hal::ArgumentError("cfg",
                                     "cfg= is empty; give one letter per pin, of b f s u l k");
        }
        constexpr std::size_t max_values = std::size_t{1} << 26;  // half a gigabyte
        if (static_cast<std::size_t>(depth) > max_values / (cfg.size() + 1)) {
            throw hal::ArgumentError("depth", "depth=" + std::to_string(depth) +
                                                  " records of this cfg need more than 512 MB");
        }
        if (samples > depth - 1) {
            throw hal::ArgumentError("samples",
                                     "samples=" + std::to_string(samples) + ": the FIFO holds " +
                                         std::to_string(depth - 1) + " records; raise depth=");
        }
        for (const char letter : cfg) {
            add(component, letter, doc);
        }
        const std::int64_t capacity = depth - 1;
        values_.resize(static_cast<std::size_t>(capacity) * (cfg.size() + 1));
        fifo_.size = sizeof fifo_;
        fifo_.columns = static_cast<std::uint32_t>(cfg.size());
        fifo_.depth = static_cast<std::uint32_t>(capacity);
        fifo_.to_machine = to_machine ? 1 : 0;
        fifo_.types = types_.c_str();
        fifo_.data = values_.data();
    }

    /// Each record carries a time and the number of losses: the producer calls stamp() before it
    /// moves the head. In the constructor. [setup]
    void keep_times() {
        times_.resize(fifo_.depth);
        losses_.resize(fifo_.depth);
        timed_.times = times_.data();
        timed_.losses = losses_.data();
        fifo_.size = sizeof timed_;
    }

    /// Makes the FIFO known to the programs outside as the instance's own name; a host without
    /// streams is all right. What a function takes from the programs is in the journal: by
    /// count_of_program() and record_of_program(). In start(). [setup]
    void publish(const hal_host& host) {
        const hal::JournaledSource journaled;
        const auto* streams = hal::extension<hal_stream_host>("hal.stream/1");
        if (streams != nullptr && !streams->publish(&host, "", &fifo_)) {
            throw std::runtime_error("the stream could not be published");
        }
    }

    hal_stream& fifo() noexcept { return fifo_; }
    /// Returns how many records the other end of the FIFO, which is a program's, has written or
    /// taken. Once in a cycle. [realtime]
    std::uint64_t count_of_program() noexcept {
        const std::uint64_t& count = fifo_.to_machine ? fifo_.head : fifo_.tail;
        return count_of_program_(__atomic_load_n(&count, __ATOMIC_ACQUIRE));
    }
    /// Returns a record that a program has written. [realtime]
    const hal_value* record_of_program(std::uint64_t number) noexcept {
        hal_value* const values = record(number);
        hal::journaled(values, fifo_.columns);
        return values;
    }
    /// The samples in a cycle. [realtime]
    std::size_t samples() const noexcept { return samples_; }
    /// The pins, each with its slot. [realtime]
    const hal::AnyPins<direction, Slot>& pins() const noexcept { return pins_; }
    /// Notes when a record was made and how many records had been lost by then. [realtime]
    void stamp(std::uint64_t number, std::int64_t time_ns) noexcept {
        times_[number % fifo_.depth] = time_ns;
        losses_[number % fifo_.depth] = fifo_.lost;
    }
    /// The record with a running number: a value per column, then the sample number. [realtime]
    hal_value* record(std::uint64_t number) noexcept {
        return &fifo_.data[number % fifo_.depth * (fifo_.columns + 1)];
    }

private:
    void add(hal::Component& component, char letter, const char* doc) {
        const char lower =
            letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
        const std::size_t type = letters.find(lower);
        if (type == letters.npos) {
            throw std::invalid_argument(std::string("cfg has the letter '") + letter +
                                        "'; valid letters are b f s u l k");
        }
        const std::size_t column = types_.size();
        const std::string name = "pin." + std::to_string(column);
        for (std::size_t sample = 0; sample < samples_; ++sample) {
            const std::string number = (sample < 10 ? "-0" : "-") + std::to_string(sample);
            pins_.declare(component, nullptr, static_cast<hal_type>(type),
                          samples_ > 1 ? name + number : name, doc, Slot{column, sample});
        }
        types_ += lower;
    }

    const std::size_t samples_;
    hal::AnyPins<direction, Slot> pins_;
    std::string types_;
    std::vector<hal_value> values_;
    std::vector<std::int64_t> times_;
    std::vector<std::uint64_t> losses_;
    hal::JournaledValue<std::uint64_t> count_of_program_;
    hal_timed_stream timed_{};
    hal_stream& fifo_ = timed_.stream;
};

}  // namespace stream
