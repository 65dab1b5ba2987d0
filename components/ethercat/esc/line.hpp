// SPDX-License-Identifier: MIT
// A line of emulated slaves: controllers, cables between their ports, and the way of a frame
// through them (ETG.1000.4, clause 4.3).
//
//     esc::Line line;
//     line.add({.controller = {}, .sii = image, .application = &firmware});          // at the primary end
//     line.add({.controller = {}, .sii = image, .application = &other});             // at port 1 of the one before
//     line.close_ring(1, 1);                                                         // the secondary end, for redundancy
//     line.power_on(0);
//     const auto out = line.process(frame, esc::End::primary, now_ns);
//     if (!out.lost) send(frame, out.end, out.first_bit_ns);
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "ethercat/esc/controller.hpp"
#include "ethercat/esc/way.hpp"

namespace hal::ethercat::esc {

/// One slave to add.
struct SlaveOnLine {
    static constexpr int previous = -2;
    Settings controller{};
    std::vector<std::uint8_t> sii{};
    Application* application = nullptr;  ///< not owned; must outlive the line
    /// slave it is connected to; -1: the primary end
    int parent = previous;
    /// ports of the cable to it; `parent_port` is ignored at the primary end
    unsigned parent_port = 1;
    unsigned port = 0;
    std::int64_t cable_ns = 50;  ///< delay of that cable: 5 ns/m
};

/// What happens to a frame on a cable.
enum class LineFault : std::uint8_t {
    loss,  ///< does not arrive
    corruption,  ///< arrives with a wrong check sequence: counted, and not used by any slave behind
    duplicate,  ///< leaves the line twice
    delay,  ///< arrives later by `delay_ns`
    noise,  ///< arrives; a symbol error is counted (0301h)
};

/// Selects the frames that are hit.
struct LineDisturbance {
    LineFault fault = LineFault::loss;
    /// the slave at whose port the frame arrives; -1: the master
    int slave = -1;
    unsigned port = 0;  ///< that port; for the master the end, 0 or 1
    std::uint32_t every = 1;  ///< every n-th frame that arrives there
    std::uint64_t count = UINT64_MAX;  ///< ends after this many hits
    std::int64_t delay_ns = 0;
};

/// A change of a line that another thread requests.
struct LineCommand {
    enum class Kind : std::uint8_t {
        power,  ///< `on`
        cable,  ///< of `port`: whole if `on`
        end_cable,  ///< of the end `port`: whole if `on`
        drift,  ///< of the oscillator: `value`, ppm
        jump,  ///< of the local clock: `value`, ns
        eeprom,  ///< fails the next `value` commands
        checksum,  ///< of the EEPROM: good if `on`; takes effect at power-on
        identity,  ///< in the EEPROM: its own if `on`, else another product code
        watchdog,  ///< expires
        disturb,  ///< adds `disturbance`
        calm,  ///< ends all disturbances
    } kind = Kind::power;
    unsigned slave = 0;
    unsigned port = 0;
    bool on = false;
    double value = 0;
    LineDisturbance disturbance{};
};

class Line {
public:
    static constexpr std::size_t max_disturbances = 32;

    Line();
    Line(const Line&) = delete;
    Line& operator=(const Line&) = delete;

    /// Adds a slave without power. Returns its number, counted from 0; -1 if a port of the cable
    /// does not exist or is taken. [setup]
    int add(SlaveOnLine slave);
    /// Connects the secondary end to a free port. Returns false if it does not exist or is taken.
    /// [setup]
    bool close_ring(unsigned slave, unsigned port, std::int64_t cable_ns = 50);
    /// Sets the rate of the cables, Mbit/s. [setup]
    void set_speed(std::uint32_t mbit) noexcept { speed_ = mbit; }

    /// Returns the number of slaves. [any]
    std::size_t size() const noexcept { return nodes_.size(); }
    /// Returns a slave's controller. [realtime]
    Controller& controller(std::size_t slave) noexcept { return *nodes_[slave].controller; }

    // On the thread of process(), or while it is not called. [realtime]

    void power_on(std::int64_t now_ns) noexcept;  ///< Switches all slaves on.
    void set_power(std::size_t slave, bool on, std::int64_t now_ns) noexcept;
    /// Breaks or repairs the cable at a port. Does nothing for a port without cable.
    void set_cable(std::size_t slave, unsigned port, bool connected) noexcept;
    /// Breaks or repairs the cable of an end.
    void set_cable(End end, bool connected) noexcept;
    /// Returns whether the port has an unbroken cable.
    bool cable(std::size_t slave, unsigned port) const noexcept;
    /// Adds a disturbance. Returns its number, -1 when there are too many.
    int disturb(const LineDisturbance&) noexcept;
    /// Returns how many frames disturbance `number` has hit.
    std::uint64_t hits(int number) const noexcept;
    void calm() noexcept { disturbance_count_ = 0; }  ///< Ends all disturbances.
    /// Executes a command.
    void execute(const LineCommand&, std::int64_t now_ns) noexcept;

    /// Queues a command for the next frame or advance(). Returns false if 64 are waiting.
    /// [realtime] any one thread
    bool post(const LineCommand&) noexcept;

    /// Where a frame went.
    struct Passage {
        bool lost = true;
        End end = End::primary;  ///< where it leaves
        std::int64_t first_bit_ns = 0;  ///< when its first bit leaves there
        unsigned copies = 1;
    };
    /// Sends a frame (from the destination address on) into an end, and changes it as the slaves
    /// do.
    Passage process(std::span<std::uint8_t> frame, End end, std::int64_t first_bit_ns) noexcept;
    /// Works what is due until `now_ns` without a frame: SYNC pulses, watchdogs, applications.
    void advance(std::int64_t now_ns) noexcept;
    /// Returns the number of frames so far.
    std::uint64_t frames() const noexcept { return number_; }

private:
    static constexpr int nowhere = -1;
    static constexpr int at_end = -2;  ///< in Connection::slave
    struct Connection {
        int slave = nowhere;
        unsigned port = 0;  ///< at_end: the end
        std::int64_t delay_ns = 0;
        bool broken = false;
    };
    struct Node {
        std::unique_ptr<Controller> controller;
        const FrameInterest* interest = nullptr;
        std::int64_t processing_ns = 0;
        std::int64_t forwarding_ns = 0;
        std::array<Connection, ports> cables;

        bool is_open(unsigned port) const noexcept {
            return (interest->open_ports >> port & 1) != 0;
        }
    };
    struct Walk;

    bool is_free(int slave, unsigned port) const noexcept;
    bool is_linked(std::size_t slave, unsigned port) const noexcept;
    void update_links(std::size_t slave) noexcept;
    void update_port(std::size_t slave, unsigned port) noexcept;
    Connection& end_of(End end) noexcept { return ends_[static_cast<std::size_t>(end)]; }
    bool disturb(Walk&, int slave, unsigned port) noexcept;
    bool arrive(Walk&, int slave, unsigned port) noexcept;
    bool pass_unit(Walk&, std::size_t slave) noexcept;
    int exit_of(Walk&, std::size_t slave, unsigned port) noexcept;
    int next_open(Walk&, std::size_t slave, unsigned port) noexcept;
    void walk(Walk&, Connection from) noexcept;
    void follow(const Way&, Walk&) noexcept;
    void find_ways() noexcept;
    void find_way(Connection from, Way&) const noexcept;

    std::vector<Node> nodes_;
    std::deque<FrameInterest> interests_;  ///< of the nodes, close together; they stay in place
    std::array<Connection, 2> ends_;
    std::array<Way, 2> ways_;  ///< from each end
    bool ways_are_known_ = false;
    std::uint32_t speed_ = 100;
    std::uint64_t number_ = 0;
    struct Disturbed {
        LineDisturbance what;
        std::uint64_t seen = 0;
        std::uint64_t hits = 0;
    };
    std::array<Disturbed, max_disturbances> disturbances_;
    std::size_t disturbance_count_ = 0;
    std::array<DatagramView, 128> datagrams_;

    void take_commands(std::int64_t now_ns) noexcept;
    static constexpr std::size_t max_commands = 64;
    std::array<LineCommand, max_commands> commands_;
    std::atomic<std::size_t> posted_{0};  ///< written by the poster
    std::atomic<std::size_t> taken_{0};  ///< written by the thread of process()
};

}  // namespace hal::ethercat::esc
