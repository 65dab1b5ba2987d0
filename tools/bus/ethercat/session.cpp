// SPDX-License-Identifier: MIT
#include "bus/ethercat/session.hpp"

#include <fmt/core.h>

#include "bus/transfer_progress.hpp"
#include "cli/output.hpp"
#include "hal/clock.hpp"

namespace hal::tools {

using namespace ethercat;
using master::BusSlave;

namespace {

constexpr std::int64_t cycle_ns = 1'000'000;
constexpr std::int64_t second = 1'000'000'000;
constexpr std::uint16_t max_slaves = 1024;

}  // namespace

EthercatSession::EthercatSession()
    : mailboxes_(max_slaves),
      server_(mailboxes_, [this](std::uint16_t n) { return find(n); }),
      requests_(server_.open()) {}

EthercatSession::~EthercatSession() {
    server_.stop();
    channel_.stop();
    master_.reset();
}

BusSlave* EthercatSession::find(std::uint16_t number) {
    return (gateway_.is_open() || master_) && number < size() ? &slave(number) : nullptr;
}

bool EthercatSession::open(const EthercatOptions& options, bool objects) {
    if (options.emulate.empty() && !options.words.empty() &&
        GatewayLine::is_gateway(options.words.front())) {
        if (!objects) {
            fail(options,
                 "this command needs the bus itself; through a gateway there are upload, "
                 "download and sdos");

            return false;
        }
        arguments_.assign(options.words.begin() + 1, options.words.end());
        const std::string problem = gateway_.open(options.words.front());
        return problem.empty() || (fail(options, problem), false);
    }
    if (!access_.open(options, true)) return false;
    const std::string& address = access_.address();
    ethernet::Port* port = &access_.port();
    master::Setup setup;
    setup.cycle_ns = cycle_ns;
    // this program and an emulated line share the processor with others
    setup.frame_timeout_ns = 20'000'000;
    setup.max_slaves = max_slaves;
    setup.frame_bytes = ethernet::header_bytes + port->statistics().mtu;
    master_ = std::make_unique<master::Master>(setup, port->address(),
                                               static_cast<master::Events&>(*this), server_.coe());
    master_->add(channel_);
    for (std::size_t n = 0; n < server_.workers(); ++n) {
        master_->add(server_.channel(n));
    }
    master_->attach(*port);
    if (!until([&] { return master_->status().scanned && master_->found() != 0; }, 2 * second)) {
        const auto& status = master_->status();
        if (status.responding == 0) {
            fail(options, fmt::format("no slave responds on {}; check cable and supply, and "
                                      "that it is the right interface",
                                      address));

            return false;
        }
        fail(options, fmt::format("{} slaves respond on {}, but they could not be "
                                  "identified within 2 s; check the cables",
                                  status.responding, address));

        return false;
    }
    until([&] {
        for (std::size_t n = 0; n < size(); ++n) {
            if (!slave(n).al_failed && slave(n).state != State::preop) return false;
        }
        return true;
    }, 5 * second);
    return true;
}

void EthercatSession::cycle() {
    if (gateway_.is_open()) {
        gateway_.receive();
        server_.step(monotonic_ns());
        for (std::size_t n = 0; n < server_.workers(); ++n) {
            gateway_.serve(server_.channel(n), monotonic_ns());
        }
        return;
    }
    access_.pass(cycle_ns);
    const std::int64_t now_ns = access_.now_ns();
    master_->receive(now_ns);
    channel_.set_now(now_ns);
    server_.step(now_ns);
    master_->transmit(now_ns);
}

bool EthercatSession::until(const std::function<bool()>& done, std::int64_t timeout_ns) {
    const auto now_ns = [this] { return gateway_.is_open() ? monotonic_ns() : access_.now_ns(); };
    for (const std::int64_t end = now_ns() + timeout_ns; !done(); cycle()) {
        if (now_ns() >= end) return false;
    }
    return true;
}

BusSlave* EthercatSession::chosen(const EthercatPositionOptions& options) {
    if (!until([&] { return size() != 0; }, 2 * second)) {  // a line that paused is scanned again
        fail(options, "no slave answers; check the cable and the supply of the first slave");

        return nullptr;
    }
    const auto position = chosen_position(options, size());
    return position ? &slave(*position) : nullptr;
}

bool EthercatSession::set_boot(const EthercatOptions& options, BusSlave& s, bool boot) {
    if (boot && !s.bootstrap.usable()) {
        fail(options, fmt::format("slave {}: its EEPROM has no mailbox for BOOT; it takes "
                                  "its firmware in PRE-OP (without --boot), "
                                  "or by a tool of its maker",
                                  s.position));

        return false;
    }
    const State target = boot ? State::boot : State::preop;
    if (!until([&] { return master_->idle(s); }, 10 * second)) {
        fail(options, fmt::format("slave {}: its start-up does not end; see: hal ethercat states",
                                  s.position));

        return false;
    }
    master_->set_boot(s, boot);
    const auto reached = [&] { return s.state == target && !s.al_failed; };
    // a slave that was just flashed may start anew
    if (until([&] { return reached() || (boot && s.al_failed); }, (boot ? 10 : 60) * second) &&
        reached()) {
        return true;
    }
    fail(options,
         fmt::format("slave {}: {} not reached, it is in {}{}; see: hal ethercat states",
                     s.position, to_string(target), to_string(s.state),
                     s.al_failed ? fmt::format(", AL status code 0x{:04X}", s.al_code) : ""));

    return false;
}

bool EthercatSession::run(master::MailboxRequest& request) {
    if (!requests_.submit(request)) return false;
    const auto moved = [&] {
        return request.progress == nullptr
                   ? 0U
                   : request.progress->bytes + (std::uint32_t{request.progress->done} << 16);
    };
    const master::BusSlave* const slave = find(request.slave);
    TransferProgress shown(
        fmt::format("slave {}, file '{}'", slave != nullptr ? slave->position : 0, request.name));
    const std::size_t total =
        request.kind == master::MailboxRequest::Kind::foe_write ? request.data.size() : 0;
    const auto finished = [&] {
        if (request.progress != nullptr) {
            shown.update(request.progress->bytes, total);
        }
        return requests_.finished(request);
    };
    std::uint32_t before = 0;
    do {  // a file may take minutes, as long as it goes on
        before = moved();
        if (until(finished, 60 * second)) return true;
    } while (moved() != before);
    server_.stop();  // the request is on the caller's stack
    return false;
}

}  // namespace hal::tools
