// SPDX-License-Identifier: MIT
#include "station_component.hpp"

namespace {

using namespace hal::scocan;

struct ScocanSync : StationComponent {
    explicit ScocanSync(const hal_host* host)
        : StationComponent(host, "scocan-sync.0", {Role::sync, Role::backup}) {}

    hal::In<std::uint32_t> mode_command{*this, transmit_, "mode-command",
                                        "a new value asks all nodes to change to this mode"};
    hal::Out<bool> leading{*this, receive_, "leading", "this node sends the SYNC", {.safe = false}};
    hal::Out<bool> changing{*this, receive_, "changing", "a mode change is being prepared"};
    hal::Out<std::uint32_t> refused{*this, receive_, "changes-refused",
                                    "mode changes that were cancelled"};

private:
    void received() noexcept override {
        leading = station_->leading();
        changing = station_->changing();
        refused = refusals_;
    }
    void before_slots(std::int64_t) noexcept override {
        const std::uint32_t wanted = mode_command;
        if (wanted == commanded_) return;
        // asks when that is over
        if (station_->changing() || (station_->state() == State::listening)) return;
        commanded_ = wanted;
        if (station_->leading() && wanted != station_->mode() && !station_->change_mode(wanted)) {
            on_event(Event::mode_refused, static_cast<std::uint32_t>(station_->node()), wanted,
                     static_cast<Time>(Answer::Reason::unknown_mode));
        }
    }
    void on_event(Event e, std::uint32_t who, std::uint32_t id, Time value) noexcept override {
        if (e == Event::mode_refused) {
            ++refusals_;
        }
        StationComponent::on_event(e, who, id, value);
    }

    std::uint32_t commanded_ = 0;
    std::uint32_t refusals_ = 0;
};

}  // namespace

HAL_COMPONENT(ScocanSync, "scocan_sync",
              "SYNC node of a CAN bus with time slots (SCoCAN), or its backup", R"(
Sends the SYNC that begins each cycle. The node with the role `sync` in the table is the primary; a
`backup K` sends it K offsets later in each cycle in which no SYNC came, so that no cycle passes
without one. A primary first listens for 3 cycles; when it returns, it takes over from the backup at
a cycle whose counter is a multiple of 8. A primary that hears another one is on standby until that
one is lost.

`robot.scocan`:

    node clock A sync
    node spare A backup 1
    node motor A
    mode 0 run
    0 sync
    2 private motor 0x10A

The netlist:

    loadrt scocan_sync link=sim:robot,sim:robot config=robot.scocan node=clock,spare
    addf scocan-sync.0.receive bus
    addf scocan-sync.1.receive bus
    addf scocan-sync.0.transmit bus
    addf scocan-sync.1.transmit bus

A new value of `mode-command` changes the mode: all nodes of the table are asked to prepare, and
when all have answered, all switch at the same cycle. If a node does not answer, the change is
cancelled and the node reported. Otherwise the node is one like any other, see `hal doc scocan`.
)")
