// SPDX-License-Identifier: MIT
// Several samples in a cycle, one at each pulse of SYNC0: none is lost or repeated on its way.
#include "ethercat/config/config.hpp"
#include "ethercat/devices/esi_device.hpp"
#include "ethercat/esi/lookup.hpp"
#include "tests/unit/ethercat/master_world.hpp"

namespace {

using namespace master_world;

/// A terminal with samples in both directions; `%` is AssignActivate.
constexpr const char* description = R"(<EtherCATInfo><Vendor><Id>4660</Id></Vendor><Descriptions>
<Devices><Device Physics="YY"><Type ProductCode="256" RevisionNo="1">BOTH</Type>
<Sm MaxSize="200" StartAddress="#x1000" ControlByte="#x44" Enable="1">Outputs</Sm>
<Sm MaxSize="200" StartAddress="#x1400" ControlByte="#x20" Enable="1">Inputs</Sm>
<RxPdo Fixed="1" Sm="0" OSFac="1" OSMax="100" OSIndexInc="16"><Index>#x1600</Index>
<Entry><Index>#x7000</Index><SubIndex>1</SubIndex><BitLen>16</BitLen><Name>Out</Name>
<DataType>UINT</DataType></Entry></RxPdo>
<TxPdo Fixed="1" Sm="1" OSFac="1" OSMax="100" OSIndexInc="16"><Index>#x1a00</Index>
<Entry><Index>#x6000</Index><SubIndex>1</SubIndex><BitLen>16</BitLen><Name>In</Name>
<DataType>UINT</DataType></Entry></TxPdo>
<Dc><OpMode><Name>DC</Name><AssignActivate>%</AssignActivate>
<CycleTimeSync0 Factor="-1">0</CycleTimeSync0><ShiftTimeSync0>150000</ShiftTimeSync0>
<CycleTimeSync1 Factor="-1">0</CycleTimeSync1>
<Sm No="0"><Pdo OSFac="1">#x1600</Pdo></Sm><Sm No="1"><Pdo OSFac="1">#x1a00</Pdo></Sm></OpMode></Dc>
<Eeprom><ByteSize>2048</ByteSize><ConfigData>050c448e</ConfigData></Eeprom>
</Device></Devices></Descriptions></EtherCATInfo>)";

std::string described(const std::string& activate) {
    std::string text = description;
    return text.replace(text.find('%'), 1, activate);
}

config::Bus bus_with(const std::string& activate, unsigned samples, const std::string& more = {}) {
    const std::string file =
        "[bus]\n[slave 0 x]\nesi = x.xml\noversampling = " + std::to_string(samples) + "\n" + more;
    const auto reading =
        config::read(file, "x.ethercat", [&](const std::string&, std::string& bytes) {
        bytes = described(activate);
        return true;
    });
    EXPECT_TRUE(reading.good()) << config::to_string(reading, "x.ethercat");
    return reading.buses.front();
}

/// Counts its inputs, and keeps its outputs.
struct Counting final : devices::Behaviour {
    explicit Counting(devices::Dictionary& dictionary)
        : in(dictionary.at(0x6000, 1)), out(dictionary.at(0x7000, 1)) {
        taken.reserve(100'000);
    }
    void step(devices::Step& s) noexcept override {
        if (s.sync_cycle_ns == 0) return;
        put(in, ++count);
        if (s.outputs_valid && taken.size() < taken.capacity()) {
            taken.push_back(get<std::uint16_t>(out));
        }
    }
    std::uint8_t* in;
    std::uint8_t* out;
    std::uint16_t count = 0;
    std::vector<std::uint16_t> taken;
};

/// The terminal on a line with the master.
struct Terminal {
    World world;
    esi::File file;
    std::unique_ptr<devices::Firmware> firmware;
    Counting* counting = nullptr;
    const unsigned samples;

    Terminal(const std::string& activate, unsigned n)
        : file(esi::read(described(activate))), samples(n) {
        devices::DeviceOptions options;
        options.description = std::make_shared<const esi::File>(file);
        options.described = &options.description->devices.front();
        devices::Parts parts = devices::make_esi_device(options);
        auto behaviour = std::make_unique<Counting>(*parts.design.dictionary);
        counting = behaviour.get();
        const auto sii = sii::build(parts.design.sii);
        firmware =
            std::make_unique<devices::Firmware>(std::move(parts.design), std::move(behaviour));
        world.line.add({.controller = {.dc = true}, .sii = sii, .application = firmware.get()});
        world.begin(bus_with(activate, n).setup);
    }
    std::uint16_t input(unsigned sample) {
        return get<std::uint16_t>(world.master->data(0, 1).data() + std::size_t{2} * sample);
    }
    void write(std::uint16_t first) {
        for (unsigned n = 0; n < samples; ++n) {
            put(world.master->data(0, 0).data() + std::size_t{2} * n,
                static_cast<std::uint16_t>(first + n));
        }
    }
};

void expect_no_lost_samples(const std::string& activate, unsigned samples) {
    Terminal t(activate, samples);
    ASSERT_TRUE(t.world.operational()) << t.world.log.text();
    std::uint16_t next = 0;
    std::uint16_t written = 1;
    std::optional<std::int64_t> time_ns;
    for (unsigned cycle = 0; cycle < 3000; ++cycle) {
        t.write(written);
        written = static_cast<std::uint16_t>(written + samples);
        t.world.cycle();
        for (unsigned n = 0; n < samples; ++n) {
            if (cycle != 0 || n != 0) {
                ASSERT_EQ(t.input(n), next) << "cycle " << cycle << " sample " << n;
            }
            next = static_cast<std::uint16_t>(t.input(n) + 1);
        }
        const auto first_ns = t.world.master->first_sample_ns(0);
        ASSERT_TRUE(first_ns.has_value());
        if (time_ns) {
            ASSERT_NEAR(static_cast<double>(*first_ns - *time_ns), 1e6, 50) << cycle;
        }
        time_ns = first_ns;
    }
    const auto& taken = t.counting->taken;
    ASSERT_GT(taken.size(), std::size_t{2990} * samples);
    const auto begin = std::find(taken.begin(), taken.end(), 1);
    ASSERT_NE(begin, taken.end());
    for (std::size_t n = 0; n < static_cast<std::size_t>(taken.end() - begin); ++n) {
        ASSERT_EQ(begin[static_cast<std::ptrdiff_t>(n)], static_cast<std::uint16_t>(n + 1)) << n;
    }
    EXPECT_EQ(t.firmware->missed_outputs(), 0U);
}

TEST(EthercatOversampling, No_sample_is_lost_or_repeated_with_SYNC1) {
    expect_no_lost_samples("#x0730", 10);
}

TEST(EthercatOversampling, No_sample_is_lost_or_repeated_without_SYNC1) {
    expect_no_lost_samples("#x0300", 5);
}

TEST(EthercatOversampling, SYNC0_divides_the_cycle_and_SYNC1_comes_at_its_last_pulse) {
    const auto setup = bus_with("#x0730", 4).setup;
    const Slave& slave = setup.slaves.front();
    EXPECT_EQ(slave.oversampling, 4U);
    EXPECT_EQ(slave.dc->sync0_cycle_ns, 250'000);
    EXPECT_EQ(slave.dc->sync1_cycle_ns, 750'000);
    EXPECT_EQ(slave.dc->sync0_shift_ns, 150'000);
    const auto& entries = slave.sync_managers.at(1).pdos.at(0).entries;
    ASSERT_EQ(entries.size(), 4U);
    EXPECT_EQ(entries[3].index, 0x6030);
    EXPECT_EQ(entries[3].pin_name(), "in-03");
}

TEST(EthercatOversampling, SYNC1_in_every_cycle_of_SYNC0_follows_it_by_its_shift) {
    std::string text = described("#x0700");
    const std::string factor = "<CycleTimeSync1 Factor=\"-1\">0</CycleTimeSync1>";
    text.replace(text.find(factor), factor.size(),
                 "<CycleTimeSync1 Factor=\"1\">0</CycleTimeSync1>"
                 "<ShiftTimeSync1>25000</ShiftTimeSync1>");
    const auto reading = config::read("[bus]\n[slave 0 x]\nesi = x.xml\ndc = DC\n", "x.ethercat",
                                      [&](const std::string&, std::string& bytes) {
        bytes = text;
        return true;
    });
    ASSERT_TRUE(reading.good()) << config::to_string(reading, "x.ethercat");
    const Slave& slave = reading.buses.front().setup.slaves.front();
    EXPECT_EQ(slave.oversampling, 1U);
    EXPECT_EQ(slave.dc->sync1_cycle_ns, 0) << "09A4h is the shift alone";
    EXPECT_EQ(slave.dc->sync1_shift_ns, 25'000);
}

TEST(EthercatOversampling, A_copy_takes_all_samples) {
    const config::Bus bus = bus_with("#x0730", 4, "[copy]\nx.out = x.in\n");
    ASSERT_EQ(bus.copies.size(), 4U);
    EXPECT_EQ(bus.copies[3].from.sync_manager, 1U);
    EXPECT_EQ(bus.copies[3].from.bit, 48U);
    EXPECT_EQ(bus.copies[3].to.sync_manager, 0U);
    EXPECT_EQ(bus.copies[3].to.bit, 48U);
    EXPECT_EQ(bus.copies[3].bits, 16U);
    EXPECT_TRUE(bus.setup.slaves[0].sync_managers[0].pdos[0].entries[3].copied);
}

TEST(EthercatOversampling, The_first_pulse_is_at_the_shift_from_the_begin_of_a_cycle) {
    Terminal t("#x0730", 8);
    ASSERT_TRUE(t.world.operational()) << t.world.log.text();
    t.world.run(100);
    const auto sync = t.world.line.controller(0).sync();
    EXPECT_EQ(sync.sync0_cycle_ns, 125'000U);
    EXPECT_EQ(sync.last_pulse_dc_ns % 125'000, 25'000U);
    const std::uint64_t begun = sync.last_pulse_dc_ns - (sync.pulses - 1) * 125'000;
    EXPECT_EQ(begun % 1'000'000, 150'000U);
}

}  // namespace
