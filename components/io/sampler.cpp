// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
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

    stream::ChannelCount channels{*this};
    stream::Columns<HAL_DIR_IN> columns{*this, cfg.get(), depth, false, "value to record"};
    hal::In<bool> enable{*this, "enable", "FALSE pauses the recording", {.initial = true}};
    hal::Out<std::int32_t> waiting{
        *this, "curr-depth", "records in the FIFO; depth if the record of this cycle is lost"};
    hal::Out<bool> full{*this, "full",
                        "TRUE: the FIFO was full, and the record of this cycle is lost"};
    hal::Io<std::int32_t> overruns{*this, "overruns",
                                   "records lost because the FIFO was full; may be set"};
    hal::Io<std::int32_t> sample_number{*this, "sample-num",
                                        "number of the next record; may be set"};

    hal::Function run{*this, "", &Sampler::sample, "writes a record of all pins to the FIFO"};

    void start(const hal_host& host) {
        columns.keep_times();
        columns.publish(host);
    }

    /// Producer of the FIFO: writes the record, then head (release). The consumer outside writes
    /// tail after copying.
    void sample(hal::Cycle cycle) noexcept {
        hal_stream& fifo = columns.fifo();
        const std::uint64_t head = fifo.head;
        std::uint64_t held = head - __atomic_load_n(&fifo.tail, __ATOMIC_ACQUIRE);
        const bool no_space = held >= fifo.depth;
        if (enable && !no_space) {
            const std::int32_t number = sample_number;
            write(columns.record(head), number);
            columns.stamp(head, cycle.start_ns());
            __atomic_store_n(&fifo.head, head + 1, __ATOMIC_RELEASE);
            sample_number = next(number);
            ++held;
        } else if (enable) {
            overruns = next(overruns);
            __atomic_store_n(&fifo.lost, fifo.lost + 1, __ATOMIC_RELAXED);
            held = static_cast<std::uint64_t>(std::int64_t{depth});
        }
        waiting = static_cast<std::int32_t>(held);
        full = no_space;
    }

private:
    static std::int32_t next(std::int32_t number) noexcept {
        return static_cast<std::int32_t>(static_cast<std::uint32_t>(number) + 1);
    }

    void write(hal_value* to, std::int32_t number) noexcept {
        columns.pins().each([to](const auto& pin, std::size_t column) {
            to[column] = hal::to_value(pin.get());
        });
        to[columns.fifo().columns].s64 = number;
    }
};

}  // namespace

HAL_COMPONENT(Sampler, "sampler", "Records pins into a FIFO for external programs", R"(
In each cycle in which `enable` is TRUE, the values of all pins are written to the FIFO with a sequence number. `hal record` and
LinuxCNC-style `halsampler` read it while the machine runs. A FIFO of `depth=N` holds N - 1 records. If it is full, the new record is lost,
never an old one: `overruns` counts it, and `hal record` prints `overrun` at this place; the numbers have no gap. The number of pins is not
limited.

With both arguments, there are as many instances as the shorter list has values: `depth=100,50 cfg=ff,b` makes `sampler.0` and
`sampler.1`, `depth=100 cfg=ff,b` only `sampler.0`, as in LinuxCNC. Without `depth=`, all that `cfg=` lists have the default.

**Differences from LinuxCNC:** `sample-num` is the number of the next record (LinuxCNC: always 0). `depth=1` is an error (LinuxCNC: every
record is lost).

    loadrt sampler depth=2000 cfg=ffb
    addf sampler.0 servo-thread
    net position  => sampler.0.pin.0
    net velocity  => sampler.0.pin.1
    net in-place  => sampler.0.pin.2
)")
