// SPDX-License-Identifier: MIT
// Process data that the master copies from slave to slave, received and sent in the same cycle.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "ethercat/config/config.hpp"
#include "ethercat/master/master.hpp"
#include "hal/pin_codec.hpp"

namespace hal::ethercat {

/// The copies of a bus.
class DataCopies {
public:
    /// [setup]
    explicit DataCopies(const config::Bus& bus) {
        std::vector<std::size_t> first_area;
        std::size_t areas = 0;
        for (const master::Slave& slave : bus.setup.slaves) {
            first_area.push_back(areas);
            areas += slave.sync_managers.size();
        }
        for (const config::DataCopy& copy : bus.copies) {
            copies_.push_back({copy, first_area[copy.from.slave] + copy.from.sync_manager,
                               first_area[copy.to.slave] + copy.to.sync_manager});
        }
    }

    /// Copies inputs to outputs. While one of both slaves is not operational, the inputs are not
    /// valid: the outputs are the safe value, or stay. `areas`: process data by number. [realtime]
    void run(std::span<const std::span<std::uint8_t>> areas,
             const master::Master& master) const noexcept {
        for (const Copy& copy : copies_) {
            const bool valid = master.slave_status(copy.of.from.slave).operational &&
                               master.slave_status(copy.of.to.slave).operational;
            if (!valid && copy.of.hold) continue;
            for (unsigned done = 0; done < copy.of.bits; done += chunk) {
                const unsigned bits = std::min(copy.of.bits - done, chunk);
                const std::uint64_t safe = done == 0 ? copy.of.safe : 0;
                const std::uint64_t value =
                    valid ? read_bits(areas[copy.from_area], copy.of.from.bit + done, bits) : safe;
                write_bits(areas[copy.to_area], copy.of.to.bit + done, bits, value);
            }
        }
    }

private:
    static constexpr unsigned chunk = 64;
    struct Copy {
        config::DataCopy of;
        std::size_t from_area = 0;
        std::size_t to_area = 0;
    };
    std::vector<Copy> copies_;
};

}  // namespace hal::ethercat
