// SPDX-License-Identifier: MIT
#include "station_component.hpp"

namespace {

using namespace hal::scocan;

struct Scocan : StationComponent {
    explicit Scocan(const hal_host* host) : StationComponent(host, "scocan.0", {Role::node}) {}
};

}  // namespace

HAL_COMPONENT(Scocan, "scocan", "Node of a CAN bus with time slots (SCoCAN)", R"(
Divides ordinary CAN into time slots. A SYNC begins each cycle; a private slot belongs to one node,
whose message leaves at the begin of the slot without waiting for any other; all nodes share the
remaining slots by arbitration, and the private slots that are idle. A table, the same file for all
nodes, defines slots and messages:

`robot.scocan`:

    bitrate 1M
    cycle 10ms
    slots 20
    node clock A sync
    node motor A
    node panel A
    mode 0 run
    0 sync
    2 private motor 0x10A
    message position 0x10A fields a:s32,b:s32
    message lamp 0x300 node panel event 100ms fields on:u8

A complete bus in memory, also on the virtual clock:

    loadrt threads name1=bus period1=500000
    loadrt scocan_sync link=sim:robot config=robot.scocan node=clock
    loadrt scocan link=sim:robot,sim:robot config=robot.scocan node=motor,panel
    addf scocan-sync.0.receive bus
    addf scocan.0.receive bus
    addf scocan.1.receive bus
    addf scocan-sync.0.transmit bus
    addf scocan.0.transmit bus
    addf scocan.1.transmit bus

The sender of a message sets its fields, `scocan.0.position.a`; a value out of the range of its
field is limited to it. NaN and infinity keep the last valid value, which
`scocan.0.position.invalid` counts. Receivers have pins of the same names, `scocan.1.position.a`.
While `send` is true, a message with a private slot is sent in each turn of its slot, one with a
period in shared slots at that period; an event message is sent at a rising edge of `send`. Other
components send through the slots of a node by a link: `link = scocan:motor`, or
`scocan:motor?slot=3` for a certain private slot.

On a bus in memory frames start at their instant, whatever the period of the thread; a thread slower
than the turns of a slot sends its newest value again in each of them. On `can:` and `udp:` a frame
leaves in the cycle of the thread that is within its window: let the thread be several times faster
than the slots, and make `idle` and `guard` of the table longer than its wake-up latency.

A node that has lost more SYNCs than `lost` of the table sends nothing until the next one. A node
whose table differs from that of the SYNC node receives only. A node that sent 3 frames outside of
its slots within 1 s is silenced until a rising edge of `reset`. After a `stop`, or a fault that
stopped the thread, a node listens before it sends, and returns by itself. docs/scocan.md describes
everything in detail.
)")
