// SPDX-License-Identifier: MIT
// Emulated devices behind emulated controllers, driven datagram by datagram.
#include "ethercat/devices/mailbox_device.hpp"
#include "ethercat/devices/servo.hpp"
#include "ethercat/wire/aoe.hpp"
#include "ethercat/wire/eoe.hpp"
#include "ethercat/wire/foe.hpp"
#include "ethercat/wire/soe.hpp"
#include "tests/unit/ethercat/device_bench.hpp"

namespace {

using namespace esc_world;
using namespace hal::ethercat::devices;

struct Devices : testing::Test, DeviceBench {};

TEST_F(Devices, Digital_outputs_reach_the_terminals_in_op_only) {
    start("digital_out", {.bits = 12});
    to_preop();
    process_data();
    ASSERT_EQ(request(State::safeop), 4U);
    auto& io = dynamic_cast<IoBehaviour&>(device.firmware->behaviour());
    outputs({0x05, 0x08});
    EXPECT_EQ(io.output(0), 0);
    request(State::op);
    ASSERT_EQ(status(), 8U);
    outputs({0x05, 0x08});
    EXPECT_EQ(io.output(0), 1);
    EXPECT_EQ(io.output(1), 0);
    EXPECT_EQ(io.output(2), 1);
    EXPECT_EQ(io.output(11), 1);
    request(State::safeop);
    status();
    EXPECT_EQ(io.output(0), 0);
}

TEST_F(Devices, Digital_inputs_are_read) {
    start("digital_in", {.bits = 3});
    dynamic_cast<IoBehaviour&>(device.firmware->behaviour()).set_input(2, 1);
    to_op({});
    EXPECT_EQ(inputs(), Bytes{4});
}

TEST_F(Devices, State_machine_rejects_wrong_settings_with_the_code_of_the_standard) {
    start("servo");
    EXPECT_EQ(request(State::preop), 0x160011U) << "no mailbox";
    EXPECT_EQ(request(State::init, al_error), 1U);
    EXPECT_EQ(request(State::op), 0x110011U) << "init to op";
    EXPECT_EQ(request(State::init, al_error), 1U);
    EXPECT_EQ(request(State::boot), 0x130011U) << "no bootstrap";
    EXPECT_EQ(request(static_cast<State>(7), al_error), 0x120011U) << "unknown state";
    EXPECT_EQ(request(State::init, al_error), 1U);
    to_preop();
    EXPECT_EQ(request(State::safeop), 0x1d0012U) << "no outputs";
    const auto& out = area(sii::SmType::outputs);
    sync_manager(2, out.start, out.length, 0x64);
    EXPECT_EQ(request(State::safeop), 0x1d0012U) << "not acknowledged";
    EXPECT_EQ(request(State::safeop, al_error), 0x1e0012U) << "no inputs";
    process_data();
    device.firmware->faults().reject[State::safeop] = 0x8123;
    EXPECT_EQ(request(State::safeop, al_error), 0x81230012U);
    device.firmware->faults().reject[State::safeop] = 0;
    EXPECT_EQ(request(State::safeop, al_error), 4U);
    request(State::op);
    EXPECT_EQ(status(), 4U) << "waits for outputs";
    w.now_ns += 300'000'000;
    EXPECT_EQ(status(), 0x1b0014U) << "no outputs";
}

TEST_F(Devices, Remapping_changes_the_length_of_the_sync_manager) {
    start("servo");
    to_preop();
    EXPECT_EQ(download(0x1600, 1, 0x60400010, 4), code_of(coe::Abort::sub0_not_zero));
    EXPECT_EQ(download(0x1c12, 0, 0, 1), 0U);
    EXPECT_EQ(download(0x1600, 0, 0, 1), 0U);
    EXPECT_EQ(download(0x1600, 1, 0x60410010, 4), code_of(coe::Abort::not_mappable));
    EXPECT_EQ(download(0x1600, 1, 0x60400010, 4), 0U);
    EXPECT_EQ(download(0x1600, 2, 0x607a0020, 4), 0U);
    EXPECT_EQ(download(0x1600, 0, 2, 1), 0U);
    EXPECT_EQ(download(0x1c12, 1, 0x1600, 2), 0U);
    EXPECT_EQ(download(0x1c12, 0, 1, 1), 0U);
    const Bytes assignment = sdo(coe::command::upload | coe::command::complete, 0x1c12, 0);
    EXPECT_EQ(assignment, (Bytes{0, 0x30, 0x53, 0x12, 0x1c, 0, 1, 0, 0, 0x16})) << "padded count";
    process_data();
    EXPECT_EQ(request(State::safeop), 0x1d0012U);
    sync_manager(2, 0, 0, 0);
    sync_manager(2, area(sii::SmType::outputs).start, 6, 0x64);
    EXPECT_EQ(request(State::safeop, al_error), 4U);
}

TEST_F(Devices, Servo_sends_its_target_position_back) {
    start("servo");
    to_preop();
    EXPECT_EQ(download(0x1c13, 0, 0, 1), 0U);
    EXPECT_EQ(download(0x1a00, 0, 0, 1), 0U);
    EXPECT_EQ(download(0x1a00, 1, 0x60ff0020, 4), code_of(coe::Abort::not_mappable));
    EXPECT_EQ(download(0x1a00, 1, 0x607a0020, 4), 0U);
    EXPECT_EQ(download(0x1a00, 0, 1, 1), 0U);
}

TEST_F(Devices, Servo_follows_its_target_position) {
    start("servo");
    const auto frame = [&](std::uint16_t control, std::int32_t position, std::uint8_t mode = 8) {
        Bytes b(13);
        put(&b[0], control);
        b[2] = mode;
        put(&b[3], position);
        outputs(b);
        return get<std::uint16_t>(inputs().data());
    };
    to_op(Bytes(13));
    EXPECT_EQ(frame(0, 0) & 0x4f, 0x40);
    EXPECT_EQ(frame(6, 0) & 0x6f, 0x21);
    EXPECT_EQ(frame(7, 0) & 0x6f, 0x23);
    EXPECT_EQ(frame(15, 0) & 0x6f, 0x27);
    for (int n = 1; n <= 200; ++n) {
        frame(15, n * 10);
    }
    for (int n = 0; n < 500; ++n) {
        frame(15, 2000);
    }
    EXPECT_NEAR(get<std::int32_t>(&inputs()[3]), 2000, 15);
    auto& servo = dynamic_cast<Servo&>(device.firmware->behaviour());
    servo.axis(0).fail(0x2310);
    EXPECT_EQ(frame(15, 2000) & 0x4f, 0x0f) << "brakes";
    for (int n = 0; n < 500; ++n) {
        frame(15, 2000);
    }
    EXPECT_EQ(frame(15, 2000) & 0x4f, 0x08);
    const auto emergency = coe::read_emergency(fetch(MailboxType::coe));
    ASSERT_TRUE(emergency);
    EXPECT_EQ(emergency->code, 0x2310);
    EXPECT_EQ(frame(0x80, 2000) & 0x4f, 0x40);
}

TEST_F(Devices, Servo_follows_the_first_controlword_in_OP) {
    start("servo");
    to_preop();
    process_data();
    ASSERT_EQ(request(State::safeop), 4U);
    Bytes shutdown(13);
    shutdown[0] = 6;
    outputs(shutdown);
    const auto& axis = dynamic_cast<Servo&>(device.firmware->behaviour()).axis(0);
    EXPECT_EQ(axis.statusword() & 0x6f, 0x40) << "outputs are not valid in SAFE-OP";
    // One frame requests OP and carries the first outputs.
    std::vector<World::Item> items{
        {Command::apwr, at_position(0, registers::al_control), {8, 0}},
        {Command::apwr, at_position(0, area(sii::SmType::outputs).start), shutdown}};
    w.send(items);
    ASSERT_EQ(device.firmware->state(), State::op);
    EXPECT_EQ(axis.statusword() & 0x6f, 0x21);
}

TEST_F(Devices, Servo_follows_a_controlword_that_an_SDO_wrote_before_OP) {
    start("servo");
    to_preop();
    ASSERT_EQ(download(0x1c12, 0, 0, 1), 0U);
    sync_manager(2, 0, 0, 0);
    const auto& in = area(sii::SmType::inputs);
    sync_manager(3, in.start, in.length, in.control);
    ASSERT_EQ(request(State::safeop), 4U);
    ASSERT_EQ(download(0x6040, 0, 6, 2), 0U);
    const auto& axis = dynamic_cast<Servo&>(device.firmware->behaviour()).axis(0);
    EXPECT_EQ(axis.statusword() & 0x6f, 0x40);
    ASSERT_EQ(request(State::op), 8U);
    EXPECT_EQ(axis.statusword() & 0x6f, 0x21);
}

TEST_F(Devices, Long_objects_travel_in_segments) {
    start("mailbox_device");
    to_preop();
    Bytes data(2000);
    for (std::size_t i = 0; i < data.size(); ++i) {
        data[i] = static_cast<std::uint8_t>(i * 7);
    }
    const std::size_t mailbox = sii.mailboxes.receive.size;
    const std::size_t first = coe::normal_capacity(mailbox);
    sdo(coe::command::download | coe::command::size_given, 0x2000, 0, 2000,
        {data.begin(), data.begin() + static_cast<std::ptrdiff_t>(first)});
    bool toggle = false;
    for (std::size_t at = first; at < data.size(); toggle = !toggle) {
        const std::size_t n = std::min(coe::segment_capacity(mailbox), data.size() - at);
        Bytes b(mailbox);
        b.resize(coe::write_segment(b.data(), coe::Service::sdo_request, 0, toggle,
                                    at + n == data.size(), {&data[at], n}));
        const Bytes answer = ask(MailboxType::coe, b);
        ASSERT_EQ(answer[2], 0x20 | (toggle ? 0x10 : 0));
        at += n;
    }
    Bytes got = sdo(coe::command::upload, 0x2000, 0);
    ASSERT_EQ(coe::read_sdo(got)->value, 2000U);
    got.erase(got.begin(), got.begin() + coe::sdo_bytes);
    for (toggle = false; got.size() < 2000; toggle = !toggle) {
        Bytes b(10);
        coe::write_header(b.data(), coe::Service::sdo_request);
        b[2] = static_cast<std::uint8_t>(0x60 | (toggle ? 0x10 : 0));
        const Bytes answer = ask(MailboxType::coe, b);
        const auto segment = coe::segment_of(answer);
        ASSERT_FALSE(segment.empty());
        got.insert(got.end(), segment.begin(), segment.end());
    }
    EXPECT_EQ(got, data);
    EXPECT_EQ(download(0x2001, 0, 101, 2), code_of(coe::Abort::too_high));
    EXPECT_EQ(download(0x2001, 0, 0xff9c, 2), 0U) << "-100";
}

TEST_F(Devices, Other_protocols_answer) {
    start("mailbox_device");
    to_preop();
    EXPECT_EQ(ask(MailboxType::voe, {1, 2, 3, 4, 5, 6, 7}), (Bytes{1, 2, 3, 4, 5, 6, 7}));
    Bytes name(foe::header_bytes);
    foe::write_header(name.data(), foe::Opcode::read, 0);
    for (const char c : std::string_view("parameters")) {
        name.push_back(static_cast<std::uint8_t>(c));
    }
    Bytes file = ask(MailboxType::foe, name);
    EXPECT_EQ(foe::read(file)->text(), "gain = 1\n");
    Bytes soe_read(soe::header_bytes);
    soe::write(soe_read.data(), {soe::Opcode::read, false, false, 0, soe::element::value, 24});
    EXPECT_EQ(ask(MailboxType::soe, soe_read), (Bytes{2, 0x40, 24, 0, 2, 0, 2, 0, 36, 0}));
    Bytes ads(aoe::header_bytes + aoe::address_bytes);
    aoe::Header h;
    h.command = aoe::Command::read;
    h.length = aoe::address_bytes;
    h.invoke = 9;
    aoe::write(ads.data(), h);
    put(&ads[32], aoe::group_sdo), put(&ads[36], aoe::sdo_offset(0x1018, 2)),
        put<std::uint32_t>(&ads[40], 4);
    const Bytes answer = ask(MailboxType::aoe, ads);
    ASSERT_EQ(answer.size(), aoe::header_bytes + 12U);
    EXPECT_EQ(get<std::uint32_t>(&answer[40]), sii.product);
}

TEST_F(Devices, Mailbox_device_answers_ARP_and_echo_once_it_has_an_address) {
    start("mailbox_device");
    to_preop();
    const auto exchange = [&](const Bytes& frame) {
        eoe::Splitter out(frame, 1, sii.mailboxes.receive.size);
        for (Bytes b(sii.mailboxes.receive.size); const auto n = out.next(b.data());) {
            post(MailboxType::eoe, {b.begin(), b.begin() + static_cast<std::ptrdiff_t>(n)});
        }
        eoe::Joiner in;
        Bytes back;
        for (unsigned n = 0; n < 10 && back.empty(); ++n) {
            const Bytes fragment = fetch(MailboxType::eoe);
            if (fragment.empty()) break;
            const auto whole = in.take(fragment);
            back.assign(whole.begin(), whole.end());
        }
        return back;
    };
    const Bytes host{2, 0, 0, 0, 0, 9};
    const Bytes own{2, 0xec, 0xa7, 0, 0, 1};
    const auto joined = [](std::initializer_list<Bytes> parts) {
        Bytes all;
        for (const Bytes& p : parts) {
            all.insert(all.end(), p.begin(), p.end());
        }
        return all;
    };
    const Bytes everyone(6, 0xff), host_ip{192, 168, 2, 1}, own_ip{192, 168, 2, 10};
    const Bytes ask_mac = joined({everyone,
                                  host,
                                  {8, 6, 0, 1, 8, 0, 6, 4, 0, 1},
                                  host,
                                  host_ip,
                                  Bytes(6),
                                  own_ip,
                                  Bytes(18)});
    EXPECT_TRUE(exchange(ask_mac).empty()) << "it has no address yet";

    eoe::Ip ip;
    ip.flags = 0x1f;
    ip.address = 0xc0a8020a;
    ip.mask = 0xffffff00;
    std::copy(own.begin(), own.end(), ip.mac.begin());
    Bytes settings(eoe::header_bytes + eoe::max_ip);
    eoe::Header h;
    h.type = eoe::Type::set_ip;
    h.last = true;
    eoe::write(settings.data(), h);
    settings.resize(eoe::header_bytes + eoe::write_ip(&settings[eoe::header_bytes], ip));
    EXPECT_EQ(ask(MailboxType::eoe, settings), (Bytes{3, 1, 0, 0}));

    EXPECT_EQ(
        exchange(ask_mac),
        joined({host, own, {8, 6, 0, 1, 8, 0, 6, 4, 0, 2}, own, own_ip, host, host_ip, Bytes(18)}));
    Bytes other = ask_mac;
    other[41] = 11;
    EXPECT_TRUE(exchange(other).empty()) << "the address of another host";

    // Echo request with 300 bytes; checksums computed by hand: 0x0000 - sum over the words.
    const auto summed = [](Bytes bytes, std::size_t at) {
        std::uint32_t sum = 0;
        for (std::size_t n = 0; n < bytes.size(); n += 2) {
            sum += static_cast<std::uint32_t>(bytes[n] << 8 | bytes[n + 1]);
        }
        while (sum > 0xffff) {
            sum = (sum & 0xffff) + (sum >> 16);
        }
        bytes[at] = static_cast<std::uint8_t>(~sum >> 8);

        bytes[at + 1] = static_cast<std::uint8_t>(~sum);
        return bytes;
    };
    const auto ping = [&](std::uint8_t type, std::uint8_t time_to_live, const Bytes& to,
                          const Bytes& from, const Bytes& to_ip, const Bytes& from_ip) {
        const Bytes header = summed(
            joined({{0x45, 0, 1, 0x48, 0, 1, 0x40, 0, time_to_live, 1, 0, 0}, from_ip, to_ip}), 10);
        return joined({to,
                       from,
                       {8, 0},
                       header,
                       summed(joined({{type, 0, 0, 0, 7, 7, 0, 1}, Bytes(300, 0x5a)}), 2)});
    };
    EXPECT_EQ(exchange(ping(8, 32, own, host, own_ip, host_ip)),
              ping(0, 64, host, own, host_ip, own_ip));
    Bytes damaged = ping(8, 32, own, host, own_ip, host_ip);
    damaged[100] ^= 1;
    EXPECT_TRUE(exchange(damaged).empty());
    EXPECT_TRUE(exchange(Bytes(14, 0xff)).empty());
}

TEST_F(Devices, Servo_reports_switch_on_disabled_in_PRE_OP_on_every_axis) {
    start("servo", {.axes = 2});
    to_preop();
    for (unsigned axis = 0; axis < 2; ++axis) {
        EXPECT_EQ(dynamic_cast<Servo&>(device.firmware->behaviour()).axis(axis).statusword(), 0x250)
            << axis;
    }
    EXPECT_EQ(upload(0x6041, 0) & 0xffff, 0x250U);
    EXPECT_EQ(upload(0x6841, 0) & 0xffff, 0x250U);
}

TEST_F(Devices, Servo_has_the_first_values_of_every_axis) {
    start("servo", {.axes = 2});
    to_preop();
    for (unsigned axis = 0; axis < 2; ++axis) {
        const auto value = [&](std::uint16_t index, std::uint8_t sub = 0) {
            return upload(hal::cia402::of_axis(index, axis), sub);
        };
        EXPECT_EQ(value(0x6098) & 0xff, 37U) << "home at the current position";
        EXPECT_EQ(value(0x6065), 0xffffffffU) << "no window";
        EXPECT_EQ(value(0x6066) & 0xffff, 0U);
        EXPECT_EQ(value(0x60fe, 2), 0xffffffffU) << "all outputs are enabled";
        EXPECT_EQ(value(0x6007) & 0xffff, 2U) << "disable voltage";
        EXPECT_EQ(value(0x6085), 5'000'000U);
        EXPECT_EQ(value(0x6076), 300U);
        EXPECT_EQ(value(0x6502), 0x3efU);
    }
}

TEST(DeviceLine, Description_reports_what_is_invalid) {
    const auto good = read_line(
        "# line\ncoupler\nservo axes=2 alias=5 serial=1 dc=required\ndigital_in bits=16\n");
    EXPECT_TRUE(good.messages.empty());
    ASSERT_EQ(make_line(good).size(), 3U);
    EXPECT_EQ(sii::parse(make_line(good)[1].sii).alias(), 5);
    struct {
        const char* line;
        const char* sentence;
        const char* help;
    } const rows[] = {
        {"servos", "unknown device 'servos'",
         "use one of: coupler, digital_in, digital_out, analog_in, analog_out, servo, "
         "mailbox_device, esi"},
        {"servo axes=9", "invalid value '9' of axes; use 1..8",
         "options of servo: axes dc modes motor alias serial"},
        {"servo modes=0", "invalid value '0' of modes; use 1..1023",
         "options of servo: axes dc modes motor alias serial"},
        {"servo bits=3", "unknown option 'bits' of servo",
         "options of servo: axes dc modes motor alias serial"},
        {"servo dc=maybe", "invalid value 'maybe' of dc; use required or optional",
         "options of servo: axes dc modes motor alias serial"},
        {"servo motor=inertia",
         "invalid motor parameter 'inertia'; write NAME:VALUE, as in "
         "inertia:1e-4; names: resolution, endless, inertia, "
         "viscous-friction, coulomb-friction, rated-torque, peak-torque, "
         "rated-current, rated-voltage, highest-speed, start, "
         "negative-limit, positive-limit, negative-stop, positive-stop, "
         "home-from, home-to, brake-torque",
         "options of servo: axes dc modes motor alias serial"},
        {"digital_in bits", "option 'bits' has no value; write bits=VALUE",
         "options of digital_in: bits alias serial"},
        {"coupler alias=-1", "invalid value '-1' of alias; use 0..65535",
         "options of coupler: alias serial"},
        {"coupler servo",
         "'servo' is a device of its own; write it on the next line, or after a comma",
         "options of coupler: alias serial"},
        {"esi file=", "option 'file' has no value; write file=FILE.xml",
         "options of esi: file device revision modules alias serial"},
        {"esi device=", "option 'device' has no value; write device=NAME",
         "options of esi: file device revision modules alias serial"},
        {"# only a comment", "the line has no device", "write one device per line"},
    };
    for (const auto& row : rows) {
        const auto bad = read_line(row.line);
        ASSERT_EQ(bad.messages.size(), 1U) << row.line;
        EXPECT_EQ(bad.messages[0].sentence, row.sentence);
        EXPECT_EQ(bad.messages[0].help, row.help);
        EXPECT_TRUE(bad.slaves.empty()) << row.line;
    }
}

TEST(DeviceLine, Motor_of_a_servo_differs_only_where_its_option_does) {
    const auto line = read_line("servo\nservo motor=inertia:1e-3;resolution:4096\n");
    ASSERT_EQ(line.slaves.size(), 2U);
    EXPECT_EQ(line.slaves[0].options.motor.resolution, 10'000U);
    EXPECT_EQ(line.slaves[1].options.motor.resolution, 4096U);
    EXPECT_EQ(line.slaves[1].options.motor.inertia, 1e-3);
    EXPECT_EQ(line.slaves[1].options.motor.highest_speed,
              line.slaves[0].options.motor.highest_speed);
}

TEST(DeviceDictionary, Rejects_to_bind_a_value_without_an_entry_of_its_size) {
    Dictionary dictionary;
    dictionary.variable(0x6040, "Controlword", coe::type::u16, coe::access::read_write, 6);
    dictionary.finish();
    std::uint16_t word = 0;
    std::uint32_t wide = 0;
    const auto text_of = [&](std::uint16_t index, std::uint8_t sub, auto& value) -> std::string {
        try {
            dictionary.bind(index, sub, value);
        } catch (const std::logic_error& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(text_of(0x6041, 0, word),
              "cannot bind a value of 2 bytes to object 0x6041:0: no entry "
              "of this size; add one before finish()");
    EXPECT_EQ(text_of(0x6040, 1, word),
              "cannot bind a value of 2 bytes to object 0x6040:1: no entry "
              "of this size; add one before finish()");
    EXPECT_EQ(text_of(0x6040, 0, wide),
              "cannot bind a value of 4 bytes to object 0x6040:0: no entry "
              "of this size; add one before finish()");
    EXPECT_EQ(text_of(0x6040, 0, word), "");
    dictionary.power_on();
    EXPECT_EQ(word, 6);
}

TEST(DeviceEmergencies, Drop_the_newest_ones_and_count_them) {
    Emergencies part;
    Emergencies all;
    for (std::uint16_t code = 1; code <= Emergencies::capacity + 2; ++code) {
        coe::Emergency emergency;
        emergency.code = code;
        part.push(emergency);
    }
    EXPECT_EQ(part.dropped(), 2U);
    all.push({});
    all.append(part);
    EXPECT_EQ(all.all().size(), Emergencies::capacity);
    EXPECT_EQ(all.all()[1].code, 1);
    EXPECT_EQ(all.all().back().code, Emergencies::capacity - 1);
    EXPECT_EQ(all.dropped(), 3U);
}

TEST_F(Devices, Emergencies_that_the_outbox_has_no_space_for_are_counted) {
    start("servo", {.axes = 8});
    to_op(Bytes(8 * 13));
    for (unsigned axis = 0; axis < 8; ++axis) {
        dynamic_cast<Servo&>(device.firmware->behaviour()).axis(axis).fail(0x2310);
    }
    w.now_ns += 1'000'000;
    outputs(Bytes(8 * 13));
    unsigned received = 0;
    while (!fetch(MailboxType::coe).empty()) {
        ++received;
    }
    EXPECT_EQ(received, 4U);
    EXPECT_EQ(device.firmware->dropped_emergencies(), 4U);
}

TEST_F(Devices, Outputs_are_off_as_soon_as_the_master_takes_the_slave_to_init) {
    start("digital_out");
    to_op({0xff});
    outputs({0xff});
    w.line.advance(w.now_ns += 2'000'000);
    auto& io = static_cast<IoBehaviour&>(device.firmware->behaviour());
    ASSERT_EQ(io.output(0), 1);
    request(State::init);
    EXPECT_EQ(io.output(0), 0);
}

}  // namespace
