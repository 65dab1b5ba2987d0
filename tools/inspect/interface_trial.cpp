// SPDX-License-Identifier: MIT
#include "inspect/interface_trial.hpp"

#include <cstring>
#include <time.h>

#include "inspect/restore_observer.hpp"

namespace hal::tools {

namespace {

/// Waits until the interface has a link: some changes restart the card.
bool has_link_again(const std::string& interface, const std::function<bool()>& stopped) {
    constexpr int attempts = 1000;
    const timespec pause{0, 10'000'000};
    for (int attempt = 0; attempt < attempts && !stopped(); ++attempt) {
        if (has_link(interface)) return true;
        ::nanosleep(&pause, nullptr);
    }
    return false;
}

}  // namespace

std::vector<std::string> Trial::run(RestoreObserver& observer,
                                    const std::vector<InterfaceSetting>& settings) const {
    const auto measured = [&] { return measure_round_trip(interface, duration_ns, stopped); };
    report({"", "", measured()});
    for (std::size_t n = 0; n < settings.size() && !stopped(); ++n) {
        const InterfaceSetting& setting = settings[n];
        if (setting.change.empty()) continue;
        TrialStep step{setting.finding.subject};
        if (!observer.add(n)) {
            step.problem = "the process that restores the settings was killed";
            report(step);
            break;
        }
        for (const SettingWrite& write : setting.change) {
            const int problem = write.run(interface);
            if (problem != 0) step.problem = std::strerror(problem);
        }
        if (step.problem.empty() && !has_link_again(interface, stopped) && !stopped()) {
            step.problem = "the link is down since the change";
        }
        if (step.problem.empty()) step.trip = measured();
        report(step);
    }
    if (!stopped()) hold();
    return observer.restore();
}

}  // namespace hal::tools
