// SPDX-License-Identifier: MIT
// A watchdog device: the kernel resets the host when nobody writes to it for its time-out. The supervisor writes.
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <unistd.h>

#include "machine/state.hpp"

namespace hal {

bool Session::attach_watchdog(const std::string& path, std::string& problem) {
    State& s = *state_;
    if (s.watchdog >= 0) {
        problem = "a watchdog is attached already";
        return false;
    }
    const int device = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK);
    if (device < 0) {
        problem = "cannot open '" + path + "': " + std::strerror(errno);
        return false;
    }
    s.watchdog = device;
    s.executor->supervisor().feed(device);
    return true;
}

bool Session::watchdog_disarmed() const { return state_->watchdog < 0; }

void Session::State::disarm_watchdog() {
    if (watchdog < 0) return;
    executor->supervisor().feed(-1);
    executor->supervisor().fence();
    // The letter that tells the driver that this close is meant; otherwise it resets the host.
    if (::write(watchdog, "V", 1) != 1) return;
    ::close(watchdog);
    watchdog = -1;
}

}  // namespace hal
