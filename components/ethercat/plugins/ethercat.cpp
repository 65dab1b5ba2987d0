// SPDX-License-Identifier: MIT
#include "ethercat/plugins/bus_pins.hpp"
#include "ethercat/plugins/master_component.hpp"

namespace {

struct Names {
    using BusPins = hal::ethercat::BusPins;
    using SlavePins = hal::ethercat::SlavePins;
    static constexpr const char *own = "ethercat.0", *receive = "receive", *transmit = "transmit",
                                *file = "";
    static constexpr bool shared = false;
    static std::string function(const std::string& instance, const char* name) {
        return instance + "." + name;
    }
};
using Ethercat = hal::ethercat::MasterComponent<Names>;

}  // namespace

HAL_COMPONENT(Ethercat, "ethercat", "EtherCAT master: process data of slaves as pins", R"(
Brings the slaves of a bus to OP and exchanges their process data in every cycle. A configuration
file beside the netlist lists the slaves and the objects that become pins
(docs/ethercat-configuration.md). LinuxCNC's `ethercat-conf.xml` is read as well; one instance
drives one of its masters.

`machine.ethercat`:

    [bus]
    link  = sim:machine        # eth:enp3s0 on a machine
    cycle = 1ms
    [slave 0 x]
    vendor  = 0x00ffffff
    device  = cia402
    outputs = 6040 607A
    inputs  = 6041 6064
    dc      = sync0

The netlist, with an emulated drive:

    loadrt ethercat_segment devices="servo" link=sim:machine
    loadrt ethercat config=machine.ethercat
    addf ethercat.0.receive servo-thread
    addf ethercat.0.transmit servo-thread
    addf ethercat-segment.0.update servo-thread
    net x-status ethercat.0.x.statusword

`receive` belongs to the beginning of the thread, `transmit` to its end; the period of the thread is
the cycle. Slaves are started in parallel, while others already exchange data; one that was lost is
started again. The outputs of a slave are off outside of OP. It switches them on, with the values of
their pins, when it enters OP; the master reads that state up to 10 ms later, and only then is
`operational` TRUE. Outputs must be valid before that, as with other masters. Inputs keep their last
values while `operational` is FALSE.

`operational` is also FALSE while the process data of a slave in OP is not exchanged for 30 cycles
and 30 ms, although the slave answers: its frames return later than the next cycle (or
`frame-timeout`), or with a working counter that is too small. A fault names the reason. Its inputs
keep their last values, its outputs may still arrive. It is operational again after as many good
cycles.

With `dc` in the configuration the threads of this machine follow the reference clock, unless
`clock = thread` is written there. `pll-err` is the remaining error.

At the end, on `stop` and when a fault stops the thread, the slaves leave OP at once: their outputs
are off, and `operational` is FALSE. When the thread runs again they are started again; an axis
needs another edge of its `enable`.

EtherCAT is a registered trademark and patented technology, licensed by Beckhoff Automation GmbH,
Germany.
)")
