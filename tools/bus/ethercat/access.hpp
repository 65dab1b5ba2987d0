// SPDX-License-Identifier: MIT
// The bus that a command names: a port, or an emulated line in this process with a clock of its
// own. Everything here is [setup].
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/ethercat/options.hpp"
#include "ethercat/devices/registry.hpp"
#include "ethercat/esc/responder.hpp"
#include "link/ethernet.hpp"

namespace hal::tools {

class EthercatAccess {
public:
    /// Opens the bus. With `alone`, another active master on it is an error. Returns false after
    /// printing the reason.
    bool open(const EthercatOptions&, bool alone);
    /// Returns the positional arguments behind the address.
    const std::vector<std::string>& arguments() const { return arguments_; }
    const std::string& address() const { return address_; }
    bool emulated() const { return line_.has_value(); }
    ethernet::Port& port() { return *port_; }
    std::int64_t now_ns() const { return now_ns_; }
    /// Lets a time pass.
    void pass(std::int64_t ns);
    /// Waits for the next frame, at most until a time on the clock of now_ns(); nullopt: none.
    std::optional<std::vector<std::uint8_t>> receive(std::int64_t until_ns);

private:
    bool emulate(const EthercatOptions&);

    std::vector<std::string> arguments_;
    std::string address_;
    std::vector<ethercat::devices::Device> devices_;
    std::unique_ptr<ethernet::Port> line_port_, port_;
    std::optional<ethercat::esc::Line> line_;
    std::unique_ptr<ethercat::esc::LineOnSegments> connection_;
    std::int64_t now_ns_ = 0;
};

/// Returns the position that --position names among `slaves` slaves, or that of the only one;
/// nullopt after printing the reason.
std::optional<std::size_t> chosen_position(const EthercatPositionOptions&, std::size_t slaves);

}  // namespace hal::tools
