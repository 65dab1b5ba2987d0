// SPDX-License-Identifier: MIT
// A program on a bus in memory without timing, and a master's hands: SDO, NMT, frames seen. Time is
// a number.
#pragma once

#include <string>
#include <vector>

#include "canopen/device/node.hpp"
#include "canopen/master/network.hpp"

namespace hal::canopen::test {

class Bench {
public:
    explicit Bench(Program& program, DeviceSettings settings = {.node_id = 5})
        : address_("sim:bench" + std::to_string(++benches) + "?bitrate=unlimited"),
          node(program, can::open(address_).link, settings),
          link_(can::open(address_).link),
          id_(settings.node_id) {
        if (id_ <= 127) {
            remote_ = &network.add(id_);
        }
    }

    /// Time goes on in steps; everybody has a turn in each.
    void run(Time time, Time step = millisecond) {
        for (const Time end = now + time; now < end;) {
            now += step;
            turn();
        }
    }
    void turn() {
        flush();
        node.turn(now);
        for (Frame f; link_->receive(f, now);) {
            seen.push_back(f);
            network.handle(f, now);
        }
        network.poll(now);
        flush();
    }
    void send(const Frame& f) {
        link_->send(f, now);
        link_->flush(now);
    }
    void sync() {
        send(Frame(0x80, {}));
        turn();
    }
    void command(NmtCommand c) {
        network.command(c, id_);
        run(2 * millisecond);
    }
    void start() {
        run(2 * millisecond);
        command(NmtCommand::start);
    }

    Abort write(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> data,
                SdoMode mode = SdoMode::automatic) {
        SdoRequest r{.index = index, .sub = sub, .mode = mode, .data = data};
        return finish(r);
    }
    template <class T>
        requires std::is_arithmetic_v<T>
    Abort write(std::uint16_t index, std::uint8_t sub, T value) {
        std::array<std::uint8_t, sizeof(T)> bytes;
        store(bytes.data(), value);
        return write(index, sub, std::span<const std::uint8_t>(bytes));
    }
    Abort read(std::uint16_t index, std::uint8_t sub, std::vector<std::uint8_t>& data,
               SdoMode mode = SdoMode::segmented) {
        data.assign(1 << 16, 0);
        SdoRequest r{.index = index, .sub = sub, .upload = true, .mode = mode, .buffer = data};
        const auto why = finish(r);
        data.resize(r.size);
        return why;
    }
    template <class T>
        requires std::is_arithmetic_v<T>
    T read(std::uint16_t index, std::uint8_t sub) {
        std::vector<std::uint8_t> data;
        last_abort = read(index, sub, data);
        T value{};
        if (data.size() == sizeof(T)) {
            value = load<T>(data.data());
        }
        return value;
    }
    /// Frames with that identifier since the last forget().
    std::vector<Frame> sent(std::uint32_t id) const {
        std::vector<Frame> found;
        for (const auto& f : seen) {
            if (f.id == id && !f.remote) {
                found.push_back(f);
            }
        }
        return found;
    }
    void forget() { seen.clear(); }
    RemoteNode& remote() { return *remote_; }

private:
    static inline int benches = 0;
    const std::string address_;

public:
    canopen::Node node;
    DeviceEvents events;
    FrameQueue out{256};
    Network network{out, events, {.timeout = 100 * millisecond}};
    std::vector<Frame> seen;
    Time now = second;
    Abort last_abort = Abort::none;

private:
    Abort finish(SdoRequest& r) {
        remote_->sdo().submit(r);
        for (int n = 0; n < 200000 && !r.done(); ++n) {
            now += 100 * microsecond;
            turn();
        }
        return r.done() ? r.abort : Abort::general;
    }
    void flush() {
        for (Frame f; out.pop(f);) {
            link_->send(f, now);
        }
        link_->flush(now);
    }
    std::unique_ptr<can::Link> link_;
    std::uint8_t id_;
    RemoteNode* remote_ = nullptr;
};

}  // namespace hal::canopen::test
