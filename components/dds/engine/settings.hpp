// SPDX-License-Identifier: MIT
// Settings of a participant as Fast DDS takes them. Included by the engine only.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "dds/engine.hpp"

namespace hal::dds {

/// Returns the QoS of a participant. Throws std::runtime_error for an unknown interface, an invalid
/// address, a missing file.
eprosima::fastdds::dds::DomainParticipantQos participant_qos(const Settings&);

/// Prepares Fast DDS, once per process and before its first use: it reads no configuration file
/// that was not named, and logs through engine_log().
void prepare_library();

}  // namespace hal::dds
