// SPDX-License-Identifier: MIT
#include "ethercat/plugins/lcec_pins.hpp"
#include "ethercat/plugins/master_component.hpp"

namespace {

struct Names {
    using BusPins = hal::ethercat::LcecBusPins;
    using SlavePins = hal::ethercat::LcecSlavePins;
    static constexpr const char *own = "lcec.0", *receive = "read-all", *transmit = "write-all", *file = "ethercat-conf.xml";
    static constexpr bool        shared = true;
    static std::string           function(const std::string&, const char* name) { return std::string("lcec.") + name; }
};
using Lcec = hal::ethercat::MasterComponent<Names>;

}  // namespace

HAL_COMPONENT(Lcec, "lcec", "EtherCAT master with the names of LinuxCNC's lcec", R"(
The component `ethercat` with the pins and functions of the lcec component, for netlists that exist. It reads `ethercat-conf.xml` beside the netlist, or
the file of `config=`: the pins of a slave are `lcec.MASTER.SLAVE.PIN`.

`ethercat-conf.xml`:

    <masters>
      <master idx="0" appTimePeriod="1000000" refClockSyncCycles="-1">
        <slave idx="0" type="basic_cia402" vid="00ffffff" pid="04020001" name="x">
          <dcConf assignActivate="300" sync0Cycle="*1"/>
          <modParam name="enableCSP" value="true"/>
        </slave>
      </master>
    </masters>

The netlist, with an emulated drive; `link=eth:enp3s0` is the interface of a machine. It replaces `loadusr -W lcec_conf ethercat-conf.xml`.

    loadrt ethercat_segment devices="servo" link=sim:drives
    loadrt lcec link=sim:drives
    addf lcec.read-all servo-thread
    addf lcec.write-all servo-thread
    addf ethercat-segment.0.update servo-thread
    net x-status lcec.0.x.srv-cia-statusword

With several masters in the file: `loadrt lcec count=2 master=0,1 link=eth:enp3s0,eth:enp4s0`; a master that has a name in the file needs it as the
name of its instance: `names=lcec.NAME`.

The elements that are read, and the differences to lcec, are in docs/ethercat-configuration.md. There is no `lcec_conf` program, and no `lcec.0.read` and
`lcec.0.write`: `read-all` and `write-all` serve all masters.

EtherCAT is a registered trademark and patented technology, licensed by Beckhoff Automation GmbH, Germany.
)")
