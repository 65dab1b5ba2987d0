// SPDX-License-Identifier: MIT
// A bus as used by one command: the master engine without a configuration, its cycle run in this
// thread while a request waits. The slaves are scanned and brought to PRE-OP. Everything here is
// [setup]; everything has a timeout.
//
//     EthercatSession session;
//     if (!session.open(options)) return 1;                                // the reason is printed
//     master::MailboxRequest request; ...
//     if (!session.run(request)) ...
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/ethercat/access.hpp"
#include "bus/ethercat/gateway_line.hpp"
#include "ethercat/master/master.hpp"
#include "ethercat/master/request_queue.hpp"

namespace hal::tools {

class EthercatSession : private ethercat::master::Events {
public:
    EthercatSession();
    ~EthercatSession() override;

    /// Opens the bus that the options name and brings its slaves to PRE-OP. With `objects`, the
    /// address may be that of the mailbox gateway of a running master, whose slaves stay as they
    /// are. Returns false after printing the reason.
    bool open(const EthercatOptions&, bool objects = false);
    /// Returns the positional arguments behind the address.
    const std::vector<std::string>& arguments() const {
        return gateway_.is_open() ? arguments_ : access_.arguments();
    }
    std::size_t size() const { return gateway_.is_open() ? gateway_.size() : master_->found(); }
    ethercat::master::BusSlave& slave(std::size_t position) {
        return gateway_.is_open() ? gateway_.slave(position) : master_->found(position);
    }
    /// Returns whether the gateway ended the connection.
    bool gateway_lost() const { return gateway_.is_closed(); }
    /// Returns the slave that --position names, or the only one; nullptr after printing the reason.
    ethercat::master::BusSlave* chosen(const EthercatPositionOptions&);

    /// Takes a slave to BOOT, or back to PRE-OP. Returns false after printing the reason.
    bool set_boot(const EthercatOptions&, ethercat::master::BusSlave&, bool boot);
    /// Serves a mailbox request; false: not finished within 60 s, for a file 60 s without progress.
    /// Its result is in the request.
    bool run(ethercat::master::MailboxRequest&);

private:
    void on_event(ethercat::master::Event, std::uint32_t, std::int64_t,
                  std::int64_t) noexcept override {}
    void cycle();
    bool until(const std::function<bool()>& done, std::int64_t timeout_ns);

    ethercat::master::BusSlave* find(std::uint16_t number);

    GatewayLine gateway_;
    std::vector<std::string> arguments_;
    EthercatAccess access_;
    ethercat::master::Mailboxes mailboxes_;
    ethercat::master::RequestServer server_;
    ethercat::master::RequestPort& requests_;
    ethercat::master::Channel channel_;
    std::unique_ptr<ethercat::master::Master> master_;
};

}  // namespace hal::tools
