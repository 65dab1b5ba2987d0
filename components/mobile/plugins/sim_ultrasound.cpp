// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "floor_argument.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct SimUltrasound : hal::Component {
    using Component::Component;
    static constexpr std::uint32_t samples = 256;
    static constexpr std::uint32_t per_message = 8;
    static constexpr std::uint32_t steps = 200;

    hal::TextArgument floor_file{
        *this, "floor", "",
        "file beside the netlist with walls and obstacles; default: an empty floor"};

    hal::In<double> x{*this, "x", "true x of the robot", {.unit = "m"}};
    hal::In<double> y{*this, "y", "true y of the robot", {.unit = "m"}};
    hal::In<double> heading{*this, "heading", "true heading of the robot", {.unit = "rad"}};
    hal::In<bool> enable{*this, "enable", "FALSE: the head rests", {.initial = true}};

    hal::Out<bool> begins{*this, "begins",
                          "TRUE for the cycle before the burst: step and sequence are new"};
    hal::Out<std::uint32_t> step{*this, "step",
                                 "position of the head, 0..199, to the left from straight ahead"};
    hal::Out<std::uint32_t> sequence{*this, "sequence", "number of the burst, modulo 65536"};
    hal::Out<bool> message{*this, "message", "TRUE: the samples of a message are new"};
    hal::Out<std::uint32_t> id_offset{*this, "id-offset",
                                      "number of the message in the burst, modulo 8"};
    hal::Outs<std::uint32_t> sample{*this, "sample-#", per_message,
                                    "sample # of the message, 0..255"};

    hal::Function run{*this, "update", &SimUltrasound::update,
                      "records an echo, or gives the next message of the burst"};

    hal::mobile::FloorPlan floor = hal::mobile::floor_from(*this, floor_file.get());

    void update(hal::Cycle cycle) noexcept {
        begins = false;
        message = false;
        if (sent_ < samples / per_message) {
            for (std::uint32_t i = 0; i < per_message; ++i) {
                sample[i] = echo_[sent_ * per_message + i];
            }
            id_offset = sent_ % 8;
            message = true;
            ++sent_;
        } else if (enable && (!begun_ || cycle.start_ns() - pinged_ns_ >= record_ns)) {
            if (begun_) {
                step = position_;
                sequence = (sequence + 1) & 0xffff;
                begins = true;
                sent_ = 0;
                position_ = (position_ + 1) % steps;
            }
            listen();
            pinged_ns_ = cycle.start_ns();
            begun_ = true;
        }
    }

private:
    static constexpr std::int64_t record_ns = 25'600'000;  // 256 samples at 10 kHz
    static constexpr double sample_m = 343.0 / 2 / 10'000;
    static constexpr std::uint8_t floor_noise = 4;

    /// The echoes of nine rays over the beam, +-12 degrees; an amplitude falls with the distance
    /// and lasts eight samples.
    void listen() noexcept {
        echo_.swap(record_);
        record_.fill(floor_noise);
        if (!(std::fabs(x) < 1e6 && std::fabs(y) < 1e6 && std::fabs(heading) < 1e6)) return;
        const double facing = heading + position_ * 2 * std::numbers::pi / steps;
        for (int ray = -4; ray <= 4; ++ray) {
            const double off = ray * 3.0 * std::numbers::pi / 180;
            const auto hit = floor.cast(x, y, facing + off, sample_m * samples);
            if (!std::isfinite(hit.distance)) continue;
            const double strength =
                250.0 * hit.incidence * (1.0 - 0.15 * std::abs(ray)) / (1.0 + hit.distance);
            const auto at = static_cast<std::size_t>(hit.distance / sample_m);
            for (std::size_t i = at; i < std::min<std::size_t>(at + 8, samples); ++i) {
                record_[i] = std::max(record_[i],
                                      static_cast<std::uint8_t>(std::clamp(strength, 0.0, 255.0)));
            }
        }
    }

    std::array<std::uint8_t, samples> record_{}, echo_{};
    std::int64_t pinged_ns_ = 0;
    std::uint32_t position_ = 0;
    std::uint32_t sent_ = samples / per_message;
    bool begun_ = false;
    hal::Retained retained_{*this,
                            {{"record", record_},
                             {"echo", echo_},
                             {"pinged-ns", pinged_ns_},
                             {"position", position_},
                             {"sent", sent_},
                             {"begun", begun_}}};
};

}  // namespace

HAL_COMPONENT(SimUltrasound, "sim_ultrasound",
              "A rotating ultrasonic range finder, on a floor with obstacles", R"(
A head turns in 200 steps. At each it records 256 samples of an echo, 25.6 ms at 10 kHz and 17.15 mm
each, and then gives them in a burst of 32 messages of eight samples, one per cycle. `begins`
announces a burst with the position of the head. While the burst is given, the next echo is
recorded.

The amplitude is that of the nearest surface in nine rays over 24 degrees. The floor plan is that of
`sim_diff_base`.

    loadrt sim_ultrasound names=sonar
    loadrt can_send link=sim:yair names=echo id=0x310 ids=8 fields=s0:u8,s1:u8
    addf sonar.update servo
    addf echo.update servo
    net true-x     => sonar.x
    net next-part  sonar.message   => echo.trigger
    net part       sonar.id-offset => echo.id-offset
    net amplitude0 sonar.sample-0  => echo.s0
    net amplitude1 sonar.sample-1  => echo.s1
)")
