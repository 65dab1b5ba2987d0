// SPDX-License-Identifier: MIT
// The life of an instance after its construction: start, stop, destroy.
#include <cstring>

#include "execute/executor.hpp"
#include "hal/path_delay.h"
#include "hal/setup_time.h"
#include "hal/supervision.h"
#include "machine/load/construct.hpp"
#include "machine/load/setup_call.hpp"

namespace hal {
namespace {
struct Starting {
    Instance& instance;
    const Model& model;
    Executor& executor;
    const hal_status& status;
    const hal_messages& messages;
    Failure failure;

    bool fail(const char* reason) noexcept {
        try {
            if (failure.empty()) {
                failure.text = reason;
            }
        } catch (const std::bad_alloc&) {
        }  // then it gives no reason
        return false;
    }
    void reject(const hal_rejection& rejection) noexcept {
        if (!failure.empty()) return;
        if (rejection.size < sizeof rejection) {
            fail("its reason has an unknown format; rebuild the component");
            return;
        }
        try {
            failure = copy_of(rejection);
        } catch (const std::bad_alloc&) {
        }
    }
};

bool publish_stream(const hal_host* host, const char* name, hal_stream* stream) {
    Starting& starting = *static_cast<Starting*>(host->data);
    try {
        Instance& instance = starting.instance;
        instance.streams.emplace_back(*name ? instance.name + "." + name : instance.name, stream);
        return true;
    } catch (const std::bad_alloc&) {
        return starting.fail("there is no memory left for its stream");
    }
}
constexpr hal_stream_host stream_host{sizeof stream_host, publish_stream};

bool report_path_delay(const hal_path_delay*, const hal_host* host, const char* pin,
                       const char* far, std::uint32_t cycles, std::uint32_t round_trip,
                       std::int64_t worst_ns) {
    Instance& instance = static_cast<Starting*>(host->data)->instance;
    try {
        const std::string name = instance.name + "." + pin;
        for (const auto& one : instance.pins) {
            if (one->name == name) {
                instance.path_delays.push_back({one.get(), far, cycles, round_trip, worst_ns});
            }
        }
        return true;
    } catch (const std::bad_alloc&) {
        return false;
    }
}
constexpr hal_path_delay path_delay_host{sizeof path_delay_host, report_path_delay};

constexpr hal_setup_time setup_time_host{
    sizeof setup_time_host, 0,
    [](const hal_setup_time*, std::int64_t ns, const char* why) { SetupCall::expect(ns, why); }};

bool claim_clock(const hal_clock*, const hal_host* host) {
    Starting& starting = *static_cast<Starting*>(host->data);
    if (const Instance* const other = clock_leader(starting.model);
        other && other != &starting.instance) {
        try {
            starting.failure = {
                .text = "the threads already follow the clock of '" + other->name + "' (" +
                        other->component->name + ")",
                .help =
                    "let one of them follow the threads: `clock = thread` in [bus] of an EtherCAT "
                    "bus, `clock = own` of a CANopen bus; or unload '" +
                    other->name + "' first"};
            return false;
        } catch (const std::bad_alloc&) {
            return starting.fail("the threads already follow the clock of another instance");
        }
    }
    starting.instance.leads_clock = true;
    starting.executor.lead();
    return true;
}
}  // namespace

const Instance* clock_leader(const Model& model) {
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            if (instance->leads_clock) return instance.get();
        }
    }
    return nullptr;
}

Failure start_instance(Instance& instance, const Model& model, Executor& executor,
                       const hal_status& status, const hal_messages& messages) {
    Starting starting{instance, model, executor, status, messages, {}};
    instance.helpers = 0;
    executor.clock().claim = claim_clock;
    const hal_host host{
        sizeof host, &starting, [](const hal_host* h, const hal_pin_decl*, hal_pin*) {
        return static_cast<Starting*>(h->data)->fail(
            "pins are declared in the constructor, not in start");
    }, [](const hal_host* h, const hal_function_decl*) {
        return static_cast<Starting*>(h->data)->fail(
            "functions are declared in the constructor, not in start");
    }, [](const hal_host*, const hal_argument_decl* decl) {
        return decl->fallback;
    }, [](const hal_host* h, std::size_t bytes, std::size_t align) {
        return allocate_for(static_cast<Starting*>(h->data)->instance, bytes, align);
    }, [](const hal_host* h, const char* reason) {
        static_cast<Starting*>(h->data)->fail(reason ? reason : "");
    }, [](const hal_host* h, const char* id) -> const void* {
        if (std::strcmp(id, "hal.stream/1") == 0) return &stream_host;
        if (std::strcmp(id, "hal.faults/1") == 0) {
            return &static_cast<Starting*>(h->data)->executor.board().shared.faults;
        }
        if (std::strcmp(id, HAL_LASTING_FAULTS) == 0) {
            return &static_cast<Starting*>(h->data)->executor.board().shared;
        }
        if (std::strcmp(id, HAL_STATUS) == 0) return &static_cast<Starting*>(h->data)->status;
        if (std::strcmp(id, HAL_MESSAGES) == 0) return &static_cast<Starting*>(h->data)->messages;
        if (std::strcmp(id, "hal.clock/1") == 0) {
            return &static_cast<Starting*>(h->data)->executor.clock();
        }
        if (std::strcmp(id, HAL_SUPERVISION) == 0) {
            Starting& request = *static_cast<Starting*>(h->data);
            request.instance.reads_supervision = true;
            return &request.executor.seen_supervision();
        }
        if (std::strcmp(id, HAL_PATH_DELAY) == 0) return &path_delay_host;
        if (std::strcmp(id, HAL_SETUP_TIME) == 0) return &setup_time_host;
        if (std::strcmp(id, HAL_BACKGROUND) == 0) {
            Starting& request = *static_cast<Starting*>(h->data);
            ++request.instance.helpers;
            return &request.executor.background();
        }
        return nullptr;
    }, [](const hal_host* h, const hal_rejection* rejection) {
        static_cast<Starting*>(h->data)->reject(*rejection);
    }};
    {
        const SetupCall call(instance.name, instance.component->name, "start");
        instance.started = instance.component->plugin->start(instance.memory, &host);
    }
    if (instance.started) {
        return {};
    }
    instance.streams.clear();
    instance.path_delays.clear();
    instance.leads_clock = false;
    if (starting.failure.empty()) {
        starting.failure.text = "it gave no reason";
    }
    return starting.failure;
}

void stop_instance(Instance& instance) noexcept {
    if (!instance.started) return;
    hal_cycle none{};
    none.size = sizeof none;
    for (const plan::Step& step : instance.emergency) {
        step.step(step.self, &none);
    }
    const SetupCall call(instance.name, instance.component->name, "stop");
    instance.component->plugin->stop(instance.memory);
    instance.streams.clear();
    instance.path_delays.clear();
    instance.leads_clock = false;
    instance.started = false;
}

void destroy_instance(Instance& instance) noexcept {
    stop_instance(instance);
    if (!instance.constructed) return;
    const SetupCall call(instance.name, instance.component->name, "its destructor");
    instance.component->plugin->destroy(instance.memory);
    instance.constructed = false;
}

}  // namespace hal
