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

/// The measurements of one filter, in the order of its channels.
class Channels {
public:
    /// Declares `z-N`, `age-N` and `new-N` of each measurement; with names NAME, `NAME-age` and
    /// `NAME-new`. In a component's constructor. [setup]
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
            const auto index = static_cast<std::size_t>(i);
            const PinNames pins = names.empty() ? numbered(std::to_string(i)) : named(names[index]);
            rows_.emplace_back(std::make_unique<Row>(component, pins));
        }
        reported_ = Vector::Zero(count);
        hal::Retained(
            component,
            {{"reported", reported_}, {"silent-s", silent_s_}, {"used", used_}, {"ever", ever_}});
    }

    /// Gives the measurements of this cycle to `past`. [realtime]
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
    /// The same for measurements whose noises are correlated: the rows of `decorrelation` times all
    /// of them are independent, so that a cycle without one of them is skipped. [realtime]
    template <class Filter>
    void feed_decorrelated(Filter& past, hal::Cycle cycle, const Matrix& decorrelation) noexcept {
        std::size_t fresh = 0;
        bool all_finite = true;
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            const double z = rows_[i]->z;
            reported_(static_cast<Eigen::Index>(i)) = z;
            all_finite = all_finite && std::isfinite(z);
            if (rows_[i]->fresh) {
                ++fresh;
            }
        }
        if (fresh == 0) return;
        if (fresh < rows_.size() || !all_finite) {
            skipped = skipped + 1;
            return;
        }
        Vector independent;
        multiply(independent, decorrelation, reported_);
        const std::int64_t age = cycles(*rows_[0], cycle);
        bool all_in_history = true;
        for (Eigen::Index i = 0; i < independent.size(); ++i) {
            const bool in_history = past.add(i, independent(i), age);
            all_in_history = all_in_history && in_history;
        }
        if (!all_in_history) {
            late = late + 1;
        }
    }
    /// Sets the pins after the filter's step. [realtime]
    template <class Filter>
    void show_outcome(const Filter& past, hal::Cycle cycle) noexcept {
        outliers = past.outliers;
        renewals = past.renewals;
        if (past.used != used_) {
            ever_ = true;
            silent_s_ = 0.0;
        } else {
            silent_s_ = silent_s_ + cycle.seconds();
        }
        used_ = past.used;
        const bool timed_out = timeout > 0.0 && silent_s_ > timeout;
        valid = ever_ && !timed_out;
    }

private:
    struct PinNames {
        std::string value, age, fresh;
        std::string doc;  ///< of the value
    };
    static PinNames numbered(const std::string& number) {
        return {"z-" + number, "age-" + number, "new-" + number, "measurement " + number};
    }
    static PinNames named(const std::string& name) {
        return {name, name + "-age", name + "-new", name};
    }

    struct Row {
        Row(hal::Component& component, const PinNames& names)
            : z(component, names.value.c_str(), names.doc.c_str()),
              age(component, names.age.c_str(), ("age of " + names.doc).c_str(), {.unit = "s"}),
              fresh(component, names.fresh.c_str(),
                    ("TRUE: " + names.doc + " is new in this cycle").c_str(), {.initial = true}) {}
        hal::In<double> z, age;
        hal::In<bool> fresh;
    };
    /// The age of a measurement in cycles, rounded; a negative age is 0.
    static std::int64_t cycles(const Row& row, hal::Cycle cycle) noexcept {
        const double count = row.age / cycle.seconds();
        if (!(count > 0.5)) return 0;
        return count < 1e9 ? std::llround(count) : 1'000'000'000;
    }

    std::vector<std::unique_ptr<Row>> rows_;
    Vector reported_;
    double silent_s_ = 0.0;  // since a measurement was used
    std::uint32_t used_ = 0;
    bool ever_ = false;  // a measurement was used

public:
    hal::In<double> gate;
    hal::In<double> timeout;
    hal::Out<bool> valid;
    hal::Out<std::uint32_t> skipped, late, outliers, renewals;
};

}  // namespace hal::estimation
