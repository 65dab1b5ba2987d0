// SPDX-License-Identifier: MIT
// Filtered inputs: InM, InMux.
#pragma once

#include <algorithm>
#include <vector>

#include "mesa/driver/position_counter.hpp"
#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"

namespace hal::mesa {

/// One instance. Four of its inputs in pairs are counters for handwheels.
class FilteredInputs {
public:
    static constexpr unsigned counters = 4;

    /// `width`: inputs that the card scans, 1..32.
    FilteredInputs(const PinOwner& o, const char* prefix, unsigned unit, const CardModule& module,
                   unsigned width)
        : clock_hz_(module.clock_hz),
          width_(width),
          control_(module.addresses.at(inm::control, unit)),
          filter_(module.addresses.at(inm::filter, unit)),
          modes_(module.addresses.at(inm::counters, unit)),
          scan_rate_(o.component, named(prefix, unit, "scan_rate").c_str(),
                     "scans of all inputs per second", {.initial = 20'000, .unit = "Hz"}),
          fast_scans_(o.component, named(prefix, unit, "fast_scans").c_str(),
                      "scans until a level counts, 0..63", {.initial = 5}),
          slow_scans_(o.component, named(prefix, unit, "slow_scans").c_str(),
                      "scans until a level of a slow input counts, 0..1023", {.initial = 500}),
          scan_width_(o.component, o.read, named(prefix, unit, "scan_width").c_str(),
                      "number of inputs", {.initial = width}) {
        for (unsigned n = 0; n < width; ++n) {
            inputs_.push_back(place<Input>(o, prefix, unit, n));
        }
        for (unsigned n = 0; n < counters && 2 * n + 1 < width; ++n) {
            wheels_.push_back(place<Wheel>(o, prefix, unit, n));
        }
    }

    /// [realtime] read
    void receive(std::uint32_t filtered, std::uint32_t raw, std::uint32_t counts,
                 const Reading& reading) noexcept {
        for (unsigned n = 0; n < inputs_.size(); ++n) {
            inputs_[n]->show((filtered >> n & 1U) != 0, (raw >> n & 1U) != 0);
        }
        for (unsigned n = 0; n < wheels_.size(); ++n) {
            wheels_[n]->receive(static_cast<std::int8_t>(counts >> 8 * n & 0xffU), reading);
        }
    }
    /// [realtime] write
    void transmit(Outgoing& out) noexcept {
        std::uint32_t slow = 0;
        for (unsigned n = 0; n < inputs_.size(); ++n) {
            slow |= inputs_[n]->is_slow ? 1U << n : 0U;
        }
        std::uint32_t modes = 0;
        for (unsigned n = 0; n < wheels_.size(); ++n) {
            modes |= wheels_[n]->is_4x ? 1U << 8 * n : 0U;
        }
        std::uint32_t control = width_ - 1;
        control |= scan_divider(scan_rate_ * static_cast<double>(width_), clock_hz_) << 6;
        control |= std::min<std::uint32_t>(fast_scans_, 63) << 16;
        control |= std::min<std::uint32_t>(slow_scans_, 1023) << 22;
        out.put(control_, control);
        out.put(filter_, slow);
        out.put(modes_, modes);
    }

private:
    static std::string named(const char* prefix, unsigned unit, const char* name) {
        return pin_name(prefix, unit, name);
    }
    static std::string numbered(const char* prefix, unsigned unit, const char* before, unsigned n,
                                const char* behind) {
        char text[64];
        std::snprintf(text, sizeof text, "%s.%02u.%s%02u%s", prefix, unit, before, n, behind);
        return text;
    }

    struct Input {
        Input(const PinOwner& o, const char* prefix, unsigned unit, unsigned n)
            : level(o.component, o.read, numbered(prefix, unit, "input-", n, "").c_str(),
                    "filtered level"),
              level_not(o.component, o.read, numbered(prefix, unit, "input-", n, "-not").c_str(),
                        "filtered level, inverted"),
              raw(o.component, o.read, numbered(prefix, unit, "raw-input-", n, "").c_str(),
                  "level"),
              raw_not(o.component, o.read, numbered(prefix, unit, "raw-input-", n, "-not").c_str(),
                      "level, inverted"),
              is_slow(o.component, o.write, numbered(prefix, unit, "input-", n, "-slow").c_str(),
                      "TRUE: filtered for slow_scans") {}
        void show(bool filtered_level, bool raw_level) noexcept {
            level = filtered_level;
            level_not = !filtered_level;
            raw = raw_level;
            raw_not = !raw_level;
        }
        hal::Out<bool> level, level_not, raw, raw_not;
        hal::In<bool> is_slow;
    };
    struct Wheel {
        Wheel(const PinOwner& o, const char* prefix, unsigned unit, unsigned n)
            : count(o.component, o.read, name(prefix, unit, n, "-count").c_str(),
                    "counts of a handwheel"),
              reset(o.component, o.read, name(prefix, unit, n, "-reset").c_str(),
                    "TRUE: the count is 0"),
              is_4x(o.component, o.write, name(prefix, unit, n, "_4xmode").c_str(),
                    "TRUE: four counts per cycle of A and B; FALSE: one") {}
        static std::string name(const char* prefix, unsigned unit, unsigned n, const char* behind) {
            char text[64];
            std::snprintf(text, sizeof text, "%s.%02u.enc%u%s", prefix, unit, n, behind);
            return text;
        }
        void receive(std::int8_t value, const Reading& reading) noexcept {
            if (reading.has_lost_power) {
                counter.rebase(value);
            }
            counter.update(value);
            if (reset) {
                zero = counter.position();
            }
            count = static_cast<std::int32_t>(counter.position() - zero);
        }
        hal::Out<std::int32_t> count;
        hal::In<bool> reset, is_4x;
        PositionCounter<std::int8_t> counter;
        std::int64_t zero = 0;
    };

    const std::uint32_t clock_hz_;
    const unsigned width_;
    Setting control_, filter_, modes_;
    hal::Param<std::uint32_t> scan_rate_, fast_scans_, slow_scans_;
    hal::Out<std::uint32_t> scan_width_;
    std::vector<Placed<Input>> inputs_;
    std::vector<Placed<Wheel>> wheels_;
};

class InputPins final : public ModulePins {
public:
    /// `widths`: of each instance.
    InputPins(const PinOwner& o, const CardModule& module, const std::vector<unsigned>& widths)
        : addresses_(module.addresses) {
        const char* const prefix = module.tag() == Tag::inm ? "inm" : "inmux";
        for (unsigned unit = 0; unit < widths.size(); ++unit) {
            units_.push_back(place<FilteredInputs>(o, prefix, unit, module, widths[unit]));
        }
    }
    void plan(ReadLayout& layout) override {
        if (units_.empty()) return;
        filtered_ = layout.add_instances(addresses_, inm::filtered, units_.size());
        raw_ = layout.add_instances(addresses_, inm::raw, units_.size());
        counts_ = layout.add_instances(addresses_, inm::counters, units_.size());
    }
    void receive(const Reply& reply, const Reading& reading) noexcept override {
        for (std::size_t n = 0; n < units_.size(); ++n) {
            units_[n]->receive(reply.word(filtered_, n), reply.word(raw_, n),
                               reply.word(counts_, n), reading);
        }
    }
    void transmit(Outgoing& out, const Writing&) noexcept override {
        for (const auto& unit : units_) {
            unit->transmit(out);
        }
    }

private:
    const ModuleAddresses addresses_;
    std::vector<Placed<FilteredInputs>> units_;
    std::size_t filtered_ = 0;
    std::size_t raw_ = 0;
    std::size_t counts_ = 0;
};

}  // namespace hal::mesa
