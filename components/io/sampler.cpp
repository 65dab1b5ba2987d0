// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "stream_columns.hpp"

namespace {

struct Sampler : hal::Component {
    using Component::Component;

    hal::TextArgument cfg{*this, "cfg", "f", "one letter per pin: b bit, f float, s s32, u u32, l s64, k u64", {.per_instance = true}};
    hal::Argument depth{*this, "depth", 4000, "capacity of the FIFO in records", {.per_instance = true, .min = 1, .max = 1 << 26}};

    stream::Columns<stream::AnyIn> columns{*this, cfg.get(), depth, false, "value to record"};
    hal::In<bool> enable{*this, "enable", "FALSE pauses the recording", {.initial = true}};
    hal::Out<std::int32_t> waiting{*this, "curr-depth", "records in the FIFO"};
    hal::Out<bool> full{*this, "full", "TRUE: the FIFO is full; the next record will be lost"};
    hal::Io<std::int32_t> overruns{*this, "overruns", "records lost because the FIFO was full; may be set"};
    hal::Io<std::int32_t> sample_number{*this, "sample-num", "number of the next record, lost ones included; may be set"};

    hal::Function run{*this, "", &Sampler::sample, "writes a record of all pins to the FIFO"};

    void start(const hal_host& host) {
        columns.keep_times();
        columns.publish(host);
    }

    /// Producer of the FIFO: writes the record, then head (release). The consumer outside writes tail after copying.
    void sample(hal::Cycle cycle) noexcept {
        hal_stream& fifo = columns.fifo();
        const std::uint64_t head = fifo.head;
        std::uint64_t held = head - __atomic_load_n(&fifo.tail, __ATOMIC_ACQUIRE);
        if (enable) {
            const std::int32_t number = sample_number;
            sample_number = next(number);
            if (held < fifo.depth) {
                write(columns.record(head), number);
                columns.time(head) = cycle.start_ns();
                __atomic_store_n(&fifo.head, head + 1, __ATOMIC_RELEASE);
                ++held;
            } else {
                overruns = next(overruns);
                __atomic_store_n(&fifo.lost, fifo.lost + 1, __ATOMIC_RELAXED);
            }
        }
        waiting = static_cast<std::int32_t>(held);
        full = held >= fifo.depth;
    }

private:
    static std::int32_t next(std::int32_t number) noexcept { return static_cast<std::int32_t>(static_cast<std::uint32_t>(number) + 1); }

    void write(hal_value* to, std::int32_t number) noexcept {
        for (const auto& pin : columns.pins()) {
            to->raw = 0;
            std::visit([to](const auto& p) {
                if constexpr (requires { p.get(); }) *to = hal::detail::to_value(p.get());
            }, pin);
            ++to;
        }
        to->s64 = number;
    }
};

}  // namespace

HAL_COMPONENT(Sampler, "sampler", "Records pins into a FIFO for external programs", R"(
In each cycle in which `enable` is TRUE, the values of all pins are written to the FIFO with a sequence number. `hal record` and
LinuxCNC-style `halsampler` read it while the machine runs. If the FIFO is full, the new record is lost, never an old one: `overruns` counts it,
and the numbers have a gap. The number of pins is not limited.

    loadrt sampler depth=2000 cfg=ffb
    addf sampler.0 servo-thread
    net position  => sampler.0.pin.0
    net velocity  => sampler.0.pin.1
    net in-place  => sampler.0.pin.2
)")
