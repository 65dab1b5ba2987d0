// SPDX-License-Identifier: MIT
#include <cstdint>

#include "hal/component.hpp"
#include "hal/queue.hpp"
#include "hal/retained.hpp"

namespace {

/// Counts all edges of two phases; a change of both at once has no direction and is ignored.
class Edges {
public:
    int operator()(bool a, bool b) noexcept {
        // 0 1 2 3 in the order in which A leads B
        const unsigned now = unsigned{a != b} | unsigned{b} << 1;
        const unsigned moved = (now - last_) & 3u;
        last_ = now;
        if (!started_) {
            started_ = true;
            return 0;  // the first sample has no edges
        }
        if (moved == 1) return 1;
        if (moved == 3) return -1;
        return 0;
    }

private:
    unsigned last_ = 0;
    bool started_ = false;
};

struct Counted {
    std::int64_t master = 0;  // only counts made while enabled
    std::int64_t slave = 0;
};

struct EncoderRatio : hal::Component {
    using Component::Component;

    hal::Function sample{*this,
                         "sample",
                         &EncoderRatio::sample_phases,
                         "samples and counts; belongs in the fastest thread",
                         {.shared = true}};
    hal::In<bool> master_a{*this, sample, "master-A", "phase A of the master's encoder"};
    hal::In<bool> master_b{*this, sample, "master-B", "phase B of the master's encoder"};
    hal::In<bool> slave_a{*this, sample, "slave-A", "phase A of the slave's encoder"};
    hal::In<bool> slave_b{*this, sample, "slave-B", "phase B of the slave's encoder"};
    hal::In<bool> enable{
        *this, sample, "enable",
        "TRUE: the slave follows the master; FALSE: the master's motion is ignored"};

    hal::Function update{*this,
                         "update",
                         &EncoderRatio::update_error,
                         "computes the error; belongs in the servo thread",
                         {.shared = true}};
    hal::Out<double> error{*this,
                           update,
                           "error",
                           "position error of the slave, positive when ahead",
                           {.unit = "turn", .finite = true}};
    hal::Io<std::uint32_t> master_ppr{*this, update, "master-ppr",
                                      "counts per revolution of the master, four per pulse"};
    hal::Io<std::uint32_t> slave_ppr{*this, update, "slave-ppr",
                                     "counts per revolution of the slave, four per pulse"};
    hal::Io<std::uint32_t> master_teeth{*this, update, "master-teeth",
                                        "teeth of the master's gear"};
    hal::Io<std::uint32_t> slave_teeth{*this, update, "slave-teeth", "teeth of the slave's gear"};

    void sample_phases(hal::Cycle) noexcept {
        const int master = master_edges_(master_a, master_b);
        if (enable) {
            counted_.master += master;
        }
        counted_.slave += slave_edges_(slave_a, slave_b);
        handed_.put(counted_);
    }

    void update_error(hal::Cycle) noexcept {
        const Counted& now = handed_.get();
        const double master = turns(now.master, master_ppr);
        const double slave = turns(now.slave, slave_ppr);
        const double ratio =
            slave_teeth != 0 ? static_cast<double>(master_teeth) / static_cast<double>(slave_teeth)
                             : 0.0;
        error = slave - master * ratio;
    }

private:
    static double turns(std::int64_t counts, std::uint32_t per_turn) noexcept {
        return per_turn != 0 ? static_cast<double>(counts) / static_cast<double>(per_turn) : 0.0;
    }
    // sample only
    Edges master_edges_, slave_edges_;
    Counted counted_;
    hal::Mailbox<Counted> handed_;  // sample writes, update reads
    hal::Retained retained_{*this,
                            {{"master-edges", master_edges_},
                             {"slave-edges", slave_edges_},
                             {"counted", counted_},
                             {"handed", handed_}}};
};

}  // namespace

HAL_COMPONENT(EncoderRatio, "encoder_ratio",
              "Electronic gear: the error of a slave axis that follows a master", R"(
Counts the encoders of both axes and computes the error for the position loop of the slave:

    error = slave / slave-ppr - master / master-ppr * master-teeth / slave-teeth

Master counts are counted while `enable` is TRUE only, so engaging and releasing the gear causes no
jump; while it is FALSE the slave holds its position. All edges count: for an encoder with 500
pulses per revolution `ppr` is 2000. A `ppr` or `slave-teeth` of 0 disables that axis. A change of
`ppr` or teeth applies to all counts since the start (LinuxCNC: to later counts; with a `ppr` or
`slave-teeth` of 0 the error is held). `encoder-ratio.sample` must run at least twice as often as
edges occur.

    loadrt encoder_ratio names=hob
    loadrt pid names=hob-pid
    addf encoder-ratio.sample base-thread
    addf encoder-ratio.update servo-thread
    addf hob-pid.do-pid-calcs servo-thread
    setp hob.master-ppr 2000
    setp hob.slave-ppr 4000
    setp hob.master-teeth 1
    setp hob.slave-teeth 36
    net hob-error hob.error => hob-pid.feedback
)")
