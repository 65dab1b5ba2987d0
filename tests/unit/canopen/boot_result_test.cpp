// SPDX-License-Identifier: MIT
// Every result letter of the boot-up procedure, provoked, and what the user reads then.
#include "boot_bed.hpp"

namespace hal::canopen::test {
namespace {

/// One example device as node 5, the setup changed by `change`; boots until it has a result.
struct One : Bed {
    explicit One(const std::function<void(NodeSetup&)>& change = {}, Description d = example())
        : Bed([&] {
              auto n = example_node();
              n.name = "arm";
              n.on_failure = Reaction::nothing;
              if (change) {
                  change(n);
              }
              return network_of({n});
          }()),
          station(add(5, d)) {}
    BootResult boot() {
        power();
        start();
        EXPECT_TRUE(ended(5));
        return status(5).result;
    }
    std::string text() const { return master->sentence(5); }
    Station& station;
};

/// `example()` with a boot loader: 1F50h, 1F51h, 1F56h, 1F57h.
Description with_program(std::uint32_t id) {
    auto d = example();
    using enum Access;
    d.add_domain(0x1f50, 1, read_write, 10'000);
    d.add(0x1f51, 1, Type::unsigned8, read_write, 1);
    d.add(0x1f56, 1, Type::unsigned32, read_only, id);
    d.add(0x1f57, 1, Type::unsigned32, read_only, 0);
    d.add_text(0x100a, 0, read_only, "V1.2");
    return d;
}

/// The boot loader behind with_program().
struct Loader {
    explicit Loader(Station& s) : station(s) {
        control.after = [this](Entry& e) {
            const auto command = Dictionary::value<std::uint8_t>(e);
            commands.push_back(command);
            auto& d = station.device.dictionary();
            if (command == 3) {
                d.set<std::uint32_t>(0x1f57, 1, 2), busy = 3;
            }
            if (command == 1) {
                d.set<std::uint32_t>(0x1f56, 1, good ? 7 : 6), d.keep(0x1f56, 0x1f56, false);
            }
        };
        status.read = [this](Entry& e) {
            auto value = commands.empty() || commands.back() != 3 ? 0U : error << 1;
            if (busy > 0) {
                --busy;
                value |= 1;
            }
            store(e.data, std::uint32_t{value});
            return Abort::none;
        };
        station.device.dictionary().handle(0x1f51, control);
        station.device.dictionary().handle(0x1f57, status);
    }
    Station& station;
    Spoil control, status;
    std::vector<unsigned> commands;
    int busy = 0;
    unsigned error = 0;
    bool good = true;
};
void wants_program_7(NodeSetup& n) {
    n.program.id = 7;
    n.program.update = true;
    n.program.limit = 2 * second;
    n.program.image.assign(3000, 0x55);
}

TEST(BootResult, Is_good_for_the_expected_device) {
    One b;
    EXPECT_EQ(b.boot(), BootResult::good);
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.state(0), NmtState::operational);
    EXPECT_EQ(b.own->state(), NmtState::operational);
    EXPECT_EQ(b.way(5),
              "queued, resetting, identifying, configuring, waiting for its heartbeat, ready, "
              "starting, running");
    EXPECT_EQ(b.value(0, 0x1017, 0), 50U);
    EXPECT_EQ(b.text(), "");
    EXPECT_EQ(b.master->sentence(), "the network is operational");
    EXPECT_EQ(b.status(5).attempts, 1U);
    EXPECT_TRUE(b.status(5).online && b.status(5).operational);
    EXPECT_LE(b.status(5).age(b.now), 51 * millisecond);
    EXPECT_EQ(b.networks, (std::vector{NetworkState::booting, NetworkState::operational}));
}

TEST(BootResult, A_for_a_node_that_is_not_listed) {
    One b;
    EXPECT_EQ(b.status(9).result, BootResult::not_listed);
    EXPECT_EQ(b.master->sentence(9), "node 9 is not in the configuration");
    EXPECT_FALSE(b.master->restart(9, b.now));
    EXPECT_STREQ(to_string(BootResult::not_listed), "not in the network list");
}

TEST(BootResult, B_for_a_node_that_does_not_answer) {
    One b;
    b.start();
    ASSERT_TRUE(b.ended(5));
    EXPECT_EQ(b.status(5).result, BootResult::no_answer);
    EXPECT_EQ(b.text(),
              "node 5 (arm) does not respond (1000:0): check its power, cable, bit rate and node "
              "ID; 'hal can scan' lists the nodes that "
              "respond [result B, no response]");
    EXPECT_EQ(b.master->sentence(), "the network is booting: " + b.text() + "; retrying");
    EXPECT_EQ(b.status(5).step, Step::waiting);
    EXPECT_FALSE(b.status(5).online);
    // the boot limit is over
    ASSERT_TRUE(b.until([&] { return b.status(5).step == Step::failed; }));
    // its boot-up message brings it in
    b.power();
    EXPECT_TRUE(b.operational());
}

struct Wrong {
    std::uint32_t NodeSetup::* what;
    BootResult letter;
    const char* text;
};
class BootResultOfIdentity : public testing::TestWithParam<Wrong> {};
TEST_P(BootResultOfIdentity, Tells_what_differs) {
    One b([](NodeSetup& n) { n.*GetParam().what = 0x12345; });
    EXPECT_EQ(b.boot(), GetParam().letter);
    EXPECT_EQ(b.text(), std::string("node 5 (arm) is another device: its ") + GetParam().text);
    b.run(5 * second);
    EXPECT_EQ(b.status(5).step, Step::failed);
    EXPECT_EQ(b.state(0), NmtState::pre_operational);
    EXPECT_EQ(b.master->status().node, 5);
}
INSTANTIATE_TEST_SUITE_P(
    Each, BootResultOfIdentity,
    testing::Values(Wrong{&NodeSetup::device_type, BootResult::device_type,
                          "device type (1000:0) is 0191h where 00012345h is expected; connect the "
                          "right device or correct its "
                          "configuration [result C, wrong device type]"},
                    Wrong{&NodeSetup::vendor, BootResult::vendor,
                          "vendor ID (1018:1) is 0001h where 00012345h is expected; connect the "
                          "right device or correct its "
                          "configuration [result D, wrong vendor]"},
                    Wrong{&NodeSetup::product, BootResult::product,
                          "product code (1018:2) is 0002h where 00012345h is expected; connect the "
                          "right device or correct its "
                          "configuration [result M, wrong product]"},
                    Wrong{&NodeSetup::revision, BootResult::revision,
                          "revision number (1018:3) is 0003h where 00012345h is expected; connect "
                          "the right device or correct its "
                          "configuration [result N, wrong revision]"},
                    Wrong{&NodeSetup::serial, BootResult::serial,
                          "serial number (1018:4) is 0004h where 00012345h is expected; connect "
                          "the right device or correct its "
                          "configuration [result O, wrong serial number]"}),
    [](const auto& with) { return std::string(1, static_cast<char>(with.param.letter)); });

TEST(BootResult, O_when_it_does_not_tell_its_serial_number) {
    One b;
    Spoil identity;
    identity.read = [](Entry& e) { return e.sub == 4 ? Abort::no_sub : Abort::none; };
    b.station.device.dictionary().handle(0x1018, identity);
    EXPECT_EQ(b.boot(), BootResult::serial);
    EXPECT_EQ(b.text(),
              "node 5 (arm) rejects the read of its serial number, 1018:4: sub-index does not "
              "exist (06090011h); connect the right "
              "device, or remove this check [result O, wrong serial number]");
}

TEST(BootResult, E_when_a_node_to_keep_alive_sends_no_heartbeat) {
    auto d = example();
    d.find(0x1017, 0)->value = {50, 0};
    One b([](NodeSetup& n) { n.keep_alive = true; }, d);
    b.station.tamper = [](const Frame& f) { return f.id != 0x705; };
    EXPECT_EQ(b.boot(), BootResult::no_heartbeat);
    EXPECT_EQ(
        b.text(),
        "node 5 (arm) sent no heartbeat while its state was checked: check its power and cable "
        "[result E, no heartbeat while its state was checked]");
}

TEST(BootResult, F_when_a_node_does_not_answer_guarding) {
    One b([](NodeSetup& n) { n.guard_ms = 20; });
    b.station.tamper = [](const Frame& f) { return f.id != 0x705; };
    EXPECT_EQ(b.boot(), BootResult::no_guarding);
    EXPECT_EQ(b.text(),
              "node 5 (arm) did not respond to node guarding at the start of error control: check "
              "its power and cable, and that it "
              "supports node guarding [result F, no response to node guarding]");
    One kept([](NodeSetup& n) {
        n.guard_ms = 20;
        n.keep_alive = true;
    });
    kept.station.tamper = b.station.tamper;
    EXPECT_EQ(kept.boot(), BootResult::no_guarding);
    EXPECT_EQ(kept.status(5).failed_in, Step::checking_state);
}

TEST(BootResult, G_when_the_objects_of_the_program_or_its_image_are_missing) {
    One without(wants_program_7);
    EXPECT_EQ(without.boot(), BootResult::no_program);
    EXPECT_EQ(without.text(),
              "node 5 (arm) has no object 1F56:1, so its program cannot be checked or updated: "
              "remove the program from its configuration "
              "[result G, program or program objects missing]");
    One no_image([](NodeSetup& n) {
        wants_program_7(n);
        n.program.image.clear();
    }, with_program(6));
    EXPECT_EQ(no_image.boot(), BootResult::no_program);
    EXPECT_EQ(no_image.text(),
              "node 5 (arm) runs program 0006h (1F56:1) where 0007h is expected, and no program "
              "file is configured: configure one "
              "[result G, program or program objects missing]");
}

TEST(BootResult, H_when_an_update_is_needed_and_not_allowed) {
    One b([](NodeSetup& n) { n.program.id = 7; }, with_program(6));
    EXPECT_EQ(b.boot(), BootResult::no_update);
    EXPECT_EQ(b.text(),
              "node 5 (arm) runs program 0006h (1F56:1) where 0007h is expected, and updates are "
              "not allowed: update it by hand or allow "
              "the update [result H, wrong program, update not allowed]");
    One version([](NodeSetup& n) { n.program.version = "V1.3"; }, with_program(6));
    EXPECT_EQ(version.boot(), BootResult::no_update);
    EXPECT_EQ(version.text(),
              "node 5 (arm) runs program 'V1.2' (100A:0) where 'V1.3' is expected, and updates are "
              "not allowed: update it by hand or "
              "allow the update [result H, wrong program, update not allowed]");
    One right([](NodeSetup& n) { n.program.version = "V1.2"; }, with_program(6));
    EXPECT_EQ(right.boot(), BootResult::good);
}

TEST(BootResult, Is_good_after_a_program_was_downloaded) {
    One b(wants_program_7, with_program(6));
    Loader loader(b.station);
    EXPECT_EQ(b.boot(), BootResult::good);
    EXPECT_EQ(loader.commands, (std::vector{0U, 3U, 1U}));
    EXPECT_EQ(b.station.device.dictionary().find(0x1f50, 1)->size, 3000U);
    EXPECT_TRUE(b.operational());
    EXPECT_EQ(note_sentences(*b.master->setup(5), b.status(5)),
              (std::vector<std::string>{"node 5 (arm) received a new program"}));
}

TEST(BootResult, I_when_the_download_fails) {
    One refused(wants_program_7, with_program(6));
    Spoil spoil;
    spoil.write = [](Entry&, std::span<const std::uint8_t>) { return Abort::device_state; };
    refused.station.device.dictionary().handle(0x1f51, spoil);
    EXPECT_EQ(refused.boot(), BootResult::update);
    EXPECT_EQ(refused.text(),
              "node 5 (arm) rejects object 1F51:1 while its program was updated: data cannot be "
              "transferred or stored because of the "
              "present device state (08000022h) [result I, program download failed]");

    One flash(wants_program_7, with_program(6));
    Loader bad(flash.station);
    bad.error = 5;
    EXPECT_EQ(flash.boot(), BootResult::update);
    EXPECT_EQ(flash.text(),
              "node 5 (arm) reports a flash error: flash write error (1F57:1 is 000Ah); check that "
              "the file is for this device [result "
              "I, program download failed]");

    One busy(wants_program_7, with_program(6));
    Loader slow(busy.station);
    slow.busy = 1 << 30;
    EXPECT_EQ(busy.boot(), BootResult::update);
    EXPECT_EQ(busy.text(),
              "node 5 (arm) reports its flash busy for more than 2.00 s (1F57:1) [result I, "
              "program download failed]");

    One same(wants_program_7, with_program(6));
    Loader other(same.station);
    other.good = false;
    EXPECT_EQ(same.boot(), BootResult::update);
    EXPECT_EQ(same.text(),
              "node 5 (arm) still runs program 0006h (1F56:1) where 0007h is expected after the "
              "download; check the file [result I, "
              "program download failed]");
}

TEST(BootResult, J_when_an_object_cannot_be_configured) {
    const auto with = [](ObjectWrite w) { return [w](NodeSetup& n) { n.writes = {w}; }; };
    One missing(with(object_write(0x5000, 3, std::uint32_t{9}, "gain")));
    EXPECT_EQ(missing.boot(), BootResult::configuration);
    EXPECT_EQ(
        missing.text(),
        "node 5 (arm) rejects 0009h for object 5000:3 (gain): object does not exist in the object "
        "dictionary (06020000h); correct "
        "the value in its configuration or remove the object [result J, configuration failed]");
    One high(with(object_write(0x2001, 0, std::int16_t{101})));
    EXPECT_EQ(high.boot(), BootResult::configuration);
    EXPECT_EQ(high.text(),
              "node 5 (arm) rejects 0065h for object 2001:0: value of the parameter written too "
              "high (06090031h); correct the value in "
              "its configuration or remove the object [result J, configuration failed]");
    One forgets(with(object_write(0x2000, 0, std::uint32_t{9})));
    Spoil spoil;
    spoil.after = [](Entry& e) { store(e.data, std::uint32_t{8}); };
    forgets.station.device.dictionary().handle(0x2000, spoil);
    EXPECT_EQ(forgets.boot(), BootResult::configuration);
    EXPECT_EQ(forgets.text(),
              "node 5 (arm) accepted 0009h for object 2000:0 but holds 0008h; write a value it can "
              "hold, or remove the object [result J, "
              "configuration failed]");
    One silent(with(object_write(0x2000, 0, std::uint32_t{9})));
    silent.station.tamper = [](const Frame& f) {
        return f.id != 0x585 || f.data[1] != 0x00 || f.data[2] != 0x20;
    };
    EXPECT_EQ(silent.boot(), BootResult::configuration);
    EXPECT_EQ(silent.text(),
              "node 5 (arm) stopped responding at 2000:0 while it was configured: check its power "
              "and cable [result J, configuration "
              "failed]");
}

TEST(BootResult, K_when_the_heartbeat_does_not_come) {
    One b;
    b.station.tamper = [](const Frame& f) { return f.id != 0x705 || f.data[0] == 0; };
    EXPECT_EQ(b.boot(), BootResult::watching);
    EXPECT_EQ(
        b.text(),
        "node 5 (arm) sent no heartbeat at the start of error control: check its power and cable "
        "[result K, no heartbeat at the start of error control]");
}

TEST(BootResult, L_when_a_node_to_keep_alive_is_operational_already) {
    auto d = example();
    d.find(0x1017, 0)->value = {50, 0};
    One b([](NodeSetup& n) {
        n.keep_alive = true;
        n.writes = {object_write(0x2000, 0, std::uint32_t{9})};
    }, d);
    b.power();
    b.station.device.command(NmtCommand::start, b.now);
    b.run(200 * millisecond);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.status(5).result, BootResult::was_operational);
    EXPECT_EQ(b.station.resets.size(), 0U);                 // not reset,
    EXPECT_EQ(b.value(0, 0x2000, 0), 0x12345678U);          // not configured,
    EXPECT_EQ(b.status(5).state, NmtState::operational);    // and watched:
    EXPECT_EQ(note_sentences(*b.master->setup(5), b.status(5)),
              (std::vector<std::string>{"node 5 (arm) was already operational and was not reset"}));
    b.master->start(b.now);  // nor the second time
    b.run(second);
    EXPECT_EQ(b.status(5).result, BootResult::was_operational);
    EXPECT_EQ(b.station.resets.size(), 0U);
    b.station.plug(false, b.now);
    ASSERT_TRUE(b.until([&] { return b.status(5).losses == 1; }, second));
    b.station.plug(true, b.now);  // now it is booted as any other
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.status(5).result, BootResult::good);
    EXPECT_EQ(b.value(0, 0x2000, 0), 9U);
}

TEST(BootResult, Names_two_devices_with_one_id) {
    One b;
    b.add(5, example(77));
    EXPECT_EQ(b.boot(), BootResult::serial);
    EXPECT_EQ(b.status(5).cause, Cause::duplicate_id);
    const bool order = b.status(5).expected == 4;
    EXPECT_EQ(b.text(),
              std::string(
                  "node 5 (arm) has a duplicate node ID: two devices respond, object 1018:4 is ") +
                  (order ? "0004h and 004Dh" : "004Dh and 0004h") +
                  "; change the node ID of one of them [result O, wrong serial number]");
}

TEST(BootResult, Notes_two_devices_with_one_id_by_their_heartbeats) {
    One b([](NodeSetup& n) { n.serial = 0; });
    b.add(5, example(77));
    EXPECT_EQ(b.boot(), BootResult::good);
    ASSERT_TRUE(b.until([&] { return (b.status(5).notes & note_duplicate_id) != 0; }, 5 * second));
    EXPECT_EQ(note_sentences(*b.master->setup(5), b.status(5)),
              (std::vector<std::string>{
                  "node 5 (arm) sends too many heartbeats: two devices may have this node ID"}));
}

}  // namespace
}  // namespace hal::canopen::test
