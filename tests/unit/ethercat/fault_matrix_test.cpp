// SPDX-License-Identifier: MIT
// Whatever failed on the wire, the bus is in OP again afterwards, and outputs stay off until then.
// HALCYON_ETHERCAT_FAULT_HOURS=1 runs the matrix in full, and then random faults until that much
// virtual time has passed.
#include <malloc.h>

#include <random>

#include "tests/unit/ethercat/fault_matrix.hpp"

namespace {

using namespace fault_matrix;

double hours() {
    const char* text = std::getenv("HALCYON_ETHERCAT_FAULT_HOURS");
    return text != nullptr ? std::atof(text) : 0;
}

std::string words(Fault fault, Kind kind, unsigned every, const char* when) {
    return std::string("frame ") + name(fault) + ", " + name(kind) + ", every " +
           std::to_string(every) + ", " + when;
}

/// What a run was like, for the record.
struct Summary {
    std::uint64_t faults = 0;
    std::uint64_t hits = 0;
    std::int64_t virtual_ns = 0;
    unsigned max = 0;
    std::string at;
    void add(unsigned cycles, const std::string& what) {
        ++faults;
        if (cycles > max) {
            max = cycles;
            at = what;
        }
    }
    ~Summary() {
        std::printf(
            "%llu faults, %llu frames hit, %.0f s of virtual time; longest way back to OP %u ms "
            "(%s)\n",
            static_cast<unsigned long long>(faults), static_cast<unsigned long long>(hits),
            static_cast<double>(virtual_ns) * 1e-9, max, at.c_str());
    }
};

std::vector<unsigned> periods(unsigned seed) {
    if (hours() > 0) {
        std::vector<unsigned> all;
        for (unsigned n = 2; n <= 50; ++n) {
            all.push_back(n);
        }
        return all;
    }
    return {2, 3 + seed * 7 % 48};
}

TEST(EthercatFaultMatrix, Each_nth_frame_of_each_kind_fails_while_booting_and_in_op) {
    Summary summary;
    unsigned seed = 0;
    for (unsigned f = 1; f <= static_cast<unsigned>(Fault::last); ++f) {
        for (unsigned k = 0; k <= static_cast<unsigned>(Kind::last); ++k) {
            for (const unsigned every : periods(++seed)) {
                const auto fault = static_cast<Fault>(f);
                const auto kind = static_cast<Kind>(k);
                Machine m;
                for (const char* when : {"booting", "in OP"}) {
                    const std::string what = words(fault, kind, every, when);
                    m.port.fault = fault;
                    m.port.kind = kind;
                    m.port.every = every;
                    m.run(300);
                    m.repair();
                    const unsigned cycles = m.recover();
                    ASSERT_NE(cycles, 0U) << what << m.events.text(m.setup);
                    ASSERT_EQ(m.wrong, "") << what << m.events.text(m.setup);
                    summary.add(cycles, what);
                }
                summary.hits += m.port.hits;
                summary.virtual_ns += m.now_ns;
            }
        }
    }
}

TEST(EthercatFaultMatrix, A_clock_whose_times_were_not_read_is_not_set) {
    for (unsigned every = 2; every <= 12; ++every) {
        Machine m;
        m.port.fault = Fault::lost;
        m.port.kind = Kind::clock;
        m.port.every = every;
        m.run(300);
        m.repair();
        ASSERT_NE(m.recover(20'000), 0U) << every << m.events.text(m.setup);
    }
}

TEST(EthercatFaultMatrix, Frames_cables_and_power_fail_at_random) {
    Summary summary;
    const auto until_ns = static_cast<std::int64_t>(hours() * 3600e9);
    for (unsigned seed = 1; seed <= 8 || summary.virtual_ns < until_ns; ++seed) {
        Machine m;
        std::mt19937 generator(seed);
        const auto random = [&](unsigned below) {
            return static_cast<unsigned>(generator() % below);
        };
        for (unsigned round = 0; round < 10; ++round) {
            const std::string what =
                "seed " + std::to_string(seed) + " round " + std::to_string(round);
            for (unsigned step = 0; step < 8; ++step) {
                const std::size_t slave = random(Machine::slaves);
                switch (random(6)) {
                case 0: m.line.set_power(slave, false, m.now_ns); break;
                case 1: m.line.set_power(slave, true, m.now_ns); break;
                case 2: m.line.set_cable(slave, 0, random(2) == 0); break;
                case 3:
                    m.jumped_ns = m.now_ns;

                    m.line.controller(slave).jump_clock(
                        static_cast<std::int64_t>(random(2'000'000)) - 1'000'000, m.now_ns);
                    break;
                default:
                    m.port.fault =
                        static_cast<Fault>(random(static_cast<unsigned>(Fault::last) + 1));
                    m.port.kind = static_cast<Kind>(random(static_cast<unsigned>(Kind::last) + 1));
                    m.port.every = 2 + random(49);
                    m.port.late_cycles = 1 + random(4);
                }
                m.run(random(200));
            }
            m.repair();
            const std::uint64_t before = m.events.count();
            m.run(300);  // the last change is noticed
            const unsigned cycles = m.recover();
            ASSERT_NE(cycles, 0U) << what << m.events.text(m.setup)
                                  << "\nevents since repair: " << m.events.count() - before;
            ASSERT_EQ(m.wrong, "") << what << m.events.text(m.setup);
            summary.add(cycles, what);
        }
        summary.hits += m.port.hits;
        summary.virtual_ns += m.now_ns;
    }
}

TEST(EthercatFaultMatrix, Memory_does_not_grow) {
    Machine m;
    const auto fail = [&](unsigned rounds) {
        for (unsigned n = 0; n < rounds; ++n) {
            m.port.fault = static_cast<Fault>(1 + n % static_cast<unsigned>(Fault::last));

            m.port.kind = Kind::any;
            m.port.every = 3;
            m.line.set_power(n % Machine::slaves, false, m.now_ns);
            m.run(150);
            m.repair();
            m.run(1500);
        }
    };
    fail(2);
    const auto before = mallinfo2().uordblks;
    fail(6);
    EXPECT_EQ(mallinfo2().uordblks, before) << "bytes on the heap";
}

}  // namespace
