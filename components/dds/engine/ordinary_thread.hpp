// SPDX-License-Identifier: MIT
#pragma once

#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <exception>
#include <stdexcept>

namespace hal::dds {

/// Runs work in a thread with an ordinary policy and a small stack (mlockall makes stacks
/// resident); threads that the library starts there inherit both.
class OrdinaryThread {
public:
    template <class F>
    static void run(F&& work) {
        pthread_attr_t attributes, before;
        pthread_attr_init(&attributes);
        pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
        pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
        const sched_param none{};
        pthread_attr_setschedparam(&attributes, &none);
        pthread_attr_setstacksize(&attributes, stack);
        pthread_getattr_default_np(&before);
        pthread_attr_t small = before;
        pthread_attr_setstacksize(&small, stack);
        pthread_setattr_default_np(&small);
        struct Call {
            F& work;
            std::exception_ptr error;
        } call{work, {}};
        pthread_t thread{};
        const int failed = pthread_create(&thread, &attributes, [](void* p) -> void* {
            auto& c = *static_cast<Call*>(p);
            // inherited by the library's threads; if permitted
            setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), -10);
            try {
                c.work();
            } catch (...) {
                c.error = std::current_exception();
            }
            return nullptr;
        }, &call);
        if (failed == 0) {
            pthread_join(thread, nullptr);
        }
        pthread_setattr_default_np(&before);
        pthread_attr_destroy(&before);
        pthread_attr_destroy(&attributes);
        if (failed != 0) throw std::runtime_error("cannot start a thread for DDS");
        if (call.error) {
            std::rethrow_exception(call.error);
        }
    }

private:
    static constexpr std::size_t stack = std::size_t{512} * 1024;
};

}  // namespace hal::dds
