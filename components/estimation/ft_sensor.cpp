// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <deque>

#include "estimation/matrices.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

using namespace hal::estimation;
using Six = std::array<double, 6>;

constexpr const char* axes[] = {"fx", "fy", "fz", "mx", "my", "mz"};
constexpr const char* units[] = {"N", "N", "N", "N*m", "N*m", "N*m"};
constexpr Six full_scale{100.0, 100.0, 200.0, 5.0, 5.0, 5.0};

constexpr Six overload_limit{471.4, 471.4, 1862.2, 20.31, 20.31, 15.8};

class FtSensor : public hal::Component {
public:
    explicit FtSensor(const hal_host* host)
        : Component(host),
          decoupling_(read()),
          raw(*this, "raw-#", 6, "channel # of the sensor, in the input unit of the matrix") {
        for (std::size_t i = 0; i < 6; ++i) {
            const std::string axis = axes[i];
            const char* kind = i < 3 ? "force" : "torque";
            out_.emplace_back(
                *this, axis.c_str(),
                (std::string("contact ") + kind + ": decoupled, without tool weight and tare")
                    .c_str(),
                hal::PinOptions<double>{.unit = units[i], .finite = true});
            offset_.emplace_back(*this, (axis + "-offset").c_str(), "offset of the last tare",
                                 hal::PinOptions<double>{.unit = units[i]});
            full_.emplace_back(*this, (axis + "-full-scale").c_str(),
                               "full scale; beyond it readings are not valid",
                               hal::PinOptions<double>{.initial = full_scale[i], .unit = units[i]});
            limit_.emplace_back(
                *this, (axis + "-overload").c_str(),
                "overload limit; beyond it the sensor may be damaged",
                hal::PinOptions<double>{.initial = overload_limit[i], .unit = units[i]});
        }
    }

    void update(hal::Cycle) noexcept {
        Six load{};
        bool numbers = true;
        for (std::size_t i = 0; i < 6; ++i) {
            for (std::size_t j = 0; j < 6; ++j) {
                load[i] += decoupling_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) *
                           raw[j];
            }
        }
        for (const double value : load) {
            numbers = numbers && std::isfinite(value);
        }
        if (!numbers) {
            bad_inputs = bad_inputs + 1;
        }
        valid = numbers;
        if (reset) {
            overload = false;
            overload_axis = 0;
        }
        if (!numbers) {
            return;  // hold the last wrench
        }

        supervise(load);
        const Six tool = weight_on_sensor();
        Six free{};
        for (std::size_t i = 0; i < 6; ++i) {
            free[i] = load[i] - tool[i];
        }
        if (const bool asked = tare; asked && !asked_) {
            count_ = 1;
            sum_ = {};
        }
        asked_ = tare;
        if (count_ > 0) {
            zero(free);
        }
        for (std::size_t i = 0; i < 6; ++i) {
            out_[i] = free[i] - offset_[i];
        }
    }

private:
    Matrix read() {
        const Matrices given(*this,
                             {{"decoupling", "diag 1 1 1 1 1 1",
                               "6 x 6: from the raw channels to fx fy fz mx my mz, in N and N*m"}});
        const Dense m = given.at("decoupling", 6, 6,
                                 "a row for each of fx fy fz mx my mz, a column for each channel");
        if (const Eigen::Index r = rank(m); r < 6) {
            given.refuse("decoupling",
                         "the decoupling matrix is singular: its rank is " + std::to_string(r),
                         "a force would not be measured; look for equal or empty rows");
        }
        return m;
    }
    using Dense = Eigen::MatrixXd;
    /// By elimination with the rows scaled to 1. [setup]
    static Eigen::Index rank(Dense m) {
        for (Eigen::Index i = 0; i < 6; ++i) {
            if (const double size = m.row(i).cwiseAbs().maxCoeff(); size > 0.0) {
                m.row(i) /= size;
            }
        }
        Eigen::Index found = 0;
        for (Eigen::Index column = 0; column < 6 && found < 6; ++column) {
            Eigen::Index best = found;
            for (Eigen::Index i = found; i < 6; ++i) {
                if (std::fabs(m(i, column)) > std::fabs(m(best, column))) {
                    best = i;
                }
            }
            if (std::fabs(m(best, column)) < 1e-9) continue;
            m.row(best).swap(m.row(found));
            for (Eigen::Index i = found + 1; i < 6; ++i) {
                m.row(i) -= m(i, column) / m(found, column) * m.row(found);
            }
            ++found;
        }
        return found;
    }
    /// The overload check uses the total load: tool, tare and contact.
    void supervise(const Six& load) noexcept {
        bool beyond = false;
        double highest = 0.0;
        for (std::size_t i = 0; i < 6; ++i) {
            const double size = std::fabs(load[i]);
            beyond = beyond || !(size <= full_[i]);  // a NaN limit counts as exceeded
            if (limit_[i] > 0.0) {
                highest = std::fmax(highest, size / limit_[i]);
            }
            if (!(size <= limit_[i]) && !overload) {
                overload = true;
                overload_axis = static_cast<std::uint32_t>(i + 1);
            }
        }
        beyond_scale = beyond;
        load_ratio = highest;
        if (!(highest <= peak_ratio)) {
            peak_ratio = highest;
        }
        if (reset) {
            peak_ratio = highest;
        }
    }
    Six weight_on_sensor() const noexcept {
        const double size =
            std::sqrt(gravity_x * gravity_x + gravity_y * gravity_y + gravity_z * gravity_z);
        if (!(size > 0.0) || !std::isfinite(size) || !std::isfinite(tool_weight)) {
            return {};
        }
        const double x = tool_weight * gravity_x / size;
        const double y = tool_weight * gravity_y / size;

        const double z = tool_weight * gravity_z / size;
        const Six on{x,
                     y,
                     z,
                     centre_y * z - centre_z * y,
                     centre_z * x - centre_x * z,
                     centre_x * y - centre_y * x};
        for (const double value : on) {
            if (!std::isfinite(value)) {
                return {};
            }
        }
        return on;
    }
    void zero(const Six& free) noexcept {
        for (std::size_t i = 0; i < 6; ++i) {
            sum_[i] += free[i];
        }
        const std::uint32_t samples = tare_samples > 0 ? tare_samples.get() : 1;
        taring = count_ < samples;
        if (count_++ < samples) return;
        for (std::size_t i = 0; i < 6; ++i) {
            offset_[i] = sum_[i] / samples;
        }
        count_ = 0;
    }

    Matrix decoupling_;
    Six sum_{};
    // samples of the tare so far, plus one; 0: no tare in progress
    std::uint32_t count_ = 0;
    bool asked_ = false;
    std::deque<hal::Out<double>> out_, offset_;
    std::deque<hal::Param<double>> full_, limit_;

public:
    hal::Ins<double> raw;
    hal::In<bool> tare{*this, "tare",
                       "a rising edge sets the current load, averaged over tare-samples, as zero"};
    hal::In<bool> reset{*this, "reset", "TRUE clears overload and restarts peak-ratio"};
    hal::In<double> gravity_x{*this, "gravity-x",
                              "direction of gravity in the sensor frame (any length), x"};
    hal::In<double> gravity_y{*this, "gravity-y",
                              "direction of gravity in the sensor frame (any length), y"};
    hal::In<double> gravity_z{*this,
                              "gravity-z",
                              "direction of gravity in the sensor frame (any length), z",
                              {.initial = -1.0}};
    hal::Param<double> tool_weight{
        *this, "tool-weight", "weight of the tool on the sensor; 0: no tool", {.unit = "N"}};
    hal::Param<double> centre_x{
        *this, "tool-centre-x", "tool's centre of mass in the sensor frame, x", {.unit = "m"}};
    hal::Param<double> centre_y{
        *this, "tool-centre-y", "tool's centre of mass in the sensor frame, y", {.unit = "m"}};
    hal::Param<double> centre_z{
        *this, "tool-centre-z", "tool's centre of mass in the sensor frame, z", {.unit = "m"}};
    hal::Param<std::uint32_t> tare_samples{
        *this, "tare-samples", "number of cycles averaged for a tare", {.initial = 100}};
    hal::Out<bool> taring{*this, "taring", "TRUE: tare in progress; do not touch"};
    hal::Out<bool> valid{
        *this, "valid", "TRUE: all six channels are valid numbers", {.safe = false}};
    hal::Out<bool> beyond_scale{*this, "beyond-scale", "TRUE: an axis is beyond its full scale"};
    hal::Out<bool> overload{*this, "overload",
                            "TRUE after an axis exceeded its overload limit, until reset"};
    hal::Out<std::uint32_t> overload_axis{
        *this, "overload-axis", "first axis in overload: 1..6 for fx fy fz mx my mz; 0: none"};
    hal::Out<double> load_ratio{
        *this, "load-ratio",
        "largest load as a fraction of its overload limit, including tool and tare"};
    hal::Out<double> peak_ratio{*this, "peak-ratio", "largest load-ratio since the start or reset"};
    hal::Out<std::uint32_t> bad_inputs{*this, "bad-inputs",
                                       "cycles with a NaN or infinite channel; the wrench is held"};
    hal::Function run{*this, "update", &FtSensor::update,
                      "computes the wrench from the six channels"};
    hal::Retained retained_{*this, {{"sum", sum_}, {"count", count_}, {"asked", asked_}}};
};

}  // namespace

HAL_COMPONENT(FtSensor, "ft_sensor",
              "Six-axis force/torque sensor: decoupling, tare, tool weight, overload", R"(
    wrench = decoupling * raw - weight of the tool - tare

`decoupling` is the 6 x 6 matrix of the sensor's calibration, a load argument (a comma between
numbers, a `;` between rows) or `decoupling = ...` in a `file=` (see state_space); without it the
channels count as N and N*m. The tool's weight acts in its centre of mass along the direction of
gravity in the sensor frame; if a wrist rotates the sensor, link `gravity-x y z` to the kinematics.
A tare removes the remaining offset.

**Overload** monitors the total load of the sensor, including tool and tare. The default limits are
those of a JR3 50M31A-I25, the sensor of the source system: full scale 100, 100, 200 N and 5 N*m,
overload 471.4, 471.4, 1862.2 N and 20.31, 20.31, 15.8 N*m. Link `overload` to the safety chain.

While a channel is NaN or infinite, `valid` is FALSE and the wrench is held. A singular matrix is
rejected.

    loadrt ft_sensor names=wrist decoupling="diag 0.01 0.01 0.02 5e-4 5e-4 5e-4"
    addf wrist.update servo
    setp wrist.tool-weight 4.9
    setp wrist.tool-centre-z 0.06
    net channel-2  => wrist.raw-2
    net push       <= wrist.fz
    net wrist-harm <= wrist.overload
)")
