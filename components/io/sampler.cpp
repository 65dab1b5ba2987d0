// SPDX-License-Identifier: MIT
#include <optional>

#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "stream_columns.hpp"

namespace {

struct Sampler : hal::Component {
    using Component::Component;

    hal::TextArgument cfg{*this,
                          "cfg",
                          "f",
                          "one letter per pin: b bit, f float, s s32, u u32, l s64, k u64",
                          {.per_instance = true}};
    hal::Argument depth{*this,
                        "depth",
                        4000,
                        "slots of the FIFO; it holds one record less",
                        {.per_instance = true, .min = 2, .max = 1 << 26}};

    hal::Argument samples{
        *this,
        "samples",
        1,
        "samples in a cycle: with more than one, a cycle writes a record for each "
        "of them, and each column has a pin per sample",
        {.per_instance = true, .min = 1, .max = 1000}};

    stream::ChannelCount channels{*this};
    stream::Columns<HAL_DIR_IN> columns{*this, cfg.get(), depth, false, "value to record", samples};
    std::optional<hal::In<std::int64_t>> sample_time = make_sample_time();
    hal::In<bool> enable{*this, "enable", "FALSE pauses the recording", {.initial = true}};
    hal::Out<std::int32_t> waiting{
        *this, "curr-depth", "records in the FIFO; depth if the record of this cycle is lost"};
    hal::Out<bool> full{*this, "full",
                        "TRUE: the FIFO was full, and the record of this cycle is lost"};
    hal::Io<std::int32_t> overruns{
        *this, "overruns",
        "records lost because the FIFO was full, or reloaded with records in it; may be "
        "set"};
    hal::Io<std::int32_t> sample_number{*this, "sample-num",
                                        "number of the next record; may be set"};

    hal::Function run{*this, "", &Sampler::sample, "writes a record of all pins to the FIFO"};

    void start(const hal_host& host) {
        columns.keep_times();
        columns.publish(host);
    }

    /// Producer of the FIFO: writes the records, then head (release). The consumer outside writes
    /// tail after copying.
    void sample(hal::Cycle cycle) noexcept {
        hal_stream& fifo = columns.fifo();
        const std::uint64_t head = fifo.head;
        const std::uint64_t count = columns.samples();
        if (head == 0 && fifo.lost == 0) {
            count_discarded(fifo);
        }
        std::uint64_t held = head - columns.count_of_program();
        const bool no_space = held + count > fifo.depth;
        const bool wanted = enable && is_new();
        if (wanted && !no_space) {
            write(head, cycle);
            __atomic_store_n(&fifo.head, head + count, __ATOMIC_RELEASE);
            sample_number = later(sample_number, count);
            held += count;
            held_ = held;
        } else if (wanted) {
            overruns = later(overruns, count);
            __atomic_store_n(&fifo.lost, fifo.lost + count, __ATOMIC_RELAXED);
            held = static_cast<std::uint64_t>(std::int64_t{depth});
        }
        waiting = static_cast<std::int32_t>(held);
        full = no_space;
    }

private:
    std::optional<hal::In<std::int64_t>> make_sample_time() {
        if (columns.samples() == 1) return std::nullopt;
        return std::optional<hal::In<std::int64_t>>(
            std::in_place, *this, "sample-time",
            "when the first sample was taken, on the clock of the machine; 0: at the start of the "
            "cycle. A cycle with the time of the cycle before it writes no record",
            hal::PinOptions<std::int64_t>{.unit = "ns"});
    }

    /// A reload begins with an empty FIFO: the records that were in the one before it are lost.
    void count_discarded(hal_stream& fifo) noexcept {
        if (held_ == 0) return;
        overruns = later(overruns, held_);
        __atomic_store_n(&fifo.lost, held_, __ATOMIC_RELAXED);
        held_ = 0;
    }

    static std::int32_t later(std::int32_t number, std::uint64_t count) noexcept {
        return static_cast<std::int32_t>(static_cast<std::uint32_t>(number) +
                                         static_cast<std::uint32_t>(count));
    }

    /// Returns whether the samples are others than those of the cycle before.
    bool is_new() noexcept {
        if (!sample_time || *sample_time == 0) return true;
        const std::int64_t before = last_time_ns_;
        last_time_ns_ = *sample_time;
        return last_time_ns_ != before;
    }

    /// Writes the records of a cycle, of which `head` is the first.
    void write(std::uint64_t head, hal::Cycle cycle) noexcept {
        const std::size_t count = columns.samples();
        const std::int64_t first_ns =
            sample_time && *sample_time != 0 ? sample_time->get() : cycle.start_ns();
        const std::int64_t step_ns = cycle.period_ns() / static_cast<std::int64_t>(count);
        for (std::size_t n = 0; n < count; ++n) {
            columns.record(head + n)[columns.fifo().columns].s64 = later(sample_number, n);
            columns.stamp(head + n, first_ns + static_cast<std::int64_t>(n) * step_ns);
        }
        columns.pins().each([this, head](const auto& pin, const auto& slot) {
            columns.record(head + slot.sample)[slot.column] = hal::to_value(pin.get());
        });
    }

    std::int64_t last_time_ns_ = 0;
    std::uint64_t held_ = 0;  // records in the FIFO, after the last one that was written
    hal::Retained retained_{*this, {{"held", held_}}};
};

}  // namespace

HAL_COMPONENT(Sampler, "sampler", "Records pins into a FIFO for external programs", R"(
In each cycle in which `enable` is TRUE, the values of all pins are written to the FIFO with a
sequence number. `hal record` and LinuxCNC-style `halsampler` read it while the machine runs. A FIFO
of `depth=N` holds N - 1 records. If it is full, the new record is lost, never an old one:
`overruns` counts it, and the records that a `reload` of the component discards, and `hal record`
prints `overrun` at this place; the numbers have no gap. The number of pins is not limited.

With both arguments, there are as many instances as the shorter list has values:
`depth=100,50 cfg=ff,b` makes `sampler.0` and `sampler.1`, `depth=100 cfg=ff,b` only `sampler.0`, as
in LinuxCNC. Without `depth=`, all that `cfg=` lists have the default.

With `samples=10`, each letter of `cfg=` has ten pins, `pin.0-00` to `pin.0-09`, and each cycle
writes ten records, in the order of the samples. Their times are a tenth of the period apart, from
`sample-time` on. So a CSV has a line for each sample of a device with oversampling, with its own
time; if the FIFO has not enough space, all samples of the cycle are lost.

**Differences from LinuxCNC:** `sample-num` is the number of the next record (LinuxCNC: always 0).
`depth=1` is an error (LinuxCNC: every record is lost).

    loadrt sampler depth=2000 cfg=ffb
    addf sampler.0 servo-thread
    net position  => sampler.0.pin.0
    net velocity  => sampler.0.pin.1
    net in-place  => sampler.0.pin.2
)")
