// SPDX-License-Identifier: MIT
// One program of a session: its process, the component that it registered, and its restarts.
//
//   Unregistered -> Initializing -> Ready
//        |               |           |     its connection or its process ends
//        +---------------+-----------+---> Dead: pins keep their values, then take the declared ones
//                                           |
//                  a successor registers the name and takes over the pins: Initializing or Ready
//
// The process is another matter: a component may be dead while its process still runs, and the
// process of a component need not be a child of this one.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <sys/types.h>

#include "hal/abi.h"
#include "machine/processes/spawner.hpp"

namespace hal {

struct Pin;

enum class Restart { no, on_failure, always };

/// Whether a program that has ended is started again, modelled on systemd's Restart=, RestartSec=
/// and StartLimit….
struct RestartPolicy {
    Restart when = Restart::no;
    std::int64_t delay_ns = 1'000'000'000;
    static constexpr std::size_t max_restarts = 5;  ///< within …
    /// … this time; after that it is not started again
    static constexpr std::int64_t within_ns = 10'000'000'000;
};

/// A pin or parameter of a program's component.
struct ProgramPin {
    std::string name;  ///< full name
    hal_type type = HAL_TYPE_BIT;
    hal_dir dir = HAL_DIR_IN;
    bool read_only = false;  ///< a parameter that only the program sets
    hal_value initial{};
    /// its value once the program is dead; none: it keeps its value
    std::optional<hal_value> safe = {};
    std::string doc = {};
    std::string unit = {};
};

/// A stream between programs: one feeds it, one reads it.
struct ProgramStream {
    std::string name, types;
    std::vector<hal_value> memory;
    hal_stream stream{};
};

struct ProgramEntry {
    enum class Process {
        foreign,  ///< not started by this process, which sees only the end of its connection
        running,  ///< a child
        ended  ///< a child whose exit status is known
    };

    /// Not registered over the socket: just started, or it has left.
    struct Unregistered {};
    /// A connection has registered it and still adds pins.
    struct Initializing {
        bool succeeds = false;  ///< it took over the pins and links of a dead program
    };
    struct Ready {};
    struct Dead {
        std::int64_t since_ns = 0;  ///< on the steady clock
        std::string report = {};  ///< "since 12:34:56 (exit status 1)"
        bool declared = false;  ///< its pins have taken their declared values
        bool restarted = false;  ///< a successor has been started
    };

    /// The rate of exchanges that the component has declared.
    struct Heartbeat {
        std::int64_t every_ns = 0;  ///< longest time between two exchanges; 0: none declared
        std::int64_t last_ns = 0;  ///< of the last sign of life; kept while every_ns is not 0
        std::string missing = {};  ///< "since 12:34:56" while it does not respond
        /// the values of its pins before they took the declared ones
        std::vector<std::pair<Pin*, hal_value>> before_timeout = {};
    };

    struct Restarts {
        RestartPolicy policy = {};
        ProcessStart start = {};  ///< how to start it again
        std::vector<std::int64_t> recent = {};  ///< times of those within RestartPolicy::within_ns
        std::int64_t due_ns = 0;  ///< of the next one; 0: none
    };

    static constexpr std::int64_t usual_timeout_ns = 1'000'000'000;

    std::uint64_t number = 0;  ///< of this entry, for as long as it lives
    std::string name = {};  ///< of the component; empty: it is not one
    std::string started_as = {};  ///< the name that loadusr gave it; empty: not started by one
    pid_t pid = 0;
    Process process = Process::foreign;
    int status = 0;  ///< once the process has ended: exit status, or 128 + signal
    /// a `loadusr -w` waits for its status: kept after its end, until collect()
    bool waited = false;
    /// until it is ready, the name is that of this process, whatever else the process registers
    bool reserved = false;
    bool stopping = false;  ///< it was sent SIGTERM: not started again

    std::variant<Unregistered, Initializing, Ready, Dead> component = {};
    std::uint64_t owner = 0;  ///< the connection that answers for the component; 0: none
    std::vector<Pin*> pins = {};  ///< of the living program, by its numbers
    /// from its death until its pins take their declared values; < 0: never
    std::int64_t timeout_ns = usual_timeout_ns;
    Heartbeat heartbeat = {};
    Restarts restarts = {};
    std::int64_t kill_ns = 0;  ///< when it gets SIGKILL; 0: never
    std::vector<std::shared_ptr<ProgramStream>> streams = {};  ///< it made; they go with it

    bool ready() const { return std::holds_alternative<Ready>(component); }
    bool registered() const { return ready() || std::holds_alternative<Initializing>(component); }
    /// It has taken over a dead program's pins and has not declared that it has all of them.
    bool is_unready_successor() const {
        const auto* const initializing = std::get_if<Initializing>(&component);
        return initializing && initializing->succeeds;
    }
    /// Returns nullptr while it lives.
    const Dead* death() const { return std::get_if<Dead>(&component); }
    Dead* death() { return std::get_if<Dead>(&component); }
    bool dead() const { return death() != nullptr; }
    bool responds() const { return ready() && heartbeat.missing.empty(); }
    /// The process is a child that has not ended.
    bool running() const { return process == Process::running; }
    bool ended() const { return process == Process::ended; }
    /// Nothing is left of it but the pins that wait for a successor.
    bool gone() const { return dead() && !running(); }
    /// A successor is started, or will be.
    bool comes_back() const;
    /// When a component that does not respond times out; 0: never.
    std::int64_t heartbeat_due_ns() const;
    /// When the pins of a dead one take their declared values; 0: they have, or never do.
    std::int64_t declared_due_ns() const;
    /// The earliest of all times at which something is to be done; INT64_MAX: none.
    std::int64_t next_due_ns() const;

    /// The component dies: only its name, its streams and the restarts stay.
    void die(std::int64_t now_ns, std::string report);
    /// The component is no longer registered.
    void unregister();

    /// As `show comp` prints it.
    std::string state() const;
};

/// Returns the local time of day `ago_ns` ago: "12:34:56".
std::string time_of_day(std::int64_t ago_ns = 0);

/// Returns "exit status 1" or "SIGTERM" for ProgramEntry::status.
std::string exit_text(int status);

}  // namespace hal
