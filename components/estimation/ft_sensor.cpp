// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <deque>

#include "estimation/matrices.hpp"
#include "hal/component.hpp"

namespace {

using namespace hal::estimation;
using Six = std::array<double, 6>;

constexpr const char* axes[] = {"fx", "fy", "fz", "mx", "my", "mz"};
constexpr const char* units[] = {"N", "N", "N", "N*m", "N*m", "N*m"};
constexpr Six         full_scale{100.0, 100.0, 200.0, 5.0, 5.0, 5.0}, overload_limit{471.4, 471.4, 1862.2, 20.31, 20.31, 15.8};

class FtSensor : public hal::Component {
public:
    explicit FtSensor(const hal_host* host)
        : Component(host), decoupling_(read()), raw(*this, "raw-#", 6, "channel # of the sensor, in whatever the matrix takes") {
        for (std::size_t i = 0; i < 6; ++i) {
            const std::string axis = axes[i];
            const char*       kind = i < 3 ? "force" : "torque";
            out_.emplace_back(*this, axis.c_str(), (std::string(kind) + " of the contact: decoupled, without tool and tare").c_str(),
                              hal::PinOptions<double>{.unit = units[i], .finite = true});
            offset_.emplace_back(*this, (axis + "-offset").c_str(), "what the last tare takes off",
                                 hal::PinOptions<double>{.unit = units[i]});
            full_.emplace_back(*this, (axis + "-full-scale").c_str(), "beyond it the reading is no longer good",
                               hal::PinOptions<double>{.initial = full_scale[i], .unit = units[i]});
            limit_.emplace_back(*this, (axis + "-overload").c_str(), "beyond it the sensor breaks",
                                hal::PinOptions<double>{.initial = overload_limit[i], .unit = units[i]});
        }
    }

    void update(hal::Cycle) noexcept {
        Six  load{};
        bool numbers = true;
        for (std::size_t i = 0; i < 6; ++i)
            for (std::size_t j = 0; j < 6; ++j) load[i] += decoupling_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * raw[j];
        for (const double value : load) numbers = numbers && std::isfinite(value);
        if (!numbers) bad_inputs = bad_inputs + 1;
        valid = numbers;
        if (reset) overload = false, overload_axis = 0;
        if (!numbers) return;  // the last wrench stays

        supervise(load);
        const Six tool = weight_on_sensor();
        Six       free{};
        for (std::size_t i = 0; i < 6; ++i) free[i] = load[i] - tool[i];
        if (const bool asked = tare; asked && !asked_) count_ = 1, sum_ = {};
        asked_ = tare;
        if (count_ > 0) zero(free);
        for (std::size_t i = 0; i < 6; ++i) out_[i] = free[i] - offset_[i];
    }

private:
    Matrix read() {
        const Matrices given(*this,
                             {{"decoupling", "diag 1 1 1 1 1 1", "6 x 6: from the raw channels to fx fy fz mx my mz, in N and N*m"}});
        const Dense    m = given.at("decoupling", 6, 6, "a row for each of fx fy fz mx my mz, a column for each channel");
        if (const Eigen::Index r = rank(m); r < 6)
            given.refuse("decoupling", "the decoupling matrix is singular: its rank is " + std::to_string(r),
                         "some force would never show; look for equal or empty rows");
        return m;
    }
    using Dense = Eigen::MatrixXd;
    /// By elimination with the rows scaled to 1. [setup]
    static Eigen::Index rank(Dense m) {
        for (Eigen::Index i = 0; i < 6; ++i)
            if (const double size = m.row(i).cwiseAbs().maxCoeff(); size > 0.0) m.row(i) /= size;
        Eigen::Index found = 0;
        for (Eigen::Index column = 0; column < 6 && found < 6; ++column) {
            Eigen::Index best = found;
            for (Eigen::Index i = found; i < 6; ++i)
                if (std::fabs(m(i, column)) > std::fabs(m(best, column))) best = i;
            if (std::fabs(m(best, column)) < 1e-9) continue;
            m.row(best).swap(m.row(found));
            for (Eigen::Index i = found + 1; i < 6; ++i) m.row(i) -= m(i, column) / m(found, column) * m.row(found);
            ++found;
        }
        return found;
    }
    /// The sensor carries tool, tare and contact: what breaks it is all of them.
    void supervise(const Six& load) noexcept {
        bool   beyond = false;
        double highest = 0.0;
        for (std::size_t i = 0; i < 6; ++i) {
            const double size = std::fabs(load[i]);
            beyond = beyond || !(size <= full_[i]);  // a limit that is no number is one that is exceeded
            if (limit_[i] > 0.0) highest = std::fmax(highest, size / limit_[i]);
            if (!(size <= limit_[i]) && !overload) overload = true, overload_axis = static_cast<std::uint32_t>(i + 1);
        }
        beyond_scale = beyond;
        load_ratio = highest;
        if (!(highest <= peak_ratio)) peak_ratio = highest;
        if (reset) peak_ratio = highest;
    }
    Six weight_on_sensor() const noexcept {
        const double size = std::sqrt(gravity_x * gravity_x + gravity_y * gravity_y + gravity_z * gravity_z);
        if (!(size > 0.0) || !std::isfinite(size) || !std::isfinite(tool_weight)) return {};
        const double x = tool_weight * gravity_x / size, y = tool_weight * gravity_y / size, z = tool_weight * gravity_z / size;
        const Six    on{x, y, z, centre_y * z - centre_z * y, centre_z * x - centre_x * z, centre_x * y - centre_y * x};
        for (const double value : on)
            if (!std::isfinite(value)) return {};
        return on;
    }
    void zero(const Six& free) noexcept {
        for (std::size_t i = 0; i < 6; ++i) sum_[i] += free[i];
        const std::uint32_t samples = tare_samples > 0 ? tare_samples.get() : 1;
        taring = count_ < samples;
        if (count_++ < samples) return;
        for (std::size_t i = 0; i < 6; ++i) offset_[i] = sum_[i] / samples;
        count_ = 0;
    }

    Matrix                         decoupling_;
    Six                            sum_{};
    std::uint32_t                  count_ = 0;  // samples of the tare so far, plus one; 0: none is going on
    bool                           asked_ = false;
    std::deque<hal::Out<double>>   out_, offset_;
    std::deque<hal::Param<double>> full_, limit_;

public:
    hal::Ins<double>          raw;
    hal::In<bool>             tare{*this, "tare", "rising edge: what is there now, averaged over tare-samples, counts as nothing"};
    hal::In<bool>             reset{*this, "reset", "takes overload back and starts peak-ratio anew"};
    hal::In<double>           gravity_x{*this, "gravity-x", "direction of gravity in the sensor's frame, of any length"};
    hal::In<double>           gravity_y{*this, "gravity-y", "direction of gravity in the sensor's frame, of any length"};
    hal::In<double>           gravity_z{*this, "gravity-z", "direction of gravity in the sensor's frame, of any length", {.initial = -1.0}};
    hal::Param<double>        tool_weight{*this, "tool-weight", "of what hangs on the sensor; 0 for none", {.unit = "N"}};
    hal::Param<double>        centre_x{*this, "tool-centre-x", "its centre of mass in the sensor's frame", {.unit = "m"}};
    hal::Param<double>        centre_y{*this, "tool-centre-y", "its centre of mass in the sensor's frame", {.unit = "m"}};
    hal::Param<double>        centre_z{*this, "tool-centre-z", "its centre of mass in the sensor's frame", {.unit = "m"}};
    hal::Param<std::uint32_t> tare_samples{*this, "tare-samples", "cycles that a tare averages", {.initial = 100}};
    hal::Out<bool>            taring{*this, "taring", "a tare is going on: do not touch"};
    hal::Out<bool>            valid{*this, "valid", "all six channels are numbers", {.safe = false}};
    hal::Out<bool>            beyond_scale{*this, "beyond-scale", "an axis is beyond its full scale"};
    hal::Out<bool>            overload{*this, "overload", "an axis was beyond its overload limit; stays until reset"};
    hal::Out<std::uint32_t>   overload_axis{*this, "overload-axis", "which was the first: 1 to 6 for fx fy fz mx my mz; 0 none"};
    hal::Out<double>          load_ratio{*this, "load-ratio", "largest load as a part of its overload limit, tool and tare included"};
    hal::Out<double>          peak_ratio{*this, "peak-ratio", "largest load-ratio since the start or reset"};
    hal::Out<std::uint32_t>   bad_inputs{*this, "bad-inputs", "cycles with a channel that was no number; the wrench of before stays"};
    hal::Function             run{*this, "update", &FtSensor::update, "makes the wrench of the six channels"};
};

}  // namespace

HAL_COMPONENT(FtSensor, "ft_sensor", "Six-axis force/torque sensor: decoupling, tare, tool weight, overload", R"(
    wrench = decoupling * raw - weight of the tool - tare

`decoupling` is the 6 x 6 matrix of the sensor's calibration, a load argument (a comma between numbers, a `;` between rows) or `decoupling = ...` in a
`file=` (see state_space); without it the channels count as N and N*m. The tool's weight acts in its centre of mass along the direction of
gravity in the sensor's frame, which changes when a wrist turns: link `gravity-x y z` to the kinematics then. A tare takes off what remains.

**Overload** looks at what the sensor carries in all, before tool and tare are taken off. The limits are those of a JR3 50M31A-I25, the sensor of
the source system: full scale 100, 100, 200 N and 5 N*m, overload 471.4, 471.4, 1862.2 N and 20.31, 20.31, 15.8 N*m. Link `overload` to the
safety chain.

A channel that is no number makes `valid` fall; the wrench of before stays. A singular matrix is refused.

    loadrt ft_sensor names=wrist decoupling="diag 0.01 0.01 0.02 5e-4 5e-4 5e-4"
    addf wrist.update servo
    setp wrist.tool-weight 4.9
    setp wrist.tool-centre-z 0.06
    net channel-2  => wrist.raw-2
    net push       <= wrist.fz
    net wrist-harm <= wrist.overload
)")
