// SPDX-License-Identifier: MIT
#include "ethercat/plugins/lcec_pins.hpp"
#include "ethercat/plugins/master_component.hpp"

namespace {

struct Names {
    using BusPins = hal::ethercat::LcecBusPins;
    using SlavePins = hal::ethercat::LcecSlavePins;
    static constexpr const char *own = "lcec.0", *receive = "read-all", *transmit = "write-all",
                                *file = "ethercat-conf.xml";
    static constexpr bool shared = true;
    static std::string function(const std::string&, const char* name) {
        return std::string("lcec.") + name;
    }
};
using Lcec = hal::ethercat::MasterComponent<Names>;

}  // namespace

HAL_COMPONENT(Lcec, "lcec", "EtherCAT master with the names of LinuxCNC's lcec", R"(
The component `ethercat` with the pins and functions of the lcec component, for netlists that exist.

`ethercat-conf.xml`:

    <masters>
      <master idx="0" appTimePeriod="1000000" refClockSyncCycles="-1">
        <slave idx="0" type="basic_cia402" vid="00ffffff" pid="04020001" name="x">
          <dcConf assignActivate="300" sync0Cycle="*1"/>
          <modParam name="enableCSP" value="true"/>
        </slave>
      </master>
    </masters>

The netlist, with an emulated drive. On a machine the first line and the last `addf` are left out:

    loadrt ethercat_segment devices="servo" link=sim:drives
    loadusr -W lcec_conf ethercat-conf.xml
    loadrt lcec link=sim:drives
    addf lcec.read-all servo-thread
    addf lcec.write-all servo-thread
    addf ethercat-segment.0.update servo-thread
    net x-status lcec.0.x.srv-cia-statusword

`lcec.N.read` and `lcec.N.write` are the same for one master. `initf lcec.activate` has no effect:
the masters start with the machine.

Without `link=`, the interface of a master is `MASTER0_DEVICE` of the file `ethercat.conf` beside
`ethercat-conf.xml`, or else of `/etc/ethercat.conf`, the file of the IgH master: a MAC address, an
interface (`enp3s0`) or a link address (`eth:enp3s0`, `sim:NAME`). `MASTER0_BACKUP` closes a ring.
Without `loadusr lcec_conf`, the file is `config=`, or `ethercat-conf.xml` beside the netlist.

With several masters in the file there is an instance for each, `lcec.0`, `lcec.1`; `link=` is then
a list. A master that has a name in the file needs it as the name of its instance:
`names=lcec.NAME master=0`.

The elements that are read, and the differences to lcec, are in docs/ethercat-configuration.md.

EtherCAT is a registered trademark and patented technology, licensed by Beckhoff Automation GmbH,
Germany.
)")
