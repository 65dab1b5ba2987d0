// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <string>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

/// Waits where a test decides it. FILE.started, FILE.holding: it waits now. FILE.go ends start();
/// the function does not return while FILE.hold exists.
struct Timed : hal::Component {
    using Component::Component;

    hal::TextArgument file{*this, "file", "", "begin of the names of the files"};
    hal::Argument waits{*this, "waits", 0, "1: start() waits for FILE.go", {.min = 0, .max = 1}};
    hal::Out<double> out{*this, "out", "number of cycles"};
    hal::Function run{*this, "", &Timed::step, "counts"};

    void start(const hal_host&) {
        const std::string name = file.get();
        hold_ = name + ".hold";
        holding_ = name + ".holding";
        if (waits == 0) return;
        mark(name + ".started");
        while (!exists(name + ".go")) {
            ::usleep(1000);
        }
    }
    void step(hal::Cycle) noexcept {
        out = out + 1;
        while (exists(hold_)) {
            mark(holding_);
            ::usleep(1000);
        }
    }

private:
    static bool exists(const std::string& path) { return ::access(path.c_str(), F_OK) == 0; }
    static void mark(const std::string& path) {
        const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
        if (descriptor >= 0) {
            ::close(descriptor);
        }
    }
    std::string hold_;
    std::string holding_;
};

}  // namespace

HAL_COMPONENT(Timed, "timed", "Waits when a test asks for it")
