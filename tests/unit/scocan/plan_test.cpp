// SPDX-License-Identifier: MIT
// No simulated latency exceeds the computed one: random message sets on the bus in memory.
#include <map>
#include <random>

#include "bus.hpp"
#include "components/fieldbus/scocan/plan/plan.hpp"

namespace {

using namespace hal::scocan;
using namespace hal::scocan::test;

struct Sent {
    Time queued = 0, worst = 0;
    std::size_t count = 0;
};

/// Returns a table of four nodes with random private slots and shared messages.
std::string random_table(std::mt19937& random) {
    const auto from = [&](unsigned low, unsigned high) { return low + static_cast<unsigned>(random() % (high - low + 1)); };
    std::string text = "cycle 10ms\nslots 20\nnode clock A sync\nnode a B\nnode b B\nnode c B\nmode 0 run\n0 sync\n", messages;
    for (unsigned slot = 1; slot < 20; ++slot)
        if (from(0, 2) == 0) text += std::to_string(slot) + " private " + "abc"[from(0, 2)] + " " + id_text(0x100 + slot) + "\n";
    const unsigned count = from(3, 12);
    for (unsigned i = 0; i < count; ++i)
        messages += "message m" + std::to_string(i) + " " + id_text(0x300 + i * 3) + " node " + "abc"[from(0, 2)] + " bytes " +
                    std::to_string(from(0, 8)) + " event " + std::to_string(from(4, 60)) + "ms\n";
    return text + messages;
}

TEST(Plan, is_never_exceeded_by_the_simulation) {
    std::mt19937 random(20061126);
    std::size_t observed = 0, close = 0;
    for (int round = 0; round < 40; ++round) {
        const std::string text = random_table(random);
        Bus bus(text.c_str(), "scocan-plan");
        const plan::Plan p = plan::plan_of(bus.table, 0);
        bus.add("clock");
        std::map<std::string, Member*> members;
        for (const char* name : {"a", "b", "c"}) members[name] = &bus.add(name);
        bus.run(100 * ms);
        std::map<std::uint32_t, Sent> all;
        std::map<std::uint32_t, Time> next;
        const Time begin = bus.now;
        for (const Message& m : bus.table.messages)
            next[m.id] = begin + 500 * us * static_cast<Time>(random() % 40);  // some of them together
        bus.wire.clear();
        bus.run(1000 * ms, 500 * us, [&] {
            for (const Seen& s : bus.wire) {
                const auto found = all.find(s.frame.id);
                if (found == all.end() || found->second.queued == 0) continue;
                const Time end = s.begin + bus.table.bits(hal::can::frame_bits(s.frame).nominal);
                found->second.worst = std::max(found->second.worst, end - found->second.queued);
                found->second.queued = 0, ++found->second.count;
            }
            bus.wire.clear();
            for (const Message& m : bus.table.messages) {
                if (bus.now < next[m.id]) continue;
                next[m.id] += m.period;
                hal::can::Frame f;
                f.id = m.id, f.length = static_cast<std::uint8_t>(m.bytes);
                EXPECT_EQ(hal::can::Sent::queued, members[bus.table.nodes[m.node].name]->station.send(f, false));
                if (all[m.id].queued == 0) all[m.id].queued = bus.now;
            }
        });
        for (const plan::Latency& l : p.latencies) {
            const Sent& s = all[bus.table.messages[l.message].id];
            if (l.worst < 0) continue;
            observed += s.count;
            EXPECT_LE(s.worst, l.worst) << text << bus.table.messages[l.message].name;
            close += s.worst * 2 > l.worst;
        }
    }
    EXPECT_GT(observed, 5000U);
    EXPECT_GT(close, 40U) << "the bound is not far off";
}

}  // namespace
