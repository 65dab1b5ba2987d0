// SPDX-License-Identifier: MIT
// SDO client and server against peers that are slow, drop frames, send stale frames or do not
// respond.
#include "sdo_bed.hpp"

namespace hal::canopen::test {
namespace {

/// A client that pauses 300 ms in the middle of every block: nothing is acknowledged before its
/// end, and the size stays.
TEST(SdoServer, Does_not_acknowledge_before_the_end_of_a_block_of_a_slow_client) {
    Recorder events;
    Device device(example(), {.node_id = 5, .sdo = {.timeout = 1 * second}}, events);
    Bus bus;
    bus.attach(device);
    Time now = 0;
    device.start(now);
    bus.exchange(now);
    const auto data = pattern(127 * 7 * 3, 5);
    std::vector<std::pair<unsigned, unsigned>> acknowledged;
    const auto turn = [&](const Frame* f) {
        bus.log.clear();
        if (f != nullptr) {
            bus.inject(*f, now);
        }
        device.poll(now);
        bus.exchange(now);
        for (const auto& one : bus.log) {
            if (one.id == 0x585 && one.data[0] == 0xa2) {
                acknowledged.emplace_back(one.data[1], one.data[2]);
            } else if (one.id == 0x585 && one.data[0] == 0x80) {
                ADD_FAILURE() << "aborted " << load<std::uint32_t>(one.data.data() + 4);
            }
        }
    };
    Frame start = make_frame(0x605, 8);
    start.data = {0xc2, 0x06, 0x20, 0};
    store(start.data.data() + 4, static_cast<std::uint32_t>(data.size()));
    turn(&start);
    for (unsigned segment = 0; segment < data.size() / 7; ++segment) {
        Frame f = make_frame(0x605, 8);
        const bool is_last = segment + 1 == data.size() / 7;
        f.data[0] = static_cast<std::uint8_t>((segment % 127 + 1) | (is_last ? 0x80U : 0U));
        std::copy_n(data.begin() + segment * 7, 7, f.data.begin() + 1);
        turn(&f);
        if (segment % 127 == 60) {
            for (int n = 0; n < 300; ++n) {
                now += millisecond;
                turn(nullptr);
            }
        }
    }
    EXPECT_EQ(acknowledged,
              (std::vector<std::pair<unsigned, unsigned>>{{127, 127}, {127, 127}, {127, 127}}));
    Frame end = make_frame(0x605, 8);
    end.data[0] = 0xc1;
    turn(&end);
    const auto& e = *device.dictionary().find(0x2006, 0);
    ASSERT_EQ(e.size, data.size());
    EXPECT_TRUE(std::equal(data.begin(), data.end(), e.data));
}

TEST(SdoServer, Acknowledges_an_incomplete_block_after_half_of_its_timeout_and_drops_the_rest) {
    Recorder events;
    Device device(example(), {.node_id = 5, .sdo = {.timeout = 1 * second}}, events);
    Bus bus;
    bus.attach(device);
    Time now = 0;
    device.start(now);
    bus.exchange(now);
    const auto data = pattern(70, 6);
    std::vector<std::vector<std::uint8_t>> answers;
    const auto turn = [&](const std::vector<std::uint8_t>& f) {
        bus.log.clear();
        if (!f.empty()) {
            Frame frame = make_frame(0x605, 8);
            std::copy(f.begin(), f.end(), frame.data.begin());
            bus.inject(frame, now);
        }
        device.poll(now);
        bus.exchange(now);
        for (const auto& one : bus.log) {
            if (one.id == 0x585) {
                answers.push_back({one.data[0], one.data[1], one.data[2]});
            }
        }
    };
    const auto segment = [&](unsigned number, unsigned which, bool last = false) {
        std::vector<std::uint8_t> f{static_cast<std::uint8_t>(number | (last ? 0x80 : 0))};
        f.insert(f.end(), data.begin() + which * 7, data.begin() + which * 7 + 7);
        turn(f);
    };
    turn({0xc2, 0x06, 0x20, 0, 70, 0, 0, 0});
    answers.clear();
    for (unsigned n = 0; n < 4; ++n) {
        segment(n + 1, n);
    }
    for (int n = 0; n < 499; ++n) {
        now += millisecond;
        turn({});
    }
    EXPECT_TRUE(answers.empty());
    for (int n = 0; n < 2; ++n) {
        now += millisecond;
        turn({});
    }
    EXPECT_EQ(answers, (std::vector<std::vector<std::uint8_t>>{{0xa2, 4, 127}}))
        << "nothing was lost: the size stays";
    answers.clear();
    // the rest of the old block, on its way when the acknowledgement came
    for (unsigned n = 4; n < 10; ++n) {
        segment(n + 1, n, n == 9);
    }
    EXPECT_TRUE(answers.empty());
    for (unsigned n = 4; n < 10; ++n) {
        segment(n - 3, n, n == 9);
    }
    EXPECT_EQ(answers, (std::vector<std::vector<std::uint8_t>>{{0xa2, 6, 127}}));
    turn({0xc1});
    const auto& e = *device.dictionary().find(0x2006, 0);
    ASSERT_EQ(e.size, data.size());
    EXPECT_TRUE(std::equal(data.begin(), data.end(), e.data));
}

TEST(SdoClient, Aborts_when_a_segment_is_acknowledged_that_was_never_sent) {
    for (const bool whole : {false, true}) {
        FrameQueue out(256);
        SdoClient client(out, {.restarts = 0});
        client.configure(9);
        const auto data = pattern(70, 1);
        SdoRequest r{.index = 0x2006, .mode = SdoMode::block, .data = data};
        client.submit(r);
        client.poll(0);
        client.handle(
            {0x589, {0xa4, 0x06, 0x20, 0, static_cast<std::uint8_t>(whole ? 127 : 5), 0, 0, 0}}, 0);
        Frame f;
        while (out.pop(f)) {
        }
        EXPECT_EQ(f.data[0] & 0x7f, whole ? 10 : 5);
        client.handle({0x589, {0xa2, static_cast<std::uint8_t>(whole ? 11 : 6), 20, 0, 0, 0, 0, 0}},
                      0);
        ASSERT_TRUE(out.pop(f));
        EXPECT_EQ(f.data[0], 0x80);
        EXPECT_EQ(load<std::uint32_t>(f.data.data() + 4), 0x05040003U);
        EXPECT_TRUE(r.done());
        EXPECT_EQ(r.abort, Abort::sequence);
    }
}

TEST(SdoClient, Continues_after_the_segment_a_server_acknowledged_early) {
    FrameQueue out(16);  // the block does not leave at once
    SdoClient client(out, {.restarts = 0});
    client.configure(9);
    const auto data = pattern(140, 1);
    SdoRequest r{.index = 0x2006, .mode = SdoMode::block, .data = data};
    client.submit(r);
    client.poll(0);
    Frame f;
    ASSERT_TRUE(out.pop(f));
    client.handle({0x589, {0xa4, 0x06, 0x20, 0, 127, 0, 0, 0}}, 0);
    unsigned sent = 0;
    for (; sent < 6 && out.pop(f); ++sent) {
    }
    client.handle({0x589, {0xa2, 6, 127, 0, 0, 0, 0, 0}}, 0);
    std::vector<std::uint8_t> got(data.begin(), data.begin() + 42);
    bool begun = false;
    bool last = false;
    for (int n = 0; n < 100 && !last; ++n) {
        client.poll(0);
        while (out.pop(f) && !last) {
            begun = begun || (f.data[0] & 0x7f) == 1;
            if (!begun) {
                continue;  // of the old block
            }
            got.insert(got.end(), f.data.begin() + 1, f.data.end() - (f.data.size() - 8));
            last = (f.data[0] & 0x80) != 0;
        }
    }
    EXPECT_EQ(got, data);
}

TEST(SdoClient, Drops_a_stale_abort_and_repeats_the_request_on_timeout) {
    SdoBed p;
    std::uint8_t buffer[4];
    SdoRequest r{.index = 0x2000, .sub = 0, .upload = true, .buffer = buffer};
    p.client.submit(r);
    p.client.poll(p.now);
    Frame asked;
    // never reaches the server: it answers with the abort of an earlier transfer instead
    ASSERT_TRUE(p.out.pop(asked));
    p.client.handle({0x585, {0x80, 0x06, 0x20, 0, 0x01, 0, 0x04, 0x05}}, p.now);
    EXPECT_FALSE(r.done());
    EXPECT_EQ(p.client.unexpected_responses(), 1U);
    for (int n = 0; n < 200 && !r.done(); ++n) {
        p.now += millisecond;
        p.client.poll(p.now);
        p.bus.exchange(p.now);
    }
    EXPECT_TRUE(r.ok());
    EXPECT_EQ(r.retries, 1U);
    EXPECT_EQ(load<std::uint32_t>(buffer), 0x12345678U);
}

TEST(SdoClient, Falls_back_to_segments_when_the_server_has_no_block_transfer) {
    FrameQueue out(64);
    SdoClient client(out);
    client.configure(9);
    const auto data = pattern(20, 1);
    SdoRequest r{.index = 0x2006, .mode = SdoMode::block, .data = data};
    client.submit(r);
    client.poll(0);
    Frame f;
    ASSERT_TRUE(out.pop(f));
    EXPECT_EQ(f.data[0], 0xc6);
    client.handle({0x589, {0x80, 0x06, 0x20, 0, 0x01, 0, 0x04, 0x05}}, 0);
    ASSERT_TRUE(out.pop(f));
    EXPECT_EQ(f.data[0], 0x21);
    EXPECT_EQ(load<std::uint32_t>(f.data.data() + 4), 20U);
}

TEST(SdoClient, Aborts_the_transfer_when_the_node_does_not_respond) {
    FrameQueue out(64);
    SdoClient client(out, {.timeout = 10 * millisecond, .resends = 2, .restarts = 0});
    client.configure(9);
    std::uint8_t buffer[4];
    SdoRequest r{.index = 0x1000, .upload = true, .buffer = buffer};
    client.submit(r);
    for (Time t = 0; t < 100 * millisecond && !r.done(); t += millisecond) {
        client.poll(t);
    }
    EXPECT_TRUE(r.done());
    EXPECT_EQ(r.abort, Abort::timeout);
    std::vector<std::uint8_t> commands;
    for (Frame f; out.pop(f);) {
        commands.push_back(f.data[0]);
    }
    EXPECT_EQ(commands, (std::vector<std::uint8_t>{0x40, 0x40, 0x40, 0x80}));
}

TEST(SdoClient, Serves_queued_requests_and_cancels_one_of_them) {
    SdoBed p;
    std::uint8_t a[4], b[4], c[4];
    SdoRequest first{.index = 0x1000, .upload = true, .buffer = a};

    SdoRequest second{.index = 0x1018, .sub = 1, .upload = true, .buffer = b};

    SdoRequest third{.index = 0x1018, .sub = 2, .upload = true, .buffer = c};
    EXPECT_TRUE(p.client.submit(first));
    EXPECT_TRUE(p.client.submit(second));
    EXPECT_FALSE(p.client.submit(second));
    p.client.cancel(second);
    EXPECT_TRUE(second.done());
    EXPECT_EQ(second.abort, Abort::general);
    ASSERT_TRUE(p.run(third));
    EXPECT_TRUE(first.ok());
    EXPECT_TRUE(third.ok());
    EXPECT_EQ(load<std::uint32_t>(c), 2U);
}

TEST(SdoClient, Does_not_write_beyond_its_buffer) {
    SdoBed p;
    const auto data = pattern(1000, 3);
    SdoRequest down{.index = 0x2006, .data = data};
    ASSERT_TRUE(p.run(down));
    for (const auto mode : {SdoMode::segmented, SdoMode::block}) {
        std::vector<std::uint8_t> buffer(999);
        SdoRequest up{.index = 0x2006, .upload = true, .mode = mode, .buffer = buffer};
        ASSERT_TRUE(p.run(up));
        EXPECT_EQ(up.abort, Abort::memory);
        EXPECT_FALSE(up.aborted_by_server);
    }
}

TEST(SdoClient, Fails_when_no_frame_can_be_sent_within_the_response_timeout) {
    const auto data = pattern(5000, 7);
    for (const bool block : {false, true}) {
        FrameQueue out(64);
        while (out.push(make_frame(0x123, 0))) {
        }
        SdoClient client(out, {.timeout = 10 * millisecond, .resends = 2, .restarts = 5});
        client.configure(9);
        SdoRequest r{
            .index = 0x2006, .mode = block ? SdoMode::block : SdoMode::segmented, .data = data};
        client.submit(r);
        Time t = 0;
        if (block) {  // it gets as far as the middle of a block
            out.clear();
            client.poll(t);
            for (Frame f; out.pop(f);) {
            }
            client.handle({0x589, {0xa4, 0x06, 0x20, 0, 127, 0, 0, 0}}, t);
        }
        const auto waiting = out.size();
        for (; t < second && !r.done(); t += millisecond) {
            client.poll(t);
        }
        ASSERT_TRUE(r.done());
        EXPECT_EQ(t, 32 * millisecond) << block;
        EXPECT_EQ(r.abort, Abort::timeout);
        EXPECT_TRUE(r.not_sent);
        EXPECT_FALSE(r.aborted_by_server);
        EXPECT_EQ(out.size(), waiting);  // no abort behind all that
        out.clear();
        std::uint8_t buffer[4];
        SdoRequest next{.index = 0x1000, .upload = true, .buffer = buffer};
        client.submit(next);
        client.poll(t);
        ASSERT_EQ(out.size(), 1U);
        client.handle({0x589, {0x43, 0, 0x10, 0, 1, 2, 3, 4}}, t);
        EXPECT_TRUE(next.ok());
        EXPECT_FALSE(next.not_sent);
    }
}

TEST(SdoClient, Waits_for_queue_space_while_other_clients_are_served) {
    FrameQueue out(64);
    SdoClient client(out, {.timeout = 10 * millisecond, .resends = 2, .restarts = 0});
    client.configure(9);
    const auto data = pattern(5000, 8);
    SdoRequest r{.index = 0x2006, .mode = SdoMode::block, .data = data};
    client.submit(r);
    client.poll(0);
    for (Frame f; out.pop(f);) {
    }
    client.handle({0x589, {0xa4, 0x06, 0x20, 0, 127, 0, 0, 0}}, 0);
    while (out.push(make_frame(0x123, 0))) {
    }
    // a frame leaves, and another sender takes its slot
    for (Time t = 0; t < second; t += millisecond) {
        Frame f;
        out.pop(f);
        out.push(make_frame(0x123, 0));
        client.poll(t);
    }
    EXPECT_FALSE(r.done());
}

TEST(SdoClient, Serves_many_nodes_at_once) {
    Bus bus;
    Recorder events;
    FrameQueue out(4096);
    Network network(out, events, {.timeout = 100 * millisecond});
    std::vector<std::unique_ptr<Device>> devices;
    for (std::uint8_t id = 1; id <= 127; ++id) {
        devices.push_back(std::make_unique<Device>(basic_device({.vendor = 1000U + id}),
                                                   DeviceSettings{.node_id = id, .queue = 64},
                                                   events));
        bus.attach(*devices.back());
        network.add(id);
        devices.back()->start(0);
    }
    bus.attach(out, [&](const Frame& f, Time t) { network.handle(f, t); });
    bus.logging = false;
    std::vector<std::array<std::uint8_t, 4>> rooms(128);
    std::vector<SdoRequest> requests(128);
    for (std::uint8_t id = 1; id <= 127; ++id) {
        requests[id].index = 0x1018;
        requests[id].sub = 1;
        requests[id].upload = true;

        requests[id].buffer = rooms[id];
        network.node(id)->sdo().submit(requests[id]);
    }
    bus.exchange(0);
    network.poll(0);
    bus.exchange(0);
    for (std::uint8_t id = 1; id <= 127; ++id) {
        EXPECT_TRUE(requests[id].ok());
        EXPECT_EQ(load<std::uint32_t>(rooms[id].data()), 1000U + id);
        EXPECT_EQ(network.node(id)->boot_ups(), 1U);
    }
}

}  // namespace
}  // namespace hal::canopen::test
