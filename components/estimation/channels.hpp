// SPDX-License-Identifier: MIT
// The measurements of a filter: pins, ages, and the handling of invalid ones.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "estimation/past.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace hal::estimation {

class Channels {
public:
    /// `z-N`, `age-N`, `new-N`; with names NAME, `NAME-age`, `NAME-new`. In a component's
    /// constructor.
    Channels(hal::Component& component, Eigen::Index count,
             const std::vector<std::string>& names = {})
        : gate(component, "gate",
               "measurements with a larger deviation, in standard deviations, are ignored; 0: no "
               "gate"),
          timeout(component, "timeout",
                  "time without a used measurement after which valid becomes FALSE; 0: no timeout",
                  {.unit = "s"}),
          valid(component, "valid", "TRUE: a measurement was used within timeout", {.safe = false}),
          skipped(component, "skipped", "number of measurements that were NaN or infinite"),
          late(component, "late", "number of measurements older than the history"),
          outliers(component, "outliers", "number of measurements beyond the gate"),
          renewals(component, "renewals",
                   "number of times the covariance became invalid and was reset") {
        for (Eigen::Index i = 0; i < count; ++i) {
            const std::string number = std::to_string(i);

            const std::string what =
                names.empty() ? "measurement " + number : names[static_cast<std::size_t>(i)];
            const auto name = [&](const char* kind) {
                return names.empty() ? std::string(kind) + "-" + number
                                     : what + (*kind == 'z' ? "" : std::string("-") + kind);
            };
            rows_.emplace_back(
                std::make_unique<Row>(component, name("z"), name("age"), name("new"), what));
        }
        reported_ = Vector::Zero(count);
        hal::Retained(
            component,
            {{"reported", reported_}, {"silent-s", silent_s_}, {"used", used_}, {"ever", ever_}});
    }

    /// Gives `past` what there is in this cycle. [realtime]
    template <class Filter>
    void feed(Filter& past, hal::Cycle cycle) noexcept {
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            if (!rows_[i]->fresh) continue;
            const double z = rows_[i]->z;
            if (!std::isfinite(z)) {
                skipped = skipped + 1;
            } else if (!past.add(static_cast<Eigen::Index>(i), z, cycles(*rows_[i], cycle))) {
                late = late + 1;
            }
        }
    }
    /// The same for measurements that make sense together only: `mix` times all of them. [realtime]
    template <class Filter>
    void tell_whole(Filter& past, hal::Cycle cycle, const Matrix& mix) noexcept {
        bool all = true;
        bool any = false;
        bool numbers = true;
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            const bool fresh = rows_[i]->fresh;
            all = all && fresh;
            any = any || fresh;
            reported_(static_cast<Eigen::Index>(i)) = rows_[i]->z;
            numbers = numbers && std::isfinite(rows_[i]->z);
        }
        if (!any) return;
        if (!all || !numbers) {
            skipped = skipped + 1;
            return;
        }
        Vector mixed;
        multiply(mixed, mix, reported_);
        bool known = true;
        for (Eigen::Index i = 0; i < mixed.size(); ++i) {
            known = past.add(i, mixed(i), cycles(*rows_[0], cycle)) && known;
        }
        if (!known) {
            late = late + 1;
        }
    }
    /// Shows what became of it. [realtime]
    template <class Filter>
    void count(const Filter& past, hal::Cycle cycle) noexcept {
        outliers = past.outliers;
        renewals = past.renewals;
        silent_s_ = past.used != used_ ? 0.0 : silent_s_ + cycle.seconds();
        ever_ = ever_ || past.used != used_;
        used_ = past.used;
        valid = ever_ && !(timeout > 0.0 && silent_s_ > timeout);
    }

private:
    struct Row {
        Row(hal::Component& component, const std::string& z_name, const std::string& age_name,
            const std::string& new_name, const std::string& what)
            : z(component, z_name.c_str(), what.c_str()),
              age(component, age_name.c_str(), ("age of " + what).c_str(), {.unit = "s"}),
              fresh(component, new_name.c_str(),
                    ("TRUE: " + what + " is new in this cycle").c_str(), {.initial = true}) {}
        hal::In<double> z, age;
        hal::In<bool> fresh;
    };
    static std::int64_t cycles(const Row& row, hal::Cycle cycle) noexcept {
        const double count = row.age / cycle.seconds();
        if (!(count > 0.5)) return 0;
        return count < 1e9 ? std::llround(count) : 1'000'000'000;
    }

    std::vector<std::unique_ptr<Row>> rows_;
    Vector reported_;
    double silent_s_ = 0.0;
    std::uint32_t used_ = 0;
    bool ever_ = false;

public:
    hal::In<double> gate;
    hal::In<double> timeout;
    hal::Out<bool> valid;
    hal::Out<std::uint32_t> skipped, late, outliers, renewals;
};

}  // namespace hal::estimation
