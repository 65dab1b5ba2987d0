// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "machine/session.hpp"

namespace hal::tools {

/// What is loaded: instances by component, threads with period and functions, what of real time is
/// missing. Takes the session's lock.
std::string loaded_summary(Session& session);

/// How it ran: per thread cycles, missed periods, wake-up and execution times, faults, and the
/// slowest functions. While the threads exist, that is before shut_down(). Takes the session's
/// lock.
std::string timing_report(Session& session);

/// How a simulation ended: cycles of the threads and faults, a line and one for each fault.
/// `before`: how the line begins, "simulated 2 s". Takes the session's lock.
std::string simulated_summary(Session& session, std::string_view before);

}  // namespace hal::tools
