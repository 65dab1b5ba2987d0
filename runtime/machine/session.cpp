// SPDX-License-Identifier: MIT
#include "machine/session.hpp"

#include <utility>

#include "machine/processes/programs.hpp"

namespace hal {

Session::Session(SessionOptions options)
    : RunningModel(std::move(options)), programs_(std::make_unique<Programs>(*this, state())) {}

Session::~Session() = default;

}  // namespace hal
