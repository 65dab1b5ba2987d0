// SPDX-License-Identifier: MIT
#include "segment.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <sched.h>
#include <thread>

#include "drivers/link/system.hpp"
#include "sample.hpp"

namespace hal::bench {

bool in_own_network(const std::function<void()>& work) {
    std::exception_ptr problem;
    bool allowed = false;
    std::thread([&] {
        if (::unshare(CLONE_NEWNET) != 0) return;
        allowed = true;
        try {
            work();
        } catch (...) {
            problem = std::current_exception();
        }
    }).join();
    if (problem) {
        std::rethrow_exception(problem);
    }
    return allowed;
}

std::vector<std::string> make_segment(int stations) {
    std::string commands =
        "ip link add bridge0 type bridge stp_state 0 forward_delay 0 mcast_snooping 0 && ip link "
        "set bridge0 up";
    std::vector<std::string> names;
    for (int i = 0; i < stations; ++i) {
        const std::string name = "bench" + std::to_string(i);
        const std::string plug = "plug" + std::to_string(i);
        commands += " && ip link add " + name + " type veth peer name " + plug +
                    " && ip link set " + plug + " master bridge0 up && ip link set " + name + " up";
        names.push_back(name);
    }
    return std::system(("( " + commands + " ) 2>/dev/null").c_str()) == 0
               ? names
               : std::vector<std::string>{};
}

void sleep_until(std::int64_t time) {
    const timespec t{time / 1'000'000'000, time % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

void wait_until(std::int64_t time, std::int64_t spin_ns) {
    if (time - link::monotonic_ns() > spin_ns) {
        sleep_until(time - spin_ns);
    }
    while (link::monotonic_ns() < time) {
    }
}

double trimmed_rms(std::vector<double>& samples) {
    if (samples.empty()) return 0.0;
    const double middle = median(samples);
    for (double& s : samples) {
        s = std::abs(s - middle);
    }
    std::sort(samples.begin(), samples.end());
    const std::size_t kept = samples.size() - samples.size() / 100;
    double squares = 0.0;
    for (std::size_t i = 0; i < kept; ++i) {
        squares += samples[i] * samples[i];
    }
    return std::sqrt(squares / static_cast<double>(kept));
}

}  // namespace hal::bench
