// SPDX-License-Identifier: MIT
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "fault_list.hpp"
#include "hal/component.hpp"
#include "link/can.hpp"
#include "link/simulation.hpp"

namespace {

using namespace hal::can;

constexpr hal::faults::Named<Fault> can_fault_names[] = {{"error", Fault::error},
                                                         {"loss", Fault::loss},
                                                         {"duplicate", Fault::duplicate},
                                                         {"delay", Fault::delay}};

/// "error:id=0x10A:from=1s:until=2s".
Disturbance parse_can_fault(std::string_view part) {
    return hal::faults::parse(
        part, can_fault_names, Disturbance{.delay_ns = 20'000},
        "write error, loss, duplicate or delay, with options "
        ":id=0x10A:every=50:probability=0.02:count=3:from=1s:until=2s:time=20us",
        [&](Disturbance& d, std::string_view key, std::string_view value) {
        if (key != "id") return false;
        d.id = static_cast<std::uint32_t>(hal::faults::count(part, value, 0x1fffffff));

        d.mask = 0x1fffffff;
        return true;
    });
}

struct CanFaults final : hal::Component {
    using Component::Component;

    hal::TextArgument link{*this, "link", "sim:can0", "bus in memory, sim:NAME"};
    hal::TextArgument faults{
        *this, "faults", "",
        "faults, comma-separated: error:id=0x10A:from=1s:until=2s,loss:every=50"};
    const std::vector<Disturbance> list = hal::faults::parse_list(faults.get(), parse_can_fault);
    hal::Argument seed{*this, "seed", 1, "seed of random faults", {.min = 0, .max = 1'000'000'000}};
    hal::Argument victim{*this,
                         "victim",
                         0,
                         "node whose wire `cut` cuts: its number on the bus, in the order in which "
                         "links were opened",
                         {.min = 0, .max = 63}};

    hal::Function run{*this, "update", &CanFaults::update,
                      "cuts and reconnects a wire, babbles, counts faults"};

    hal::In<bool> cut{*this, "cut", "TRUE: the wire of node `victim` is cut"};
    hal::In<bool> bus_off{*this, "bus-off",
                          "rising edge: the next error of node `victim` takes it off the bus"};
    hal::In<bool> babble{*this, "babble", "TRUE: a node of its own sends `babble-id` at any time"};
    hal::Param<std::uint32_t> babble_id{
        *this, "babble-id", "identifier of babbled frames", {.initial = 0x150}};
    hal::Param<std::uint32_t> babble_period{
        *this, "babble-period", "interval between babbled frames", {.initial = 300, .unit = "us"}};
    hal::Outs<std::uint64_t> hits{*this, "hits-#", static_cast<std::int64_t>(list.size()),
                                  "frames affected by this fault of the list"};

    void start() {
        auto opened = open(link.get());
        if (!opened) throw std::runtime_error(opened.problem);
        if (opened.link->simulation() == nullptr) {
            throw std::runtime_error(link.get() + " is not a bus in memory; write sim:NAME");
        }
        link_ = std::move(opened.link);
        auto& bus = *link_->simulation();
        bus.seed(static_cast<std::uint64_t>(seed));
        for (const auto& d : list) {
            numbers_.push_back(bus.disturb(d));
        }
    }
    void stop() noexcept {
        if (link_) {
            link_->simulation()->calm();
        }
        link_.reset();
        numbers_.clear();
        was_cut_ = was_babbling_ = was_off_ = false;
    }

    void update(hal::Cycle cycle) noexcept {
        if (!link_) return;
        for (Frame f; link_->receive(f, cycle.start_ns());) {
        }
        auto& bus = *link_->simulation();
        if (cut != was_cut_) {
            bus.cut(static_cast<int>(victim), was_cut_ = cut);
        }
        if (bus_off && !was_off_) {
            bus.set_counters(static_cast<int>(victim), 255, 0);
        }
        was_off_ = bus_off;
        if (babble != was_babbling_) {
            was_babbling_ = babble;
            bus.babble({babble_id & 0x7ffU, {0x55}},
                       was_babbling_ ? std::int64_t{babble_period} * 1000 : 0);
        }
        for (std::size_t n = 0; n < numbers_.size(); ++n) {
            hits[n] = bus.hits(numbers_[n]);
        }
    }

private:
    std::unique_ptr<Link> link_;
    std::vector<int> numbers_;
    bool was_cut_ = false;
    bool was_babbling_ = false;
    bool was_off_ = false;
};

}  // namespace

HAL_COMPONENT(CanFaults, "can_faults", "Fault injection on a CAN bus in memory", R"(
Destroys, loses, duplicates or delays frames of a `sim:` bus, cuts a wire, or babbles: on the clock
of the threads, reproducibly.

`faults` is a comma-separated list of error (destroyed by an error frame), loss (acknowledged, but
not received), duplicate (the sender missed the acknowledgement) and delay (in the sender's
controller), each with options: `id=0x10A` (this identifier only), `every=50` (every 50th frame;
default every frame), `probability=0.02` (random frames, the same ones for the same `seed`),
`count=3` (ends after 3 frames), `from=1s`, `until=2s`, `time=20us` (delay).

    loadrt can_faults link=sim:robot faults=error:id=0:from=1s:until=1.1s,delay:id=0:time=60us:count=1
    addf can-faults.0.update bus
)")
