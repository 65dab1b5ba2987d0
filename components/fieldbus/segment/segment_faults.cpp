// SPDX-License-Identifier: MIT
#include <charconv>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "hal/component.hpp"
#include "link/segment.hpp"

namespace {

using namespace hal::ethernet;

struct Row {
    const char* name;
    Fault       fault;
};
constexpr Row rows[] = {
    {"loss", Fault::loss}, {"duplicate", Fault::duplicate}, {"delay", Fault::delay}, {"cut", Fault::cut}, {"garble", Fault::garble},
};

/// Frames of TDMA 2.1a, by the identifier behind its version (RTnet, Documentation/TDMA).
struct Kind {
    std::string_view name;
    std::uint16_t    id;
};
constexpr Kind          kinds[] = {{"sync", 0x0000}, {"request", 0x0010}, {"reply", 0x0011}};
constexpr std::uint16_t kind_at = 20;
const Kind*             kind_of(std::string_view name) {
    for (const auto& kind : kinds)
        if (kind.name == name) return &kind;
    return nullptr;
}

[[noreturn]] void refuse(const std::string& part, const std::string& help) {
    throw std::invalid_argument("'" + part + "' is no fault of a segment; " + help);
}

double number(const std::string& part, std::string_view text, const char*& unit) {
    double value = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (wrong != std::errc{} || !(value >= 0.0 && value < 1e9)) refuse(part, "'" + std::string(text) + "' is no number");
    unit = end;
    return value;
}

double number(const std::string& part, std::string_view text) {
    const char*  end = nullptr;
    const double value = number(part, text, end);
    if (end != text.data() + text.size()) refuse(part, "'" + std::string(text) + "' is no number");
    return value;
}

/// 1s, 20ms, 500us.
std::int64_t duration(const std::string& part, std::string_view text) {
    const char*            end = nullptr;
    const double           value = number(part, text, end);
    const std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
    const double           scale = unit == "s" ? 1e9 : unit == "ms" ? 1e6 : unit == "us" ? 1e3 : unit == "ns" ? 1.0 : 0.0;
    if (scale == 0.0) refuse(part, "'" + std::string(text) + "' is no time; write 20ms");
    return std::llround(value * scale);
}

/// "loss:every=50:from=1s:until=2s".
Disturbance parse(const std::string& part) {
    const char* help =
        "write loss, duplicate, delay, cut or garble, and behind it "
        ":every=50:probability=0.02:count=3:from=1s:until=2s:type=0x9023:frame=reply:time=2ms:length=30";
    std::string_view rest(part);
    const auto       word = rest.substr(0, rest.find(':'));
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
    Disturbance d;
    bool        known = false;
    for (const auto& row : rows)
        if (word == row.name) d.fault = row.fault, known = true;
    if (!known) refuse(part, help);
    d.every = 1, d.delay_ns = 1'000'000, d.length = 30;
    while (!rest.empty()) {
        const auto item = rest.substr(0, rest.find(':'));
        rest.remove_prefix(std::min(item.size() + 1, rest.size()));
        const auto equals = std::min(item.find('='), item.size());
        const auto key = item.substr(0, equals), value = item.substr(std::min(equals + 1, item.size()));
        if (key == "from") d.from_ns = duration(part, value);
        else if (key == "until") d.until_ns = duration(part, value);
        else if (key == "time") d.delay_ns = duration(part, value);
        else if (key == "every") d.every = static_cast<std::uint32_t>(number(part, value));
        else if (key == "probability") d.probability = number(part, value), d.every = 0;
        else if (key == "count") d.count = static_cast<std::uint64_t>(number(part, value));
        else if (key == "length") d.length = static_cast<std::size_t>(number(part, value));
        else if (key == "type" && value == "0x9021") d.type = 0x9021;
        else if (key == "type" && value == "0x9022") d.type = 0x9022;
        else if (key == "type" && value == "0x9023") d.type = 0x9023;
        else if (const auto* kind = kind_of(key == "frame" ? value : ""); kind != nullptr) d.type = 0x9021, d.at = kind_at, d.is = kind->id;
        else refuse(part, help);
    }
    if (d.every == 0 && d.probability == 0.0) refuse(part, "every counts from 1, and a probability is above 0");
    if (d.probability > 1.0) refuse(part, "a probability is 1 at most");
    return d;
}

std::vector<Disturbance> parse_all(std::string_view text) {
    std::vector<Disturbance> all;
    while (!text.empty()) {
        const auto part = text.substr(0, text.find(','));
        text.remove_prefix(std::min(part.size() + 1, text.size()));
        all.push_back(parse(std::string(part)));
    }
    if (all.size() > 32) throw std::invalid_argument("more than 32 faults");
    return all;
}

struct SegmentFaults final : hal::Component {
    using Component::Component;

    hal::TextArgument link{*this, "link", "sim:net0/tester",
                           "the segment; a station of its own on it, or one whose cable is to be cut, as in sim:cnc/x"};
    hal::TextArgument faults{*this, "faults", "", "what goes wrong, by commas: loss:every=50:from=1s:until=2s,duplicate:every=7"};
    const std::vector<Disturbance> list = parse_all(faults.get());
    hal::Argument                  seed{*this, "seed", 1, "of what is drawn", {.min = 0, .max = 1'000'000'000}};

    hal::Function run{*this, "update", &SegmentFaults::update, "cuts and joins the cable, babbles, shows how often faults struck"};

    hal::In<bool> cut{*this, "cut", "true: the cable of the station `link` names is cut"};
    hal::In<bool> babble{*this, "babble", "true: the station `link` names sends without asking anybody, broadcasts of Ethertype 0x9023"};
    hal::Param<std::uint32_t> babble_period{*this, "babble-period", "between two frames that are babbled", {.initial = 100, .unit = "us"}};
    hal::Outs<std::uint64_t>  hits{*this, "hits-#", static_cast<std::int64_t>(list.size()), "frames that fault # of the list has struck"};

    void start() {
        auto opened = hal::ethernet::open(link.get(), {.types = {0x88b5}});  // of none that anybody uses here: it receives nothing
        if (!opened) throw std::runtime_error(opened.problem);
        if (opened.port->segment() == nullptr) throw std::runtime_error(link.get() + " is no segment in memory; write sim:NAME/STATION");
        port_ = std::move(opened.port);
        auto& segment = *port_->segment();
        segment.seed(static_cast<std::uint64_t>(seed));
        for (const auto& d : list) numbers_.push_back(segment.disturb(d));
        babbled_.fill(0);
        std::fill_n(babbled_.begin(), 6, std::uint8_t{0xff});
        std::copy_n(port_->address().begin(), 6, babbled_.begin() + 6);
        babbled_[12] = 0x90, babbled_[13] = 0x23;
        segment.babble(segment.port(), babbled_, 0);  // takes its memory
    }
    void stop() noexcept {
        if (port_) port_->segment()->calm();
        port_.reset();
        numbers_.clear();
        was_cut_ = was_babbling_ = false;
    }

    void update(hal::Cycle) noexcept {
        if (!port_) return;
        auto& segment = *port_->segment();
        if (cut != was_cut_) segment.cut(segment.port(), was_cut_ = cut);
        if (babble != was_babbling_) {
            was_babbling_ = babble;
            segment.babble(segment.port(), babbled_, was_babbling_ ? std::int64_t{babble_period} * 1000 : 0);
        }
        for (std::size_t n = 0; n < numbers_.size(); ++n) hits[n] = segment.hits(numbers_[n]);
    }

private:
    std::unique_ptr<Port>                    port_;
    std::vector<int>                         numbers_;
    bool                                     was_cut_ = false, was_babbling_ = false;
    std::array<std::uint8_t, smallest_frame> babbled_{};
};

}  // namespace

HAL_COMPONENT(SegmentFaults, "segment_faults", "What goes wrong on an Ethernet segment in memory", R"(
Frames of a `sim:` segment are lost, come twice, late, cut short or with a byte changed, or a cable is cut: on purpose, on the clock of the
threads, the same in every run.

`faults` is a list by commas of loss, duplicate, delay, cut and garble, each with what it strikes: `every=50` (every 50th frame; without it
all), `probability=0.02` (each frame, drawn; the same ones for the same `seed`), `count=3` (then it is over), `from=1s`, `until=2s`,
`type=0x9023` (of that Ethertype only), `frame=reply` (of TDMA's sync, request or reply only), `time=2ms` (delay), `length=30` (cut: bytes that
are left). `garble` is what a hostile station does: the check sequence of Ethernet is right.

The station `link` names can also babble: while `babble` is true it sends a frame every `babble-period`, without asking anybody.

    loadrt segment_faults link=sim:net0/tester faults=loss:every=50:from=1s:until=2s,garble:every=7:type=0x9023
    addf segment-faults.0.update servo
    start
)")
