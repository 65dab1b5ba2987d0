// SPDX-License-Identifier: MIT
// Settings of a participant as Fast DDS takes them. Included by the engine only.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "dds/engine.hpp"

namespace hal::dds {

/// Throws std::runtime_error: an interface that is not there, a bad address, a missing file of the security folder.
eprosima::fastdds::dds::DomainParticipantQos participant_qos(const Settings&);

/// Once per process, before anything of Fast DDS: no files read that nobody named, what it logs said on standard error, by us.
void prepare_library();

}  // namespace hal::dds
