// SPDX-License-Identifier: MIT
#include "bus/ethercat/access.hpp"

#include <filesystem>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "ethercat/config/event_texts.hpp"
#include "ethercat/devices/device_words.hpp"
#include "ethercat/wire/frames.hpp"
#include "hal/clock.hpp"

namespace hal::tools {

namespace {

constexpr std::int64_t listening_ns = 200'000'000;
constexpr std::int64_t emulated_step_ns = 100'000;
constexpr const char* emulated_segment = "sim:hal-ethercat";

}  // namespace

bool EthercatAccess::emulate(const EthercatOptions& options) {
    std::string text = options.emulate;
    const bool in_file = std::filesystem::is_regular_file(text);
    if (in_file) {
        if (!read_file(options.emulate, text)) {
            fail(options, text);
            return false;
        }
    } else {
        text = ethercat::devices::device_lines(text);
    }
    const auto description = ethercat::devices::read_line(
        text, in_file ? ethercat::devices::beside(options.emulate) : ethercat::devices::FindFile());
    bool good = true;
    for (const auto& m : description.messages) {
        const bool is_error = m.severity == Severity::error;
        std::string location = "--emulate";
        if (in_file) {
            location = fmt::format("{}:{}:{}", options.emulate, m.at.line, m.at.column);
        } else if (m.at.line != 0) {
            location = fmt::format("--emulate, device {}", m.at.line);
        }
        fail(options, fmt::format("{}: {}{}{}{}", location, is_error ? "" : "warning: ", m.sentence,
                                  m.help.empty() ? "" : "; ", m.help));
        good = good && !is_error;
    }
    if (!good) return false;
    devices_ = ethercat::devices::make_line(description);
    ethernet::Options how;
    how.promiscuous = true;
    auto opened = ethernet::open(emulated_segment, how);
    if (!opened) {
        fail(options, opened.problem);
        return false;
    }
    line_port_ = std::move(opened.port);
    line_.emplace();
    for (auto& d : devices_) {
        line_->add({.controller = {.dc = d.dc}, .sii = d.sii, .application = d.firmware.get()});
    }
    line_->power_on(0);
    connection_ = std::make_unique<ethercat::esc::LineOnSegments>(*line_, *line_port_);
    return true;
}

bool EthercatAccess::open(const EthercatOptions& options, bool alone) {
    arguments_ = options.words;
    address_ = emulated_segment;
    if (!options.emulate.empty()) {
        if (!emulate(options)) return false;
    } else {
        if (arguments_.empty()) {
            fail(options,
                 "missing address: type eth:INTERFACE, or --emulate \"coupler, servo\" to "
                 "try it without hardware");

            return false;
        }
        address_ = arguments_.front();
        arguments_.erase(arguments_.begin());
        if (address_.starts_with("gateway:")) {
            fail(options,
                 "this command needs the bus itself; through a gateway there are upload, "
                 "download and sdos");

            return false;
        }
        if (ethernet::describe(address_).in_memory) {
            fail(options, fmt::format("'{}' is a segment in memory, which belongs to "
                                      "another process; type eth:INTERFACE, or "
                                      "--emulate \"coupler, servo\" for an emulated line",
                                      address_));

            return false;
        }
    }
    const ethernet::Description about = ethernet::describe(address_);
    if (about.recorded) {
        fail(options, ethercat::config::recorded_words(address_));
        return false;
    }
    ethernet::Options how;
    how.types = {ethercat::ethertype};
    // an answer ends the wait when it arrives
    how.policy = ethernet::Policy::block;
    auto opened = ethernet::open(address_, how);
    if (!opened) {
        fail(options, opened.problem);
        return false;
    }
    port_ = std::move(opened.port);
    if (emulated()) return true;
    now_ns_ = monotonic_ns();
    if (!port_->statistics().up) {
        fail(options,
             about.datagrams
                 ? ethercat::config::no_link_words(address_)
                 : fmt::format("{} has no link; check the cable and the supply of the first slave",
                               address_));

        return false;
    }
    if (alone && receive(now_ns_ + listening_ns)) {
        fail(options, fmt::format("another EtherCAT master is active on {}, and this "
                                  "command changes states; stop it, or, for objects, use "
                                  "its mailbox gateway: gateway:127.0.0.1 instead of {}",
                                  address_, address_));

        return false;
    }
    return true;
}

void EthercatAccess::pass(std::int64_t ns) {
    now_ns_ += ns;
    if (line_) {
        line_port_->receive(now_ns_);
    } else {
        while (monotonic_ns() < now_ns_) {
            port_->wait(now_ns_);
        }
    }
}

std::optional<std::vector<std::uint8_t>> EthercatAccess::receive(std::int64_t until_ns) {
    for (;;) {
        if (!line_) {
            now_ns_ = monotonic_ns();
        }
        if (const auto arrival = port_->receive(now_ns_)) {
            return std::vector<std::uint8_t>(arrival->bytes.begin(), arrival->bytes.end());
        }
        if (now_ns_ >= until_ns) return std::nullopt;
        if (line_) {
            pass(emulated_step_ns);
        } else {
            port_->wait(until_ns);
        }
    }
}

std::optional<std::size_t> chosen_position(const EthercatPositionOptions& options,
                                           std::size_t slaves) {
    if (options.position < 0 && slaves != 1) {
        fail(options,
             fmt::format("{} slaves on the bus; choose one with -p 0 … -p {}", slaves, slaves - 1));
        return std::nullopt;
    }
    const auto position = static_cast<std::size_t>(std::max(options.position, 0));
    if (position >= slaves) {
        fail(options,
             fmt::format("no slave at position {}; the bus has {}, the last one at position {}",
                         position, slaves, slaves - 1));
        return std::nullopt;
    }
    return position;
}

}  // namespace hal::tools
