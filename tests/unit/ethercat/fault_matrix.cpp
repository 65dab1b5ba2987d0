// SPDX-License-Identifier: MIT
#include "tests/unit/ethercat/fault_matrix.hpp"

#include "ethercat/config/event_texts.hpp"

namespace fault_matrix {

namespace {

constexpr const char* description =
    "servo\nservo axes=2\nservo\ndigital_out bits=8\ndigital_in bits=8\n";
constexpr const char* configuration =
    "[bus]\ncycle = 1ms\n"
    "[type drive]\ndevice = cia402\nvendor = 0x00ffffff\noutputs = 6040 6060 607A 60FF\ninputs = "
    "6041 6061 6064\ndc = sync0 250us\nsdo "
    "60C2:1 = 1\n"
    "[slave 0 x]\ntype = drive\n[slave 1 y]\ntype = drive\n[slave 2 z]\ntype = drive\n"
    "[slave 3 out]\nvendor = 0x00ffffff\noutputs = 7000:1 bit 7000:2 bit 7000:3 bit 7000:4 bit "
    "7000:5 bit 7000:6 bit 7000:7 bit 7000:8 "
    "bit\n"
    "inputs = none\noutputs.sync-manager = 0\n"
    "[slave 4 in]\nvendor = 0x00ffffff\ninputs = 6000:1 bit 6000:2 bit 6000:3 bit 6000:4 bit "
    "6000:5 bit 6000:6 bit 6000:7 bit 6000:8 bit\n"
    "outputs = none\ninputs.sync-manager = 0\n";

// a jump after the last look at the clock; frames fail meanwhile
constexpr std::int64_t tolerable_jump_ns = 30'000'000;
// twice what the master tolerates: clocks are compared at another moment
constexpr std::int64_t tolerable_ns = 20'000;

}  // namespace

std::string LastEvents::text(const master::Setup& setup) const {
    std::string s;
    for (std::uint64_t n = count_ > events_.size() ? count_ - events_.size() : 0; n < count_; ++n) {
        const Record& r = events_[n % events_.size()];
        s += "\n  " + std::to_string(static_cast<int>(r.event)) + " " +
             config::event_text({r.event, r.slave, r.first, r.second}, setup, "sim:line");
    }
    return s;
}

Machine::Machine() {
    devices = devices::make_line(devices::read_line(description));
    const double drifts[] = {40, -60, 90, 0, 0};
    for (std::size_t n = 0; n < devices.size(); ++n) {
        line.add({.controller = {.dc = devices[n].dc,
                                 .drift_ppm = drifts[n],
                                 .clock_start_ns = 1'000'000'007LL * static_cast<std::int64_t>(n)},
                  .sii = devices[n].sii,
                  .application = devices[n].firmware.get()});
    }
    const config::ReadResult read = config::read(configuration, "line.ethercat");
    EXPECT_EQ(config::to_string(read, "line.ethercat"), "");
    setup = read.buses.at(0).setup;
    line.power_on(0);
    mailboxes = std::make_unique<master::Mailboxes>(setup.slaves.size() + 64);
    client = std::make_unique<master::CoeClient>(*mailboxes);
    master = std::make_unique<master::Master>(setup, port.address(), events, *client);
    io_data = master->data(io, 0);
    master->attach(port);
}

Machine::~Machine() { EXPECT_LT(master->max_task_share(), 0.75); }

std::int64_t Machine::deviation_ns(std::size_t drive) {
    const std::size_t reference = events.reference < drives ? events.reference : 0;
    return line.controller(drive).clock().system_time(now_ns) -
           line.controller(reference).clock().system_time(now_ns);
}

void Machine::cycle() {
    now_ns += 1'000'000;
    line.advance(now_ns);
    master->receive(now_ns);
    io_data[0] = static_cast<std::uint8_t>(now_ns / 1'000'000 | 1);  // never 0
    master->transmit(now_ns);
    for (std::size_t n = 0; n < drives && wrong.empty(); ++n) {
        const bool op = line.controller(n).powered() && devices[n].firmware->state() == State::op;
        const bool entered = op && !was_op_[n];
        was_op_[n] = op;
        if (!entered) continue;
        if (!line.controller(n).sync().active) {
            wrong = "drive " + std::to_string(n) + " is in OP without SYNC0";
        }
        const bool has_reference =
            events.reference < drives && line.controller(events.reference).powered();
        if (const std::int64_t d = deviation_ns(n);
            has_reference && now_ns > jumped_ns + tolerable_jump_ns && std::abs(d) > tolerable_ns) {
            wrong = "drive " + std::to_string(n) + " entered OP " + std::to_string(d) +
                    " ns beside the reference clock";
        }
    }
    auto& out = static_cast<devices::IoBehaviour&>(devices[io].firmware->behaviour());
    if (wrong.empty() && line.controller(io).powered() &&
        devices[io].firmware->state() != State::op) {
        for (unsigned n = 0; n < out.channels(); ++n) {
            if (out.output(n) != 0) {
                wrong = "an output is on outside OP";
            }
        }
    }
}

unsigned Machine::recover(unsigned max) {
    const auto arrives = [&] {
        auto& out = static_cast<devices::IoBehaviour&>(devices[io].firmware->behaviour());
        if (!master->status().operational ||
            master->domain(0).state != master::WkcState::complete || out.output(0) == 0) {
            return false;
        }
        for (const devices::Device& d : devices) {
            if (d.firmware->state() != State::op) return false;
        }
        return true;
    };
    unsigned in_a_row = 0;
    for (unsigned n = 1; n <= max; ++n) {
        cycle();
        in_a_row = arrives() ? in_a_row + 1 : 0;
        if (in_a_row == 50) return n;
    }
    return 0;
}

void Machine::repair() {
    port.fault = Fault::none;
    line.calm();
    for (std::size_t n = 0; n < slaves; ++n) {
        line.set_cable(n, 0, true);
        if (!line.controller(n).powered()) {
            line.set_power(n, true, now_ns);
        }
    }
}

}  // namespace fault_matrix
