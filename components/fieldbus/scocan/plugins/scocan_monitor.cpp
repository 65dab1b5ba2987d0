// SPDX-License-Identifier: MIT
#include "station_component.hpp"

namespace {

using namespace hal::scocan;

struct ScocanMonitor : StationComponent {
    explicit ScocanMonitor(const hal_host* host) : StationComponent(host, "scocan-monitor.0", {Role::monitor}) {}

    hal::Out<std::uint64_t> idle{*this, receive_, "idle", "private slots whose owner sent nothing"};
    hal::Out<std::uint64_t> announced{*this, receive_, "announced", "idle slots announced to nodes of type B"};
    hal::Out<double>        load{*this, receive_, "load", "share of the time in which the bus is busy, 0..1"};

private:
    void received() noexcept override {
        idle = station_->count().idle;
        announced = station_->count().announced;
        load = link_->statistics().load;
    }
};

}  // namespace

HAL_COMPONENT(ScocanMonitor, "scocan_monitor", "Monitor of a CAN bus with time slots (SCoCAN): announces idle slots", R"(
Announces each private slot whose owner has not sent by the idle time of the table, by a frame with identifier 1 and the number of the slot: nodes of type B,
which cannot detect that themselves, then share the rest of it. It counts idle slots and frames outside of their slots, and reports their senders by the table.

`robot.scocan`:

    node clock A sync
    node motor A
    node watch B monitor
    mode 0 run
    0 sync
    2 private motor 0x10A

The netlist:

    loadrt scocan_monitor link=sim:robot config=robot.scocan node=watch
    addf scocan-monitor.0.receive bus
    addf scocan-monitor.0.transmit bus

Without a monitor only nodes of type A use idle slots. Otherwise the node is one like any other, see `hal doc scocan`.
)")
