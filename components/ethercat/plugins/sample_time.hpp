// SPDX-License-Identifier: MIT
// When the samples of a slave were taken: the pin SLAVE.sample-time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>

#include "ethercat/master/master.hpp"
#include "hal/component.hpp"

namespace hal::ethercat {

/// The pins of all slaves with samples in their inputs.
class SampleTimes {
public:
    /// [setup]
    SampleTimes(Component& component, const Function& shows, const master::Setup& setup) {
        for (std::size_t n = 0; n < setup.slaves.size(); ++n) {
            if (has_samples(setup.slaves[n])) {
                times_.emplace_back(component, shows, n, setup.slaves[n].name);
            }
        }
    }

    /// Without a new time, the pin keeps the last one. [realtime]
    void show(const master::Master& master) noexcept {
        for (Time& time : times_) {
            if (const auto first_ns = master.first_sample_ns(time.slave)) {
                time.pin = *first_ns;
            }
        }
    }

private:
    struct Time {
        Time(Component& component, const Function& shows, std::size_t number,
             const std::string& name)
            : slave(number),
              pin(component, shows, (name + ".sample-time").c_str(),
                  "when the first sample of the inputs was taken, on the clock of the machine",
                  {.unit = "ns"}) {}
        std::size_t slave;
        Out<std::int64_t> pin;
    };
    static bool has_samples(const master::Slave& slave) {
        const auto in_pdo = [](const master::Pdo& pdo) {
            return std::any_of(pdo.entries.begin(), pdo.entries.end(),
                               [](const master::Entry& e) { return e.sample.has_value(); });
        };
        return std::any_of(slave.sync_managers.begin(), slave.sync_managers.end(),
                           [&](const master::SyncManager& sm) {
            return !sm.output && std::any_of(sm.pdos.begin(), sm.pdos.end(), in_pdo);
        });
    }

    std::deque<Time> times_;  // a pin may not move once it is declared
};

}  // namespace hal::ethercat
