// SPDX-License-Identifier: MIT
#include "bus/ethercat/session.hpp"

#include <filesystem>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "ethercat/master/sii_access.hpp"
#include "hal/clock.hpp"

namespace hal::tools {

using namespace ethercat;
using master::Answer;
using master::BusSlave;
using master::Channel;
using master::Task;

namespace {

constexpr std::int64_t cycle_ns = 1'000'000, second = 1'000'000'000;
constexpr std::uint16_t most_slaves = 1024;
constexpr const char* emulated_segment = "sim:hal-ethercat";

Task<> read_registers(Channel& c, std::uint16_t station, std::uint16_t address, std::uint16_t length, Answer& answer) noexcept {
    answer = co_await c.exchange(Command::fprd, at_station(station, address), length);
}

Task<> read_sii(Channel& c, std::uint16_t station, std::uint32_t word, master::SiiData& data) noexcept {
    data = co_await master::sii_read(c, station, word);
}

}  // namespace

EthercatSession::EthercatSession()
    : mailboxes_(most_slaves),
      server_(mailboxes_, [this](std::uint16_t n) { return master_ && n < master_->found() ? &master_->found(n) : nullptr; }),
      requests_(server_.open()) {}

EthercatSession::~EthercatSession() {
    server_.stop();
    channel_.stop();
    master_.reset();
    connection_.reset();
}

bool EthercatSession::emulate(const EthercatOptions& options) {
    std::string text = options.emulate;
    if (std::filesystem::is_regular_file(text)) {
        if (!read_file(options.emulate, text)) return fail(options, text), false;
    } else {
        for (char& c : text)
            if (c == ',') c = '\n';
    }
    const devices::LineDescription description = devices::read_line(text);
    if (!description.messages.empty()) {
        const auto& message = description.messages.front();
        return fail(options, fmt::format("--emulate: {}; {}", message.sentence, message.help)), false;
    }
    devices_ = devices::make_line(description);
    ethernet::Options how;
    how.promiscuous = true;
    auto opened = ethernet::open(emulated_segment, how);
    if (!opened) return fail(options, opened.problem), false;
    line_port_ = std::move(opened.port);
    line_.emplace();
    for (devices::Device& d : devices_) line_->add({.controller = {.dc = d.dc}, .sii = d.sii, .application = d.firmware.get()});
    line_->power_on(0);
    connection_ = std::make_unique<esc::LineOnSegments>(*line_, *line_port_);
    return true;
}

bool EthercatSession::open(const EthercatOptions& options) {
    arguments_ = options.words;
    std::string address = emulated_segment;
    if (!options.emulate.empty()) {
        if (!emulate(options)) return false;
    } else {
        if (arguments_.empty()) return fail(options, "missing address: type eth:INTERFACE, or --emulate \"coupler, servo\" to try it without hardware"), false;
        address = arguments_.front();
        arguments_.erase(arguments_.begin());
        if (ethernet::describe(address).in_memory)
            return fail(options, fmt::format("'{}' is a segment in memory, which belongs to another process; type eth:INTERFACE, or --emulate "
                                             "\"coupler, servo\" for an emulated line", address)), false;
    }
    ethernet::Options how;
    how.types = {ethertype};
    auto opened = ethernet::open(address, how);
    if (!opened) return fail(options, opened.problem), false;
    port_ = std::move(opened.port);
    if (!line_) {
        now_ns_ = monotonic_ns();
        if (!port_->statistics().up) return fail(options, fmt::format("{} has no link; check the cable and the supply of the first slave", address)), false;
        // The scan takes all slaves to INIT: not while another master exchanges data with them.
        const std::int64_t listen_until = now_ns_ + second / 5;
        while (monotonic_ns() < listen_until) {
            port_->wait(listen_until);
            if (port_->receive(monotonic_ns()))
                return fail(options, fmt::format("another EtherCAT master is active on {}; stop it first: a scan takes all slaves to INIT", address)), false;
        }
        now_ns_ = monotonic_ns();
    }
    master::Setup setup;
    setup.cycle_ns = cycle_ns;
    setup.most_slaves = most_slaves;
    master_ = std::make_unique<master::Master>(setup, port_->address(), static_cast<master::Events&>(*this), server_.coe());
    master_->add(channel_);
    for (std::size_t n = 0; n < server_.workers(); ++n) master_->add(server_.channel(n));
    master_->attach(*port_);
    if (!until([&] { return master_->status().scanned; }, 2 * second)) {
        const auto& status = master_->status();
        if (status.responding == 0) return fail(options, fmt::format("no slave responds on {}; check cable and supply, and that it is the right interface", address)), false;
        return fail(options, fmt::format("{} slaves respond on {}, but they could not be identified within 2 s; check the cables", status.responding, address)), false;
    }
    until([&] {
        for (std::size_t n = 0; n < size(); ++n)
            if (!slave(n).al_failed && slave(n).state != State::preop) return false;
        return true;
    }, 5 * second);
    return true;
}

void EthercatSession::cycle() {
    now_ns_ += cycle_ns;
    if (line_) line_port_->receive(now_ns_);
    else
        while (monotonic_ns() < now_ns_) port_->wait(now_ns_);
    master_->receive(now_ns_);
    channel_.set_now(now_ns_);
    server_.step(now_ns_);
    master_->transmit(now_ns_);
}

bool EthercatSession::until(const std::function<bool()>& done, std::int64_t timeout_ns) {
    for (const std::int64_t end = now_ns_ + timeout_ns; !done(); cycle())
        if (now_ns_ >= end) return false;
    return true;
}

BusSlave* EthercatSession::chosen(const EthercatSlaveOptions& options) {
    if (options.position < 0 && size() != 1)
        return fail(options, fmt::format("{} slaves on the bus; choose one with -p 0 … -p {}", size(), size() - 1)), nullptr;
    const auto position = static_cast<std::size_t>(options.position < 0 ? 0 : options.position);
    if (position >= size())
        return fail(options, fmt::format("no slave at position {}; the bus has {}, the last one at position {}", position, size(), size() - 1)), nullptr;
    return &slave(position);
}

bool EthercatSession::run(master::MailboxRequest& request) {
    if (!requests_.submit(request)) return false;
    if (until([&] { return requests_.finished(request); }, 60 * second)) return true;
    server_.stop();  // the request is on the caller's stack
    return false;
}

std::optional<std::vector<std::uint8_t>> EthercatSession::registers(const BusSlave& s, std::uint16_t address, std::uint16_t length) {
    Answer answer;
    std::fill_n(channel_.data(), length, std::uint8_t{0});
    channel_.start([&] { return read_registers(channel_, s.station, address, length, answer); });
    const bool done = until([&] { return !channel_.busy(); }, second);
    channel_.stop();
    if (!done || answer.wkc != 1) return std::nullopt;
    return std::vector<std::uint8_t>(channel_.data(), channel_.data() + length);
}

std::optional<std::vector<std::uint8_t>> EthercatSession::sii(const BusSlave& s) {
    std::vector<std::uint8_t> bytes;
    while (bytes.size() < ethercat::sii::bytes_needed(bytes)) {
        master::SiiData data;
        channel_.start([&] { return read_sii(channel_, s.station, static_cast<std::uint32_t>(bytes.size() / 2), data); });
        const bool done = until([&] { return !channel_.busy(); }, second);
        channel_.stop();
        if (!done || !data.ok) return std::nullopt;
        for (const std::uint16_t word : data.words) bytes.push_back(static_cast<std::uint8_t>(word)), bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    }
    return bytes;
}

}  // namespace hal::tools
