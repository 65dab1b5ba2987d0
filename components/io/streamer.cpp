// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "stream_columns.hpp"

namespace {

struct Streamer : hal::Component {
    using Component::Component;
    enum ClockMode { falling = 1, rising, both };

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
    stream::Columns<HAL_DIR_OUT> columns{*this, cfg.get(), depth, true,
                                         "value of the newest record"};
    hal::In<bool> enable{*this, "enable", "FALSE holds the pins", {.initial = true}};
    hal::In<bool> clock{*this, "clock", "clock for the next record; see clock-mode"};
    hal::In<std::int32_t> clock_mode{
        *this, "clock-mode",
        "one record per edge of clock: 1 falling, 2 rising, 3 both; otherwise one per cycle"};
    hal::Out<std::int32_t> waiting{*this, "curr-depth",
                                   "records in the FIFO at the beginning of the cycle"};
    hal::Out<bool> empty{
        *this, "empty", "TRUE: no record was available for this cycle", {.initial = true}};
    hal::Io<std::int32_t> underruns{*this, "underruns",
                                    "times a record was due but not available; may be set"};

    hal::Function run{*this, "", &Streamer::play, "writes the next record to the pins"};

    void start(const hal_host& host) { columns.publish(host); }

    /// Consumer of the FIFO: reads the record, then writes tail (release). The producer outside
    /// writes head after filling.
    void play(hal::Cycle) noexcept {
        hal_stream& fifo = columns.fifo();
        const std::uint64_t tail = fifo.tail;
        const std::uint64_t held = columns.count_of_program() - tail;
        waiting = static_cast<std::int32_t>(held);
        empty = held == 0;
        if (due() && enable) {
            if (held > 0) {
                read(columns.record_of_program(tail));
                __atomic_store_n(&fifo.tail, tail + 1, __ATOMIC_RELEASE);
            } else {
                underruns =
                    static_cast<std::int32_t>(static_cast<std::uint32_t>(underruns.get()) + 1);
                __atomic_store_n(&fifo.lost, fifo.lost + 1, __ATOMIC_RELAXED);
            }
        }
    }

private:
    bool due() noexcept {
        const bool level = clock;
        const bool before = was_clock_;
        was_clock_ = level;
        switch (clock_mode) {
        case falling: return before && !level;
        case rising: return level && !before;
        case both: return level != before;
        default: return true;
        }
    }

    void read(const hal_value* from) noexcept {
        columns.pins().each([from]<class T>(hal::Out<T>& pin, const auto& slot) {
            pin = hal::value_as<T>(from[slot.column]);
        });
    }

    bool was_clock_ = false;
    hal::Retained retained_{*this, {{"was-clock", was_clock_}}};
};

}  // namespace

HAL_COMPONENT(Streamer, "streamer", "Plays records that external programs write to a FIFO", R"(
In each cycle in which a record is due, the next one is copied from the FIFO to the pins. If the FIFO
is empty, the pins keep their values and `underruns` increases. `clock-mode` selects when a record is due: 0
in every cycle, 1 at falling, 2 at rising, 3 at both edges of `clock`. A FIFO of `depth=N` holds N -
1 records. The number of pins is not limited.

Feed it by one program at a time: the records of two are mixed. Records that wait at `stop`, or
after a fault that stopped the thread, are played when it runs again.

    loadrt streamer depth=2000 cfg=fb
    loadrt pid
    addf streamer.0 servo-thread
    addf pid.0.do-pid-calcs servo-thread
    net x-command  streamer.0.pin.0 => pid.0.command
)")
