// SPDX-License-Identifier: MIT
#include <memory>
#include <stdexcept>

#include "fault_list.hpp"
#include "hal/component.hpp"
#include "link/segment.hpp"
#include "text/find_row.hpp"

namespace {

using namespace hal::ethernet;

constexpr hal::faults::Named<Fault> segment_fault_names[] = {
    {"loss", Fault::loss}, {"duplicate", Fault::duplicate}, {"delay", Fault::delay},
    {"cut", Fault::cut},   {"garble", Fault::garble},
};

/// Frames of TDMA 2.1a, by the identifier behind its version (RTnet, Documentation/TDMA).
struct Kind {
    std::string_view name;
    std::uint16_t id;
};
constexpr Kind kinds[] = {{"sync", 0x0000}, {"request", 0x0010}, {"reply", 0x0011}};
constexpr std::uint16_t kind_at = 20;
const Kind* kind_of(std::string_view name) { return hal::find_row(kinds, name, &Kind::name); }

/// "loss:every=50:from=1s:until=2s".
Disturbance parse_segment_fault(std::string_view part) {
    return hal::faults::parse(part, segment_fault_names,
                              Disturbance{.delay_ns = 1'000'000, .length = 30},
                              "write loss, duplicate, delay, cut or garble, with options "
                              ":every=50:probability=0.02:count=3:from=1s:until=2s:type=0x9023:"
                              "frame=reply:time=2ms:length=30",
                              [&](Disturbance& d, std::string_view key, std::string_view value) {
        if (key == "length") {
            d.length = static_cast<std::size_t>(hal::faults::count(part, value, 1'000'000));
        } else if (key == "type" && value == "0x9021") {
            d.type = 0x9021;
        } else if (key == "type" && value == "0x9022") {
            d.type = 0x9022;
        } else if (key == "type" && value == "0x9023") {
            d.type = 0x9023;
        } else if (const auto* kind = kind_of(key == "frame" ? value : ""); kind != nullptr) {
            d.type = 0x9021;
            d.at = kind_at;
            d.is = kind->id;
        } else {
            return false;
        }
        return true;
    });
}

struct SegmentFaults final : hal::Component {
    using Component::Component;

    hal::TextArgument link{*this, "link", "sim:net0/tester",
                           "segment, with a station of its own, or the station whose cable is cut, "
                           "for example sim:cnc/x"};
    hal::TextArgument faults{
        *this, "faults", "",
        "faults, comma-separated: loss:every=50:from=1s:until=2s,duplicate:every=7"};
    const std::vector<Disturbance> list =
        hal::faults::parse_list(faults.get(), parse_segment_fault);
    hal::Argument seed{*this, "seed", 1, "seed of random faults", {.min = 0, .max = 1'000'000'000}};

    hal::Function run{*this, "update", &SegmentFaults::update,
                      "cuts and reconnects the cable, babbles, counts faults"};

    hal::In<bool> cut{*this, "cut", "TRUE: the cable of the station in `link` is cut"};
    hal::In<bool> babble{*this, "babble",
                         "TRUE: the station in `link` babbles: it broadcasts frames of Ethertype "
                         "0x9023 at any time"};
    hal::Param<std::uint32_t> babble_period{
        *this, "babble-period", "interval between babbled frames", {.initial = 100, .unit = "us"}};
    hal::Outs<std::uint64_t> hits{*this, "hits-#", static_cast<std::int64_t>(list.size()),
                                  "frames affected by this fault of the list"};

    void start() {
        // an unused Ethertype: receives nothing
        auto opened = hal::ethernet::open(link.get(), {.types = {0x88b5}});
        if (!opened) throw std::runtime_error(opened.problem);
        if (opened.port->segment() == nullptr) {
            throw std::runtime_error(link.get() +
                                     " is not a segment in memory; write sim:NAME/STATION");
        }
        port_ = std::move(opened.port);
        auto& segment = *port_->segment();
        segment.seed(static_cast<std::uint64_t>(seed));
        for (const auto& d : list) {
            numbers_.push_back(segment.disturb(d));
        }
        babbled_.fill(0);
        std::fill_n(babbled_.begin(), 6, std::uint8_t{0xff});
        std::copy_n(port_->address().begin(), 6, babbled_.begin() + 6);
        babbled_[12] = 0x90;
        babbled_[13] = 0x23;
        segment.babble(segment.port(), babbled_, 0);  // allocates its memory
    }
    void stop() noexcept {
        if (port_) {
            port_->segment()->calm();
        }
        port_.reset();
        numbers_.clear();
        was_cut_ = was_babbling_ = false;
    }

    void update(hal::Cycle) noexcept {
        if (!port_) return;
        auto& segment = *port_->segment();
        if (cut != was_cut_) {
            segment.cut(segment.port(), was_cut_ = cut);
        }
        if (babble != was_babbling_) {
            was_babbling_ = babble;
            segment.babble(segment.port(), babbled_,
                           was_babbling_ ? std::int64_t{babble_period} * 1000 : 0);
        }
        for (std::size_t n = 0; n < numbers_.size(); ++n) {
            hits[n] = segment.hits(numbers_[n]);
        }
    }

private:
    std::unique_ptr<Port> port_;
    std::vector<int> numbers_;
    bool was_cut_ = false;
    bool was_babbling_ = false;
    std::array<std::uint8_t, smallest_frame> babbled_{};
};

}  // namespace

HAL_COMPONENT(SegmentFaults, "segment_faults", "Fault injection on an Ethernet segment in memory",
              R"(
Loses, duplicates, delays, truncates or corrupts frames of a `sim:` segment, or cuts a cable: on the
clock of the threads, reproducibly.

`faults` is a comma-separated list of loss, duplicate, delay, cut (truncates) and garble (corrupts),
each with options: `every=50` (every 50th frame; default every frame), `probability=0.02` (random
frames, the same ones for the same `seed`), `count=3` (ends after 3 frames), `from=1s`, `until=2s`,
`type=0x9023` (this Ethertype only), `frame=reply` (TDMA sync, request or reply only), `time=2ms`
(delay), `length=30` (cut: remaining bytes). A garbled frame has a valid Ethernet checksum, like one
from a hostile station.

The station in `link` can also babble: while `babble` is TRUE it sends a frame every
`babble-period`, outside any slot.

    loadrt segment_faults link=sim:net0/tester faults=loss:every=50:from=1s:until=2s,garble:every=7:type=0x9023
    addf segment-faults.0.update servo
    start
)")
