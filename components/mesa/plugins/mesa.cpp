// SPDX-License-Identifier: MIT
#include "mesa_component.hpp"

namespace {

constexpr hal::mesa::MesaNames mesa_names{
    "board",
    "address of the card: eth:10.10.10.10, or sim:NAME of an emulated one; a list makes an "
    "instance of each",
    "mesa board=eth:10.10.10.10", false};
using Mesa = hal::mesa::MesaComponent<mesa_names>;

}  // namespace

HAL_COMPONENT(Mesa, "mesa", "Mesa Ethernet cards (7I92, 7I96, 7I96S, 7I76E, 7I95, 7I97), HostMot2",
              R"(
Drives a Mesa card with HostMot2 firmware over Ethernet, with the pins, parameters and functions of LinuxCNC's hm2_eth. It needs no privileges and changes no
firewall. The instance is named after the card, `hm2_7i76e.0`. Its pins depend on the firmware and on `config=`. With an emulated card:

`mill.mesa`:

    [card]
    type = 7i76e
    address = sim:mill

    [motor x]
    stepgen = 0
    scale = 400

The netlist:

    loadrt mesa_card config=mill.mesa
    loadrt mesa board=sim:mill config="num_stepgens=3 num_encoders=1"
    addf hm2_7i76e.0.read servo-thread
    addf hm2_7i76e.0.write servo-thread
    addf mesa-card.0 servo-thread
    setp hm2_7i76e.0.stepgen.00.position-scale 400

A real card is `board=eth:10.10.10.10`, and the emulated one is left out. An existing netlist of LinuxCNC runs unchanged: `loadrt --native hostmot2` and
`loadrt --native hm2_eth board_ip=10.10.10.10 config="…"` load this driver, `loadrt --linuxcnc hm2_eth` that of LinuxCNC.

`write` sends commands and the request for the next cycle in one datagram, and `read` takes the answer one cycle later, without waiting. Positions of step
generators are advanced to the present by the rates that the card has. With `read-request` in the same thread, values are read in the same cycle: put it
first, other functions behind it, then `read`.

A lost datagram costs the data of one cycle and is counted in `lost-requests`; step generators go on at their last rates. After more than `hold-cycles` cycles
without an answer the card is lost: `online` is FALSE, a fault is recorded, and the card switches its outputs off by its own watchdog, within
`watchdog.timeout_ns`. Until then motors may run: `velocity-fb` is the last velocity, and `position-valid` FALSE. A card that answers again is configured and runs
within a few cycles. Where the motor may not have followed, `stepgen.NN.position-valid` is FALSE, and the step generator stands until its `enable` was FALSE. When
the watchdog bites although the card is there, because a thread was too late, outputs stay off until `watchdog.has_bit` is set to FALSE; a loss or a reset of the
card, `stop` and `reload` do not end that.

`clock=card` lets all threads follow the DPLL of the card. Not supported are SSI, BiSS, Fanuc and resolver inputs, UARTs, RC PWM and table-driven steps; a firmware with such
modules is accepted, and they are named when it is loaded.
)")
