// SPDX-License-Identifier: MIT
#include "station_component.hpp"

namespace {

using namespace hal::scocan;

struct ScocanMonitor : StationComponent {
    explicit ScocanMonitor(const hal_host* host)
        : StationComponent(host, "scocan-monitor.0", {Role::monitor}) {
        const auto& nodes = arguments_.table.nodes;
        for (std::uint32_t i = 0; i < nodes.size(); ++i) {
            if (i != arguments_.own) {
                silences_.emplace_back(*this, i, nodes[i].name);
            }
        }
    }

    hal::Out<std::uint64_t> idle{*this, receive_, "idle", "private slots whose owner sent nothing"};
    hal::Out<std::uint64_t> announced{*this, receive_, "announced",
                                      "idle slots announced to nodes of type B"};
    hal::Out<double> load{*this, receive_, "load",
                          "share of the time in which the bus is busy, 0..1"};

    void start() {
        StationComponent::start();
        for (auto& s : silences_) {
            s.was = false;
        }
    }

private:
    /// Silences another node of the table.
    struct Silence {
        Silence(ScocanMonitor& m, std::uint32_t number, const std::string& name)
            : node(number),
              pin(m, m.transmit_, ("silence-" + name).c_str(),
                  "rising edge: node sends nothing until its reset; falling edge: it sends again") {
        }
        std::uint32_t node;
        hal::In<bool> pin;
        bool was = false;
    };

    void before_slots(std::int64_t) noexcept override {
        for (auto& s : silences_) {
            if (s.pin != s.was && station_->state() == State::running &&
                station_->request_silence(s.node, s.pin)) {
                s.was = s.pin;
            }
        }
    }
    void received() noexcept override {
        idle = station_->count().idle;
        announced = station_->count().announced;
        load = link_->statistics().load;
    }

    std::deque<Silence> silences_;
};

}  // namespace

HAL_COMPONENT(ScocanMonitor, "scocan_monitor",
              "Monitor of a CAN bus with time slots (SCoCAN): announces idle slots", R"(
Announces each private slot whose owner has not sent by the idle time of the table, by a frame with
identifier 1 and the number of the slot: nodes of type B, which cannot detect that themselves, then
share the rest of it. It counts idle slots and frames outside of their slots, and reports their
senders by the table.

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

A node that disturbs the bus is silenced by the pin `silence-NAME` of the monitor, on whichever
machine it runs; a falling edge lets it send again:

    setp scocan-monitor.0.silence-motor TRUE

Without a monitor only nodes of type A use idle slots. Otherwise the node is one like any other, see
`hal doc scocan`.
)")
