// SPDX-License-Identifier: MIT
#include "mesa_component.hpp"

namespace {

constexpr hal::mesa::MesaNames hm2_eth_names{
    "board_ip",
    "address of the card, 10.10.10.10, or sim:NAME of an emulated one; a list makes an instance "
    "of each",
    "hm2_eth board_ip=10.10.10.10", true};
using Hm2Eth = hal::mesa::MesaComponent<hm2_eth_names>;

}  // namespace

HAL_COMPONENT(Hm2Eth, "hm2_eth", "Mesa Ethernet cards, with the load arguments of LinuxCNC", R"(
The component `mesa` for netlists of LinuxCNC, which load it by its name there. With an emulated card:

`mill.mesa`:

    [card]
    type = 7i76e
    address = sim:mill

The netlist:

    loadrt --native hostmot2
    loadrt mesa_card config=mill.mesa
    loadrt --native hm2_eth board_ip=sim:mill config="num_stepgens=3 num_encoders=1"
    addf hm2_7i76e.0.read servo-thread
    addf hm2_7i76e.0.write servo-thread
    addf mesa-card.0 servo-thread

Where LinuxCNC is not installed, `--native` may be left out. `hal doc mesa` describes the driver.
)")
