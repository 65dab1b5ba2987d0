// SPDX-License-Identifier: MIT
// The table of lcec's devices, and the channels that it names.
#include "ethercat/config/lcec_devices.hpp"

#include <bit>
#include <map>
#include <set>

#include "ethercat/master/request_queue.hpp"
#include "ethercat/plugins/channels/make_channel.hpp"
#include "tests/unit/ethercat/mailbox_slave.hpp"
#include "tests/unit/ethercat/pin_host.hpp"

namespace hal::ethercat {
namespace {

using config::build_lcec_device;
using config::Channel;
using config::find_lcec_device;
using config::LcecDevice;

/// A device of the table with its process data in memory, and all its channels.
class Bench {
public:
    explicit Bench(const std::string& type, std::map<std::string, std::string> parameters = {}) {
        device = *find_lcec_device(type);
        build_lcec_device(device, parameters, 1'000'000, slave, info, problems);
        for (const auto& sm : slave.sync_managers) {
            std::size_t bits = 0;
            for (const auto& pdo : sm.pdos) {
                for (const auto& e : pdo.entries) {
                    bits += e.bits;
                }
            }
            memory_.emplace_back((bits + 7) / 8);
        }
        areas_.assign(memory_.begin(), memory_.end());
        for (const Channel& channel : info.channels) {
            const ChannelPlan plan(component_, component_.reads, component_.writes, "x", channel,
                                   &Bench::find, this);
            channels_.push_back(make_channel(plan));
        }
    }

    ImageField field(std::uint16_t index, std::uint8_t sub) const {
        return find(this, {index, sub, 0, 0});
    }
    SlaveImage image(bool operational = true) const {
        return {areas_, operational, 1'000'000, mailbox != nullptr, 0, mailbox};
    }
    void set(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
        field(index, sub).write(image(), value);
    }
    std::int64_t get(std::uint16_t index, std::uint8_t sub) {
        return field(index, sub).read_signed(image());
    }
    void read(bool operational = true) {
        for (const auto& channel : channels_) {
            channel->read(image(operational));
        }
    }
    void write() {
        for (const auto& channel : channels_) {
            channel->write(image());
        }
    }
    template <class T>
    T& pin(const std::string& name) {
        return host.value<T>("x." + name);
    }

    LcecDevice device;
    master::Slave slave;
    config::SlaveInfo info;
    std::vector<std::string> problems;
    std::size_t unknown_objects = 0;
    PinHost host;
    master::RequestPort* mailbox = nullptr;

private:
    struct Owner : hal::Component {
        using Component::Component;
        hal::Function reads{*this, "read", &Owner::nothing, "reads"};
        hal::Function writes{*this, "write", &Owner::nothing, "writes"};
        void nothing(hal::Cycle) noexcept {}
    };

    static ImageField find(const void* context, const config::ChannelObject& object) {
        const Bench& bench = *static_cast<const Bench*>(context);
        for (std::size_t area = 0; area < bench.slave.sync_managers.size(); ++area) {
            std::size_t at = 0;
            ImageField found;
            for (const auto& pdo : bench.slave.sync_managers[area].pdos) {
                for (const auto& e : pdo.entries) {
                    if (e.index == object.index && e.sub == object.sub) {
                        found = {area, found.present() ? found.at : at, found.bits + e.bits};
                    }
                    at += e.bits;
                }
            }
            if (found.present()) {
                found.at += object.first_bit;
                found.bits = object.bits != 0 ? object.bits : found.bits;
                return found;
            }
        }
        const_cast<Bench&>(bench).unknown_objects++;
        return {};
    }

    std::vector<std::vector<std::uint8_t>> memory_;
    std::vector<std::span<std::uint8_t>> areas_;
    Owner component_{host.get()};
    std::vector<std::unique_ptr<hal::ethercat::Channel>> channels_;
};

TEST(LcecDevices, Every_device_of_the_table_has_the_objects_of_its_channels) {
    std::set<std::string> names;
    for (const std::string& name : config::lcec_device_names()) {
        EXPECT_TRUE(names.insert(name).second) << "duplicate " << name;
        Bench bench(name);
        EXPECT_TRUE(bench.problems.empty()) << name;
        EXPECT_EQ(bench.unknown_objects, 0U) << name;
        EXPECT_NE(bench.device.product, 0U) << name;
        for (const auto& sm : bench.slave.sync_managers) {
            EXPECT_FALSE(sm.pdos.empty()) << name;
        }
        bench.read();
        bench.write();
    }
    EXPECT_GT(names.size(), 260U);
    for (const std::string& name : config::unsupported_lcec_devices()) {
        EXPECT_FALSE(find_lcec_device(name)) << name;
    }
}

TEST(LcecDevices, Digital_inputs_have_an_inverted_pin) {
    Bench bench("EL1008");
    EXPECT_EQ(bench.device.vendor, 2U);
    EXPECT_EQ(bench.device.product, 0x03f03052U);
    EXPECT_EQ(bench.slave.sync_managers.at(0).number, 0);
    EXPECT_EQ(bench.host.declared().size(), 16U);
    EXPECT_EQ(bench.host.declared().at("x.din-7-not"), "out bit");
    bench.set(0x6030, 1, 1);
    bench.read();
    EXPECT_TRUE(bench.pin<bool>("din-3"));
    EXPECT_FALSE(bench.pin<bool>("din-3-not"));
    EXPECT_TRUE(bench.pin<bool>("din-2-not"));
}

TEST(LcecDevices, Digital_outputs_can_be_inverted) {
    Bench bench("EL2809");
    EXPECT_EQ(bench.slave.sync_managers.size(), 2U);
    EXPECT_EQ(bench.host.declared().at("x.dout-15-invert"), "param bit");
    bench.pin<bool>("dout-9") = true;
    bench.pin<bool>("dout-15-invert") = true;
    bench.write();
    EXPECT_EQ(bench.field(0x7090, 1).read(bench.image()), 1U);
    EXPECT_EQ(bench.field(0x70f0, 1).read(bench.image()), 1U);
    EXPECT_EQ(bench.field(0x7000, 1).read(bench.image()), 0U);
}

TEST(LcecDevices, Analog_inputs_are_scaled_and_show_their_state) {
    Bench bench("EL3104");
    bench.pin<double>("ain-1-scale") = 10;
    bench.pin<double>("ain-1-bias") = 1;
    bench.set(0x6010, 0x11, 16384);
    bench.set(0x6010, 2, 1);
    bench.set(0x6010, 0x0e, 1);
    bench.read(false);
    EXPECT_EQ(bench.pin<std::int32_t>("ain-1-raw"), 0) << "not operational";
    bench.read();
    EXPECT_EQ(bench.pin<std::int32_t>("ain-1-raw"), 16384);
    EXPECT_NEAR(bench.pin<double>("ain-1-val"), 6.00015, 1e-5);
    EXPECT_TRUE(bench.pin<bool>("ain-1-overrange"));
    EXPECT_TRUE(bench.pin<bool>("ain-1-sync-err"));
    EXPECT_FALSE(bench.pin<bool>("ain-1-error"));
}

TEST(LcecDevices, Temperature_inputs_follow_their_modParams) {
    Bench bench("EL3202", {{"ch1Sensor", "ohm/16"}, {"ch0Resolution", "High"}, {"ch0Wires", "3"}});
    ASSERT_TRUE(bench.problems.empty());
    ASSERT_EQ(bench.slave.startup.size(), 3U);
    EXPECT_EQ(bench.slave.startup[0].index, 0x8010);
    EXPECT_EQ(bench.slave.startup[0].sub, 0x19);
    EXPECT_EQ(bench.slave.startup[0].data, (std::vector<std::uint8_t>{8, 0}));
    EXPECT_EQ(bench.slave.startup[1].data, (std::vector<std::uint8_t>{2}));
    bench.set(0x6000, 0x11, 2345);
    bench.set(0x6010, 0x11, 0xfff0);
    bench.read();
    EXPECT_NEAR(bench.pin<double>("temp-0-temperature"), 23.45, 1e-9);
    EXPECT_NEAR(bench.pin<double>("temp-1-temperature"), 4095.0, 1e-9) << "without a sign";
    Bench wrong("EL3202", {{"ch0Sensor", "Pt99"}});
    ASSERT_EQ(wrong.problems.size(), 1U);
    EXPECT_EQ(wrong.problems[0],
              "invalid value 'Pt99' of modParam 'ch0Sensor': expected Pt100, Ni100, Pt1000, Pt500, "
              "Pt200, Ni1000, Ni1000-TK5000, Ni120, Ohm/16 or Ohm/64");
}

TEST(LcecDevices, Analog_outputs_are_limited_to_their_duty_cycle) {
    Bench bench("EL4002");
    bench.pin<double>("aout-0-scale") = 10;
    bench.pin<double>("aout-0-value") = -5;
    bench.write();
    EXPECT_EQ(bench.get(0x7000, 1), 0) << "not enabled";
    bench.pin<bool>("aout-0-enable") = true;
    bench.write();
    EXPECT_EQ(bench.get(0x7000, 1), -16383);
    EXPECT_TRUE(bench.pin<bool>("aout-0-neg"));
    bench.pin<bool>("aout-0-absmode") = true;
    bench.pin<double>("aout-0-max-dc") = 0.25;
    bench.write();
    EXPECT_EQ(bench.get(0x7000, 1), 8191);
    EXPECT_DOUBLE_EQ(bench.pin<double>("aout-0-curr-dc"), 0.25);
    bench.pin<double>("aout-0-scale") = 0;
    bench.pin<double>("aout-0-max-dc") = 7;
    bench.write();
    EXPECT_DOUBLE_EQ(bench.pin<double>("aout-0-scale"), 1.0);
    EXPECT_DOUBLE_EQ(bench.pin<double>("aout-0-max-dc"), 1.0);
    bench.pin<double>("aout-0-value") = std::nan("");
    bench.write();
    EXPECT_EQ(bench.get(0x7000, 1), 32767) << "the last value stays";
}

TEST(LcecDevices, Counter_wraps_and_begins_at_a_latch) {
    Bench bench("EL5101");
    EXPECT_EQ(bench.host.declared().at("x.enc-index-c-enable"), "io bit");
    bench.pin<double>("enc-pos-scale") = 100;
    bench.set(0x6000, 2, 32760);
    bench.read();
    EXPECT_EQ(bench.pin<std::int32_t>("enc-count"), 0);
    bench.set(0x6000, 2, static_cast<std::uint16_t>(-32766));
    bench.read();
    EXPECT_EQ(bench.pin<std::int32_t>("enc-count"), 10) << "the 16 bits have wrapped";
    EXPECT_DOUBLE_EQ(bench.pin<double>("enc-pos"), 0.1);
    bench.pin<bool>("enc-index-c-enable") = true;
    bench.write();
    EXPECT_EQ(bench.field(0x7000, 1).read(bench.image()), 1U);
    bench.set(0x6000, 1, 0x21);  // latched, and the input
    bench.set(0x6000, 3, static_cast<std::uint16_t>(-32768));
    bench.read();
    EXPECT_FALSE(bench.pin<bool>("enc-index-c-enable"));
    EXPECT_TRUE(bench.pin<bool>("enc-latch-c-valid"));
    EXPECT_EQ(bench.pin<std::int32_t>("enc-raw-latch"), -32768);
    EXPECT_EQ(bench.pin<std::int32_t>("enc-count"), 2);
    bench.pin<bool>("enc-set-raw-count") = true;
    bench.pin<std::int32_t>("enc-set-raw-count-val") = 7;
    bench.write();
    EXPECT_EQ(bench.get(0x7000, 2), 7);
    bench.set(0x6000, 1, 4);  // written
    bench.set(0x6000, 2, 7);
    bench.read();
    EXPECT_FALSE(bench.pin<bool>("enc-set-raw-count"));
    EXPECT_EQ(bench.pin<std::int32_t>("enc-count"), 2) << "the position stays";
    bench.pin<bool>("enc-reset") = true;
    bench.read();
    EXPECT_EQ(bench.pin<std::int32_t>("enc-count"), 0);
}

TEST(LcecDevices, Omron_drive_is_enabled_by_one_pin) {
    Bench bench("R88D-KN01H-ECT");
    EXPECT_EQ(bench.slave.startup.at(0).index, 0x6060);
    bench.pin<bool>("enable") = true;
    const auto step = [&](std::uint16_t status) {
        bench.set(0x6041, 0, status);
        bench.read();
        bench.write();
        return bench.field(0x6040, 0).read(bench.image());
    };
    EXPECT_EQ(step(0x40), 0x06U);
    EXPECT_EQ(step(0x21), 0x07U);
    EXPECT_EQ(step(0x23), 0x0fU);
    EXPECT_EQ(step(0x27), 0x0fU);
    EXPECT_EQ(step(0x08), 0x04U) << "a fault stays until enable rises again";
    EXPECT_TRUE(bench.pin<bool>("fault"));
    bench.pin<bool>("enable") = false;
    step(0x08);
    bench.pin<bool>("enable") = true;
    EXPECT_EQ(step(0x08), 0x84U);
    step(0x08);
    EXPECT_FALSE(bench.pin<bool>("fault")) << "not while it is being reset";
    bench.pin<double>("pos-cmd") = 2;
    bench.set(0x6064, 0, 1048576);
    step(0x27);
    EXPECT_EQ(bench.get(0x607a, 0), 2 * 1048576);
    EXPECT_DOUBLE_EQ(bench.pin<double>("pos-fb"), 1.0);
}

TEST(LcecDevices, Delta_servo_has_the_mode_of_its_modParam) {
    Bench bench("DeASDA", {{"opmode", "csp"}, {"enableDigitalOutput", "false"}});
    ASSERT_TRUE(bench.problems.empty());
    EXPECT_TRUE(bench.field(0x607a, 0).present());
    EXPECT_FALSE(bench.field(0x60ff, 0).present());
    EXPECT_EQ(bench.host.declared().at("x.srv-pos-cmd"), "in float");
    EXPECT_EQ(bench.pin<std::uint32_t>("srv-pulses-per-rev"), 1280000U);
    EXPECT_EQ(bench.slave.startup.at(0).data, (std::vector<std::uint8_t>{8}));
    EXPECT_EQ(bench.slave.startup.at(1).data, (std::vector<std::uint8_t>{1})) << "1 ms";
    EXPECT_EQ(bench.slave.startup.at(2).data, (std::vector<std::uint8_t>{0xfd}));
    bench.pin<double>("pos-scale") = 5;
    bench.set(0x6064, 0, 0);
    bench.read();
    bench.set(0x6064, 0, 1280000);
    bench.read();
    EXPECT_DOUBLE_EQ(bench.pin<double>("enc-pos"), 5.0);
    bench.read(false);
    EXPECT_TRUE(bench.pin<bool>("srv-fault"));
    Bench velocity("DeASDA");
    EXPECT_TRUE(velocity.field(0x60ff, 0).present());
    velocity.pin<double>("srv-vel-cmd") = 1;
    velocity.write();
    EXPECT_EQ(velocity.get(0x60ff, 0), 600) << "1 turn/s is 60 rpm in steps of 0.1 rpm";
    Bench wrong("DeASDA", {{"opmode", "CST"}});
    EXPECT_EQ(wrong.problems.at(0),
              "invalid value 'CST' of modParam 'opmode': expected CSV or CSP");
}

TEST(LcecDevices, Drives_of_CiA_402_have_the_pins_of_their_modParams) {
    Bench one("ECT60", {{"peakCurrent_amps", "5.5"}, {"controlMode", "foc"}, {"homeOffset", "-7"}});
    ASSERT_TRUE(one.problems.empty());
    EXPECT_TRUE(one.slave.dc);
    EXPECT_EQ(one.slave.startup.at(0).data, (std::vector<std::uint8_t>{0x7c, 0x15}));
    EXPECT_EQ(one.slave.startup.back().data, (std::vector<std::uint8_t>{0xf9, 0xff, 0xff, 0xff}));
    EXPECT_EQ(one.host.declared().at("x.srv-home-velocity-fast"), "in u32");
    EXPECT_EQ(one.host.declared().at("x.srv-supports-mode-csp"), "out bit");
    EXPECT_EQ(one.host.declared().at("x.srv-din-5-not"), "out bit");
    EXPECT_EQ(one.host.declared().count("x.srv-din-6"), 0U);
    one.pin<bool>("srv-dout-1") = true;
    one.write();
    EXPECT_EQ(one.get(0x60fe, 1), 0x20000);
    Bench inverter("OMMX2", {{"vlAccel", "100/2"}, {"vlSetPoint", "0.5"}});
    ASSERT_TRUE(inverter.problems.empty());
    EXPECT_EQ(inverter.slave.sync_managers.at(1).pdos.size(), 3U) << "two objects each";
    ASSERT_EQ(inverter.slave.startup.size(), 4U);
    EXPECT_EQ(inverter.slave.startup[0].data, (std::vector<std::uint8_t>{100, 0, 0, 0}));
    EXPECT_EQ(inverter.slave.startup[1].data, (std::vector<std::uint8_t>{2, 0}));
    EXPECT_EQ(inverter.slave.startup[2].data, (std::vector<std::uint8_t>{1, 0}));
    EXPECT_EQ(inverter.slave.startup[3].data, (std::vector<std::uint8_t>{2, 0}));
    Bench two("CL57E-4A", {{"ch2enableCSV", "0"}});
    EXPECT_TRUE(two.field(0x60ff, 0).present());
    EXPECT_FALSE(two.field(0x68ff, 0).present());
}

/// A mailbox from which objects are uploaded.
struct ObjectMailbox {
    tests::MailboxSlave slave;
    master::Mailboxes mailboxes{1};
    master::RequestServer server{mailboxes, [this](std::uint16_t) { return &slave.bus; }, 2};
    master::RequestPort& port = server.open();
    struct Value {
        std::size_t bytes;
        std::uint32_t number;
    };
    std::map<std::uint32_t, Value> values;  ///< by index << 8 | sub-index
    std::map<std::uint32_t, tests::Bytes> idns;  ///< of SoE: by drive << 16 | IDN
    std::uint32_t written = 0;  ///< the last value that was downloaded

    ObjectMailbox() {
        slave.on_request = [this](const MailboxMessage& m) {
            if (m.type == MailboxType::soe) return reply_idn(*soe::read(m.payload));
            const auto sdo = coe::read_sdo(m.payload);
            tests::Bytes reply(coe::sdo_bytes);
            if (sdo->is(coe::command::download)) {
                written = sdo->value;
                coe::write_sdo(reply.data(), coe::Service::sdo_response,
                               {coe::command::download_response, sdo->index, sdo->sub, 0});
                return slave.reply(MailboxType::coe, reply);
            }
            const Value value = values.at(sdo->index << 8 | sdo->sub);
            coe::write_sdo(reply.data(), coe::Service::sdo_response,
                           {coe::expedited_command(coe::command::upload_response, value.bytes),
                            sdo->index, sdo->sub, value.number});
            slave.reply(MailboxType::coe, reply);
        };
    }
    ~ObjectMailbox() { server.stop(); }
    void reply_idn(const soe::Header& h) {
        tests::Bytes reply(4);
        soe::write(reply.data(),
                   {soe::Opcode::read_response, false, false, h.drive, h.elements, h.idn});
        const tests::Bytes& value = idns.at(static_cast<std::uint32_t>(h.drive << 16 | h.idn));
        reply.insert(reply.end(), value.begin(), value.end());
        slave.reply(MailboxType::soe, reply);
    }
    void step() {
        server.step(slave.now_ns);
        slave.step(server.channel(0));
    }
};

TEST(LcecDevices, Frequency_output_scales_by_the_frequency_of_the_terminal) {
    ObjectMailbox objects;
    objects.values = {{0x800102, {4, 50'000}},
                      {0x800104, {2, 100}},
                      {0x800105, {2, 200}},
                      {0x800007, {1, 1}},
                      {0x880002, {2, 0x4000}}};
    Bench bench("EL2521");
    bench.mailbox = &objects.port;
    bench.pin<bool>("stp-enable") = true;
    bench.pin<double>("stp-velo-cmd") = -12.5;
    bench.pin<double>("stp-pos-scale") = 1000;
    bench.pin<bool>("stp-ramp-disable") = true;
    bench.set(0x6000, 2, 0xfffe);
    bench.read();
    bench.write();
    EXPECT_EQ(bench.get(0x7000, 2), 0) << "the base frequency is unknown";
    EXPECT_EQ(bench.get(0x7000, 1), 2);
    for (int cycle = 0; cycle < 2000 && bench.pin<double>("stp-maxaccel-fall") == 0; ++cycle) {
        objects.step();
        bench.read();
    }
    bench.write();
    EXPECT_DOUBLE_EQ(bench.pin<double>("stp-freq"), -12'500.0);
    EXPECT_EQ(bench.get(0x7000, 2), -8191) << "a quarter of 32767";
    EXPECT_NEAR(bench.pin<double>("stp-maxvel"), 25.0, 1e-3) << "half of 50 kHz";
    EXPECT_DOUBLE_EQ(bench.pin<double>("stp-maxaccel-rise"), 100.0) << "100 steps of 1 kHz/s";
    EXPECT_DOUBLE_EQ(bench.pin<double>("stp-maxaccel-fall"), 200.0);
    bench.pin<double>("stp-velo-cmd") = 1e9;
    bench.write();
    EXPECT_EQ(bench.get(0x7000, 2), 32767);
    bench.pin<bool>("stp-enable") = false;
    bench.write();
    EXPECT_EQ(bench.get(0x7000, 2), 0);
    bench.set(0x6000, 1, 0x22);
    bench.set(0x6000, 2, 3);
    bench.read();
    EXPECT_EQ(bench.pin<std::int32_t>("stp-counts"), 5) << "from 65534 to 3";
    EXPECT_DOUBLE_EQ(bench.pin<double>("stp-pos-fb"), 0.005);
    EXPECT_TRUE(bench.pin<bool>("stp-ramp-active") && bench.pin<bool>("stp-in-z"));
    EXPECT_TRUE(bench.pin<bool>("stp-in-t-not") && !bench.pin<bool>("stp-in-t"));
}

TEST(LcecDevices, Led_outputs_are_scaled_and_their_gain_is_written_when_it_changes) {
    ObjectMailbox objects;
    const auto real = [](float value) { return std::bit_cast<std::uint32_t>(value); };
    objects.values = {{0xf81911, {4, 5000}}, {0xf81912, {2, 32767}}};
    for (std::uint32_t n = 0; n < 4; ++n) {
        objects.values[0x800024 + (n << 12)] = {4, real(2.5F)};
        objects.values[0x800025 + (n << 12)] = {4, real(0.25F)};
    }
    Bench bench("EL2564");
    bench.mailbox = &objects.port;
    bench.pin<double>("pwm-1") = 60;
    bench.pin<double>("offset-1") = 20;
    bench.write();
    EXPECT_EQ(bench.field(0x7010, 0x11).read(bench.image()), 0U) << "not enabled";
    bench.pin<bool>("enable-1") = true;
    bench.write();
    EXPECT_EQ(bench.field(0x7010, 0x11).read(bench.image()), 32767U) << "60 * 0.5 + 20 percent";
    bench.pin<double>("pwm-1") = 1e6;
    bench.write();
    EXPECT_EQ(bench.field(0x7010, 0x11).read(bench.image()), 65535U);
    bench.set(0x6010, 7, 1);
    EXPECT_EQ(bench.slave.sync_managers.at(1).pdos.at(1).entries.at(2).name, "error-1");
    const auto run = [&](auto until) {
        for (int cycle = 0; cycle < 3000 && !until(); ++cycle) {
            objects.step();
            bench.read();
            bench.write();
        }
        return until();
    };
    EXPECT_TRUE(run([&] { return bench.pin<std::uint32_t>("frequency") == 5000U; }));
    EXPECT_DOUBLE_EQ(bench.pin<double>("ramp-time-3"), 0.25);
    EXPECT_DOUBLE_EQ(bench.pin<double>("gamma-0"), 2.5);
    EXPECT_EQ(objects.written, 0U) << "the gain is that of the terminal";
    bench.pin<std::int32_t>("master-gain") = 1000;
    EXPECT_TRUE(run([&] { return (objects.written & 0xffffU) == 1000; }));
}

TEST(LcecDevices, Drive_of_SoE_follows_its_enable_pins_in_its_units) {
    ObjectMailbox objects;
    objects.idns = {{79, {0, 0, 0x10, 0}}, {45, {1, 0}}, {46, {0xfc, 0xff}}};  // 10^-4 rpm
    for (const std::uint32_t number : {79U, 45U, 46U}) {
        objects.idns[1U << 16 | number] = objects.idns.at(number);
    }
    Bench bench("AX5203", {{"enableFB2", "true"}, {"enableDiag", "1"}});
    ASSERT_TRUE(bench.problems.empty());
    bench.mailbox = &objects.port;
    bench.pin<bool>("ch1.srv-enable") = true;
    bench.pin<double>("ch1.srv-velo-cmd") = 2;
    bench.write();
    EXPECT_EQ(bench.get(0x0018, 2), 0) << "the unit of the velocity is unknown";
    EXPECT_EQ(bench.field(0x0086, 2).read(bench.image()), 0xe000U);
    bench.write();
    EXPECT_EQ(bench.field(0x0086, 2).read(bench.image()), 0xe400U) << "the synchronisation bit";
    EXPECT_EQ(bench.field(0x0086, 1).read(bench.image()), 0x0400U) << "the other axis";
    bench.pin<bool>("ch1.srv-halt") = true;
    bench.pin<bool>("ch1.srv-drive-off") = true;
    bench.write();
    EXPECT_EQ(bench.field(0x0086, 2).read(bench.image()), 0x4000U);
    for (int cycle = 0; cycle < 3000 && bench.pin<double>("ch1.srv-vel-scale") == 0; ++cycle) {
        objects.step();
        bench.read();
    }
    EXPECT_DOUBLE_EQ(bench.pin<double>("ch1.srv-vel-scale"), 1e-4);
    EXPECT_EQ(bench.pin<std::uint32_t>("ch1.srv-pos-resolution"), 0x100000U);
    bench.write();
    EXPECT_NEAR(static_cast<double>(bench.get(0x0018, 2)), 1'200'000, 1) << "2 turns/s: 120 rpm";
    bench.set(0x0087, 2, 0xc008);
    bench.set(0x0033, 2, 0x80000);
    bench.set(0x0035, 2, 17);
    bench.set(0x0054, 2, 255);
    bench.set(0x0186, 2, 0xf4a5);
    bench.read();
    EXPECT_TRUE(bench.pin<bool>("ch1.srv-enabled"));
    EXPECT_FALSE(bench.pin<bool>("ch1.srv-fault") || bench.pin<bool>("ch1.srv-halted"));
    EXPECT_TRUE(bench.pin<bool>("ch0.srv-fault")) << "not ready";
    EXPECT_DOUBLE_EQ(bench.pin<double>("ch1.srv-torque-fb-pct"), 25.5);
    EXPECT_EQ(bench.pin<std::uint32_t>("ch1.srv-diag"), 0xf4a5U);
    EXPECT_DOUBLE_EQ(bench.pin<double>("ch1.enc-pos-abs"), 0.5);
    EXPECT_DOUBLE_EQ(bench.pin<double>("ch1.enc-fb2-pos-abs"), 17.0);
    bench.set(0x0087, 2, 0xe000);
    bench.read();
    EXPECT_TRUE(bench.pin<bool>("ch1.srv-fault") && bench.pin<bool>("ch1.srv-halted"));
    bench.read(false);
    EXPECT_TRUE(bench.pin<bool>("ch1.srv-fault"));
    EXPECT_FALSE(bench.pin<bool>("ch1.srv-enabled"));
    EXPECT_EQ(Bench("AX5101").host.declared().at("x.srv-velo-cmd"), "in float");
}

TEST(LcecDevices, Axis_of_pulses_counts_16_bits_and_begins_at_the_index) {
    Bench bench("EpoCAT");
    EXPECT_FALSE(bench.slave.sync_managers.at(0).watchdog);
    bench.pin<double>("axis2-enc-scale") = 0.5;
    bench.set(0x6001, 3, 0xfffe);
    bench.read();
    EXPECT_EQ(bench.pin<std::int32_t>("axis2-raw-count"), -2);
    bench.set(0x6001, 3, 2);
    bench.read();
    EXPECT_EQ(bench.pin<std::int32_t>("axis2-raw-count"), 2) << "the 16 bits have wrapped";
    EXPECT_DOUBLE_EQ(bench.pin<double>("axis2-enc-pos"), 1.0);
    bench.pin<double>("axis2-set-position") = 10;
    bench.pin<bool>("axis2-update-position") = true;
    bench.read();
    bench.set(0x6001, 3, 3);
    bench.read();
    EXPECT_EQ(bench.pin<std::int32_t>("axis2-raw-count"), 21) << "set once";
    bench.pin<bool>("axis2-index-enable") = true;
    bench.pin<double>("axis2-dac-value") = -3;
    bench.write();
    EXPECT_EQ(bench.field(0x7004, 3).read(bench.image()), 0U) << "waits for the index";
    EXPECT_EQ(bench.field(0x7004, 2).read(bench.image()), 1U) << "another axis";
    EXPECT_EQ(bench.field(0x7004, 6).read(bench.image()), 1U);
    EXPECT_EQ(bench.get(0x7001, 3), 6000);
    EXPECT_EQ(bench.field(0x7003, 3).read(bench.image()), 1U);
    bench.set(0x6006, 3, 1);
    bench.read();
    EXPECT_FALSE(bench.pin<bool>("axis2-index-enable"));
    EXPECT_DOUBLE_EQ(bench.pin<double>("axis2-enc-pos"), 0.0);
    bench.pin<double>("inverter-dac-value") = 5;
    bench.set(0x6000, 2, 40'000);
    bench.write();
    bench.read();
    EXPECT_EQ(bench.get(0x7000, 1), 16383);
    EXPECT_DOUBLE_EQ(bench.pin<double>("adc1-value"), 40'000.0);
}

TEST(LcecDevices, Speed_drive_scales_by_the_limits_of_the_drive) {
    ObjectMailbox objects;
    objects.values = {{0x221200, {4, 250}}, {0x240100, {4, 3000}}, {0x260200, {4, 2000}}};
    Bench bench("StMDS5k", {{"isMultiturn", "1"}, {"extEnc", "8"}});
    ASSERT_TRUE(bench.problems.empty());
    EXPECT_EQ(bench.pin<std::uint32_t>("enc-raw-bits"), 32U);
    EXPECT_EQ(bench.pin<std::uint32_t>("extenc-raw-bits"), 16U);
    bench.mailbox = &objects.port;
    bench.pin<bool>("srv-enable") = true;
    bench.pin<double>("srv-vel-cmd") = 25;
    bench.pin<double>("srv-torque-lim") = 5;
    bench.write();
    EXPECT_EQ(bench.get(0x26e6, 0), 0) << "the limits of the drive are unknown";
    EXPECT_EQ(bench.get(0x24e6, 0), 32767) << "200 %";
    for (int cycle = 0; cycle < 3000 && bench.pin<double>("srv-max-rpm-sp") == 0; ++cycle) {
        objects.step();
        bench.read();
    }
    bench.set(0x28c8, 0, 0x81);
    bench.set(0x26c8, 0, 2);
    bench.set(0x2864, 0, 16384);
    bench.set(0x2802, 0, 4096);
    bench.set(0x2809, 0, 0x800000);
    bench.set(0x289c, 0, 0x70000);
    bench.read();
    bench.write();
    EXPECT_DOUBLE_EQ(bench.pin<double>("srv-vel-rpm"), 1500.0);
    EXPECT_EQ(bench.get(0x26e6, 0), 12287) << "75 % of 2000 rpm";
    EXPECT_EQ(bench.field(0x20b4, 0).read(bench.image()), 1U) << "the toggle bit is inverted";
    EXPECT_TRUE(bench.pin<bool>("srv-ready") && bench.pin<bool>("srv-at-speed"));
    EXPECT_NEAR(bench.pin<double>("srv-vel-fb-rpm"), 3000.0, 0.2);
    EXPECT_NEAR(bench.pin<double>("srv-torque-fb"), 2.5, 1e-3) << "of 2.5 Nm";
    EXPECT_DOUBLE_EQ(bench.pin<double>("enc-pos-abs"), 0.5);
    EXPECT_DOUBLE_EQ(bench.pin<double>("extenc-pos-abs"), 7.0);
    bench.pin<double>("srv-vel-cmd") = -1000;
    bench.write();
    EXPECT_DOUBLE_EQ(bench.pin<double>("srv-vel-rpm"), -3000.0);
    bench.read(false);
    EXPECT_TRUE(bench.pin<bool>("srv-error") && !bench.pin<bool>("srv-ready"));
    Bench plain("StMDS5k");
    EXPECT_EQ(plain.pin<std::uint32_t>("enc-raw-bits"), 24U);
    EXPECT_EQ(plain.host.declared().count("x.extenc-pos"), 0U);
    EXPECT_EQ(plain.host.declared().at("x.extenc-scale"), "param float");
}

TEST(LcecDevices, Mixed_terminals_have_their_numbers_and_times) {
    Bench box("EasyIO");
    box.set(0x6002, 8, 1);
    box.read();
    EXPECT_TRUE(box.pin<bool>("din-15") && !box.pin<bool>("din-7"));
    Bench display("EL6090");
    display.set(0xf600, 0x11, 7300);
    display.read();
    EXPECT_EQ(display.pin<std::uint32_t>("operating-time-hour"), 2U);
}

TEST(LcecDevices, Power_distribution_has_its_current_limits_in_amperes) {
    Bench bench("EP9214");
    EXPECT_EQ(bench.host.declared().at("x.chan-4-current-limit-up"), "in float");
    EXPECT_TRUE(bench.field(0xf707, 4).present() && bench.field(0x7010, 6).present());
}

TEST(LcecDevices, Servo_terminal_has_target_0_until_its_resolution_is_known) {
    Bench bench("EL7211");
    bench.pin<bool>("enable") = true;
    bench.pin<double>("velo-cmd") = 3;
    bench.pin<double>("max-accel") = 1000;
    bench.set(0x6010, 1, 0x40);
    bench.read();
    bench.write();
    EXPECT_DOUBLE_EQ(bench.pin<double>("velo-cmd-out"), 1.0) << "1000 units/s^2 for 1 ms";
    EXPECT_EQ(bench.get(0x7010, 6), 0);
    EXPECT_EQ(bench.get(0x7010, 1), 0x06);
    bench.set(0x6010, 1, 0x23);
    bench.read();
    bench.write();
    EXPECT_EQ(bench.get(0x7010, 1), 0x0f);
    bench.set(0x6010, 1, 0x08);
    for (int cycle = 0; cycle < 101; ++cycle) {
        bench.read();
        bench.write();
    }
    EXPECT_EQ(bench.get(0x7010, 1), 0x80);
    EXPECT_TRUE(bench.pin<bool>("fault")) << "the reset has failed for 100 ms";
}

TEST(LcecDevices, Servo_terminal_that_is_not_operational_is_not_at_speed) {
    Bench bench("EL7211");
    bench.pin<double>("at-speed-window") = 1;
    bench.read();
    EXPECT_TRUE(bench.pin<bool>("at-speed"));
    bench.read(false);
    EXPECT_FALSE(bench.pin<bool>("at-speed"));
}

TEST(LcecDevices, Safety_frames_are_copied_between_the_logic_and_its_terminals) {
    const std::string text =
        "<masters><master idx=\"0\">\n<slave idx=\"1\" type=\"EL6900\" name=\"logic\">"
        "<modParam name=\"stdInName\" value=\"run\"/><modParam name=\"stdInName\" "
        "value=\"reset\"/><modParam name=\"fsoeSlaveIdx\" value=\"3\"/><modParam "
        "name=\"fsoeSlaveIdx\" value=\"2\"/></slave>\n<slave idx=\"2\" type=\"EL1904\"/><slave "
        "idx=\"3\" type=\"EL2904\"/></master></masters>";
    const config::ReadResult r = config::read(text, "c.xml");
    ASSERT_EQ(config::to_string(r, "c.xml"), "");
    const config::Bus& bus = r.buses.at(0);
    ASSERT_EQ(bus.copies.size(), 4U);
    EXPECT_EQ(bus.copies[0].from.slave, 2U) << "the order of fsoeSlaveIdx";
    EXPECT_EQ(bus.copies[0].to.slave, 0U);
    EXPECT_EQ(bus.copies[0].to.sync_manager, 0U);
    EXPECT_EQ(bus.copies[0].to.bit, 0U);
    EXPECT_EQ(bus.copies[0].bits, 48U);
    EXPECT_EQ(bus.copies[3].from.slave, 0U);
    EXPECT_EQ(bus.copies[3].from.sync_manager, 1U);
    EXPECT_EQ(bus.copies[3].from.bit, 48U) << "behind the frame of the first connection";
    EXPECT_EQ(bus.copies[3].to.slave, 1U);
    const auto& outputs = bus.setup.slaves.at(0).sync_managers.at(0);
    EXPECT_EQ(outputs.pdos.size(), 4U);
    EXPECT_EQ(outputs.pdos.back().entries.at(1).name, "reset");
    std::string wrong = text;
    wrong.replace(wrong.find("value=\"3\""), 9, "value=\"1\"");
    EXPECT_EQ(
        config::to_string(config::read(wrong, "c.xml"), "c.xml"),
        "c.xml:2:2: error: fsoeSlaveIdx '1': slave 'logic' is not a safe terminal; correct the "
        "modParam");
    wrong.replace(wrong.find("value=\"1\""), 9, "value=\"9\"");
    EXPECT_EQ(config::to_string(config::read(wrong, "c.xml"), "c.xml"),
              "c.xml:2:2: error: fsoeSlaveIdx '9': no slave has this idx; correct the modParam");
}

TEST(LcecDevices, Safety_card_has_the_axes_of_the_drive_before_it) {
    const auto machine = [](const std::string& drive) {
        return config::read(
            "<masters><master idx=\"0\" appTimePeriod=\"1000000\">\n"
            "<slave idx=\"0\" type=\"EL6900\" name=\"logic\"><modParam name=\"fsoeSlaveIdx\" "
            "value=\"2\"/></slave>\n<slave idx=\"2\" type=\"AX5805\" name=\"card\"/>\n"
            "<slave idx=\"1\" type=\"" +
                drive + "\" name=\"drive\"/></master></masters>",
            "c.xml");
    };
    const auto outputs = [](const config::ReadResult& r) {
        std::size_t bits = 0;
        for (const auto& pdo : r.buses.at(0).setup.slaves.at(1).sync_managers.at(0).pdos) {
            for (const auto& entry : pdo.entries) {
                bits += entry.bits;
            }
        }
        return bits / 8;
    };
    const config::ReadResult two = machine("AX5203");
    ASSERT_TRUE(two.good()) << config::to_string(two, "c.xml");
    EXPECT_EQ(outputs(two), 27U) << "DefaultSize of the card";
    ASSERT_EQ(two.buses[0].copies.size(), 2U);
    EXPECT_EQ(two.buses[0].copies[0].from.slave, 1U);
    EXPECT_EQ(two.buses[0].copies[0].bits, 88U) << "two channels of two bytes";
    const config::ReadResult one = machine("AX5106");
    ASSERT_TRUE(one.good());
    EXPECT_EQ(outputs(one), 15U);
    EXPECT_EQ(config::to_string(machine("EL1008"), "c.xml"),
              "c.xml:3:2: error: AX5805 is an option of a drive, which must be the slave before "
              "it; write its drive as idx=\"1\"");
}

TEST(LcecDevices, Numbers_that_lcec_reads_in_part_are_read_with_a_warning) {
    const config::ReadResult r = config::read(
        "<masters><master idx=\"0\">\n<slave idx=\"0\" type=\"EL1008\"><sdoConfig idx=\"6093h\" "
        "subIdx=\"O\"><sdoDataRaw data=\"01\"/></sdoConfig></slave></master></masters>",
        "c.xml");
    EXPECT_EQ(config::to_string(r, "c.xml"), "");
    ASSERT_EQ(r.messages.size(), 2U);
    EXPECT_EQ(r.messages[0].severity, Severity::warning);
    EXPECT_EQ(r.messages[0].sentence, "idx '6093h' of <sdoConfig> is read as 6093, as lcec does");
    EXPECT_EQ(r.messages[1].help, "write subIdx=\"0\"");
    EXPECT_EQ(r.buses.at(0).setup.slaves.at(0).startup.at(0).index, 0x6093);
}

TEST(LcecDevices, Unknown_types_are_named_with_what_to_write) {
    const auto errors = [](const std::string& type, const std::string& inner = "") {
        return config::to_string(
            config::read("<masters><master idx=\"0\">\n<slave idx=\"0\" type=\"" + type + "\">" +
                             inner + "</slave></master></masters>",
                         "c.xml"),
            "c.xml");
    };
    EXPECT_EQ(errors("EL1008"), "");
    EXPECT_EQ(errors("EK1100"), "");
    EXPECT_EQ(errors("EL1018ZZZ"),
              "c.xml:2:2: error: unknown slave type 'EL1018ZZZ'; write type=\"generic\" with vid, "
              "pid and the PDOs of the device; `hal check --assume lcec.0.0` checks the rest");
    EXPECT_EQ(errors("Ph3LM2RM"),
              "c.xml:2:2: error: lcec's driver 'Ph3LM2RM' is not supported; write type=\"generic\" "
              "with vid, pid and the PDOs of the device; `hal check --assume lcec.0.0` checks the "
              "rest");
    EXPECT_EQ(errors("EL1008", "<modParam name=\"x\" value=\"1\"/>"),
              "c.xml:2:31: error: <modParam> has no effect on type=\"EL1008\"; delete it");
    EXPECT_EQ(errors("EL7031", "<modParam name=\"maxCurent\" value=\"1\"/>"),
              "c.xml:2:31: error: unsupported modParam 'maxCurent'; did you mean 'maxCurrent'?");
}

}  // namespace
}  // namespace hal::ethercat
