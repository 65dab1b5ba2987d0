// SPDX-License-Identifier: MIT
// Oversampling of a slave in a `.ethercat` file: its device takes several samples in a cycle, one
// at each pulse of SYNC0 (ETG.2000: OSFac, OSMin, OSMax of PDOs, OpMode/Sm/Pdo). Everything here is
// [setup].
#pragma once

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

class SlaveOversampling {
public:
    /// `device` is the description of the slave; nullptr: it has none.
    SlaveOversampling(SlaveInput in, const esi::Device* device) : in_(in), device_(device) {}

    /// Reads `oversampling` for the operation mode of `dc`; nullptr: `dc` names none. Sets the
    /// samples of the slave, and returns the mode to use. Reports what the device does not offer.
    const esi::OpMode* read(const esi::OpMode* mode);

    /// Returns the clock settings of an operation mode with so many samples in a cycle.
    static master::Dc clocks_of(const esi::OpMode&, std::int64_t cycle_ns, unsigned samples);

    /// Repeats the entries of PDOs with samples for each sample.
    void expand();

private:
    /// Numbers of samples that a mode offers: `first` to `last`.
    struct Range {
        unsigned first = 1;
        unsigned last = 0;  ///< below `first`: none
        bool contains(unsigned n) const noexcept { return first <= n && n <= last; }
    };
    Range range_of(const esi::OpMode&) const;
    const esi::OpMode* mode_with(unsigned samples) const;
    std::vector<std::string> offered() const;
    bool check_cycle(const Line&, unsigned samples);
    const esi::Pdo* described(const master::Pdo&) const;

    SlaveInput in_;
    const esi::Device* device_;
};

}  // namespace hal::ethercat::config
