// SPDX-License-Identifier: MIT
// SCoCAN: any table is read, or rejected with a position; an accepted one is written and read as
// the same table, and can be planned and used. Any frame is decoded or rejected, and a station
// survives it.
#include <cstdint>
#include <memory>
#include <string_view>

#include "components/fieldbus/scocan/plan/plan.hpp"
#include "components/fieldbus/scocan/station/station.hpp"
#include "tests/fuzz/driver/require.hpp"

namespace {

using namespace hal::scocan;
using hal::fuzz::require;

struct Nothing final : Events {
    void on_frame(const hal::can::Frame&, Time) noexcept override {}
    void on_event(Event, std::uint32_t, std::uint32_t, Time) noexcept override {}
};

/// Runs a node of the table for some cycles, among frames.
void use(const Table& table, const std::uint8_t* data, std::size_t size) {
    static Nothing nothing;
    const auto link = hal::can::open("sim:fuzz-scocan?bitrate=unlimited", {.own_frames = true});
    require(link.link != nullptr, "the bus opens");
    auto station =
        std::make_unique<Station>(table, size % table.nodes.size(), StationOptions{}, nothing);
    station->attach(*link.link);
    const auto other = hal::can::open("sim:fuzz-scocan");
    Time now = 1'000'000'000;
    for (int i = 0; i < 20; ++i, now += table.slot()) {
        if (size >= 12) {
            const std::size_t at = static_cast<std::size_t>(i) % (size - 11);
            hal::can::Frame f;
            f.id = static_cast<std::uint32_t>(data[at] | data[at + 1] << 8) & 0x7ff;
            f.length = data[at + 2] % 9;
            for (std::size_t k = 0; k < f.length; ++k) {
                f.data[k] = data[at + 3 + k];
            }
            other.link->send(f, now);
        }
        other.link->send(encode(Sync{true, static_cast<std::uint8_t>(i % 64), 0, 0, i % 3 == 0}),
                         now);
        station->receive(now);
        station->send({0x300, {1}}, false);
        station->transmit(now, table.slot());
    }
    require(station->waiting() <= SendQueue::capacity, "the queue is bounded");
}

void table(std::string_view text) {
    const ReadResult reading = read(text);
    for (const Report& m : reading.messages) {
        require(m.at.offset + std::size_t{m.at.length} <= text.size() + 1,
                "a place lies in the text");
        require(!m.sentence.empty(), "a message is not empty");
    }
    if (!reading.good()) return;
    const std::string form = normalised(reading.table);
    const ReadResult again = read(form);
    require(again.good() && normalised(again.table) == form,
            "the normalised form is the same table");
    require(again.table.crc == reading.table.crc, "with the same CRC");
    if (reading.table.slots > 64) {
        return;  // bounds the time of a run
    }
    for (const Mode& m : reading.table.modes) {
        const plan::Plan p = plan::plan_of(reading.table, m.number);
        require(p.latencies.size() == reading.table.messages.size(), "each message has a latency");
    }
    use(reading.table, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

void frame(const std::uint8_t* data, std::size_t size) {
    if (size < 4) return;
    hal::can::Frame f;
    f.id = static_cast<std::uint32_t>(data[1] | data[2] << 8) & 0x7ff;
    f.length = static_cast<std::uint8_t>(std::min<std::size_t>(size - 3, 8));
    for (std::size_t k = 0; k < f.length; ++k) {
        f.data[k] = data[3 + k];
    }
    if (Sync s; decode(f, s)) {
        require(f.length == 0 || s.counter < counter_cycles, "a counter is modulo 64");
    }
    if (Request r; decode(f, r)) {
        require(encode(r).same(f), "a request is written as it was read");
    }
    if (Answer a; decode(f, a)) {
        require(encode(a).same(f), "an answer too");
    }
    static const ReadResult reading =
        read("node c A sync\nnode n A\nmode 0 run\n0 sync\n1 private n 0x100\n");
    use(reading.table, data, size);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size != 0 && data[0] < 0x09) {
        frame(data, size);
    } else {
        table({reinterpret_cast<const char*>(data), size});
    }
    return 0;
}
