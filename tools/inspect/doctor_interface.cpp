// SPDX-License-Identifier: MIT
#include "inspect/doctor_interface.hpp"

#include <fmt/core.h>
#include <fstream>
#include <ifaddrs.h>
#include <net/if.h>
#include <nlohmann/json.hpp>
#include <optional>
#include <unistd.h>

#include "base/types.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "inspect/interface_trial.hpp"
#include "inspect/remedies.hpp"
#include "inspect/restore_observer.hpp"

namespace hal::tools {

namespace {

constexpr unsigned cap_net_admin = 12;

/// Returns true when the interface has an IP address, other than IPv6's link-local one.
bool has_ip_address(const std::string& name) {
    ifaddrs* all = nullptr;
    if (::getifaddrs(&all) != 0) return false;
    bool found = false;
    for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
        found = found || (one->ifa_addr != nullptr && name == one->ifa_name &&
                          one->ifa_addr->sa_family == AF_INET);
    }
    ::freeifaddrs(all);
    return found;
}

std::string names_of_interfaces() {
    std::string names;
    struct if_nameindex* const all = ::if_nameindex();
    for (const auto* one = all; one != nullptr && one->if_index != 0; ++one) {
        names += (names.empty() ? "" : ", ") + std::string(one->if_name);
    }
    if (all != nullptr) ::if_freenameindex(all);
    return names;
}

bool may_change_settings() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.starts_with("CapEff:")) {
            return ((std::stoull(line.substr(7), nullptr, 16) >> cap_net_admin) & 1) != 0;
        }
    }
    return false;
}

ExaminedInterface examined(const DoctorOptions& options) {
    ExaminedInterface interface{options.interface};
    interface.has_address = has_ip_address(options.interface);
    interface.is_udp = options.udp;
    if (options.cpu >= 0) {
        interface.cpus = {options.cpu};
    } else {
        std::ifstream file("/sys/devices/system/cpu/isolated");
        std::string list;
        std::getline(file, list);
        interface.cpus = cpus_of_list(list);
    }
    return interface;
}

nlohmann::ordered_json json_of(const RoundTrip& trip) {
    if (!trip) return {{"problem", trip.problem}};
    return {{"frames", trip.frames},
            {"lost", trip.lost},
            {"p50_ns", trip.p50_ns},
            {"p99_ns", trip.p99_ns},
            {"max_ns", trip.max_ns}};
}

std::string row_of(const std::string& what, const RoundTrip& trip) {
    if (!trip) return fmt::format("  {:24} not measured: {}\n", what, trip.problem);
    return fmt::format("  {:24} {:>10} {:>10} {:>10} {:>7}\n", what, format_duration(trip.p50_ns),
                       format_duration(trip.p99_ns), format_duration(trip.max_ns), trip.lost);
}

std::string head_of_rows(const std::string& interface) {
    return fmt::format("\nround trip of a frame on {}:\n  {:24} {:>10} {:>10} {:>10} {:>7}\n",
                       interface, "", "p50", "p99", "max", "lost");
}

/// Why the settings cannot be tried now; empty: they can.
std::string obstacle(const DoctorOptions& options) {
    const std::string& name = options.interface;
    if (!may_change_settings()) {
        return fmt::format(
            "settings are changed by root (CAP_NET_ADMIN) only; type: sudo hal "
            "doctor --interface {} --try",
            name);
    }
    if (has_ethercat_user(name)) {
        return fmt::format(
            "a program uses {} for EtherCAT; stop it first: some changes interrupt "
            "the link",
            name);
    }
    return {};
}

/// Prints the rows of a trial, or collects them for JSON.
class TrialReport {
public:
    explicit TrialReport(const DoctorOptions& options) : options_(options) {}

    void add(const TrialStep& step) {
        if (options_.json) {
            nlohmann::ordered_json row{{"changed", step.setting}};
            row.update(step.problem.empty() ? json_of(step.trip)
                                            : nlohmann::ordered_json{{"problem", step.problem}});
            rows_.push_back(row);
            return;
        }
        if (step.setting.empty()) print(head_of_rows(options_.interface));
        const std::string what = step.setting.empty() ? "as it is" : "then " + step.setting;
        print(step.problem.empty() ? row_of(what, step.trip)
                                   : fmt::format("  {:24} not changed: {}\n", what, step.problem));
    }
    void holding() const {
        if (options_.hold && !options_.json) {
            print("all changed until Ctrl-C; then the settings are restored\n");
        }
    }
    const nlohmann::ordered_json& rows() const { return rows_; }

private:
    const DoctorOptions& options_;
    nlohmann::ordered_json rows_ = nlohmann::ordered_json::array();
};

int run_trial(const DoctorOptions& options, const std::vector<InterfaceSetting>& settings,
              nlohmann::ordered_json& report) {
    if (const std::string problem = obstacle(options); !problem.empty()) {
        return fail(options, problem);
    }
    RestoreObserver observer(options.interface, settings);  // before the thread of StopRequest
    if (!observer) return fail(options, "cannot start the process that restores the settings");
    StopRequest stop;
    TrialReport rows(options);
    const Trial trial{options.interface, static_cast<std::int64_t>(options.seconds * 1e9), [&] {
        return stop.requested();
    }, [&](const TrialStep& step) { rows.add(step); }, [&] {
        rows.holding();
        if (options.hold) stop.wait_ns(-1);
    }};
    const std::vector<std::string> lost = trial.run(observer, settings);
    report["trial"] = rows.rows();
    for (const std::string& setting : lost) {
        fail(options, fmt::format("cannot restore {} of {}; restart the computer, or set it with "
                                  "ethtool",
                                  setting, options.interface));
    }
    if (lost.empty() && !options.json) print("restored\n");
    return exit_code(lost.empty());
}

int run_measurement(const DoctorOptions& options, nlohmann::ordered_json& report) {
    RoundTrip trip;
    if (has_ethercat_user(options.interface)) {
        trip.problem = "a program uses the interface for EtherCAT";
    } else {
        trip =
            measure_round_trip(options.interface, static_cast<std::int64_t>(options.seconds * 1e9),
                               [] { return false; });
    }
    report["round_trip"] = json_of(trip);
    if (options.json) return 0;
    return exit_code(print(head_of_rows(options.interface) + row_of("as it is", trip)));
}

}  // namespace

int run_interface_doctor(const DoctorOptions& options) {
    if (::if_nametoindex(options.interface.c_str()) == 0) {
        return fail(options, fmt::format("no interface '{}'; this computer has {}",
                                         options.interface, names_of_interfaces()));
    }
    if (options.hold && !options.trial) return fail(options, "--hold applies to --try");
    if (options.udp && options.trial) {
        return fail(options, "--try measures raw frames; it cannot be combined with --udp");
    }
    const std::vector<InterfaceSetting> settings = examine(examined(options));
    std::vector<Finding> findings;
    nlohmann::ordered_json report{{"interface", options.interface}};
    for (const InterfaceSetting& setting : settings) {
        findings.push_back(setting.finding);
        report["findings"].push_back(json_of(setting.finding));
    }
    if (!options.json && !print_findings(findings)) return 1;
    if (options.fix) return carry_out(options, remedies_of(findings));
    int status = 0;
    if (options.trial) {
        status = run_trial(options, settings, report);
    } else if (options.seconds > 0.0 && !options.udp) {
        status = run_measurement(options, report);
    }
    const bool printed = !options.json || print(report.dump(2) + "\n");
    return printed ? status : 1;
}

}  // namespace hal::tools
