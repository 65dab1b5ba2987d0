// SPDX-License-Identifier: MIT
// Ends the process outside of the cycle, in the call that its argument names.
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

struct Exits : hal::Component {
    explicit Exits(const hal_host* host) : Component(host) { leave_in("constructor"); }
    hal::TextArgument in{*this, "in", "", "constructor, start, stop, thread or child"};
    hal::Function run{*this, "", &Exits::nothing, "nothing"};

    void start() {
        leave_in("start");
        if (in.get() == "child") {
            fork_child();
        }
        if (in.get() != "thread") return;
        std::thread helper([] {
            pthread_setname_np(pthread_self(), "helper");
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            std::exit(0);
        });
        helper.detach();
    }
    void stop() noexcept { leave_in("stop"); }
    void nothing(hal::Cycle) noexcept {}

private:
    // A process that the component forks ends as it likes.
    static void fork_child() {
        const pid_t child = fork();
        if (child == 0) {
            _exit(0);
        }
        int status = 0;
        if (waitpid(child, &status, 0) != child || status != 0) {
            throw std::runtime_error("the child ended with another status");
        }
    }
    void leave_in(const char* place) {
        if (in.get() == place) {
            std::exit(0);
        }
    }
};

}  // namespace

HAL_COMPONENT(Exits, "test-exits", "Ends the process outside of the cycle")
