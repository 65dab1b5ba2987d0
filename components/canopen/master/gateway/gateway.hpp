// SPDX-License-Identifier: MIT
// The text gateway of CiA 309-3: clients send commands as text lines, the gateway executes them on
// CANopen networks. It owns neither bus, socket nor clock. It allocates memory, so it is for
// programs without a cycle; all calls are [setup] and belong to one thread.
//
//     Gateway gateway(1);
//     const int client = gateway.connect();
//     ... gateway.receive(client, bytes, now); gateway.handle(1, frame, now); gateway.poll(now);
//     ... send gateway.output(client) to the client, gateway.out(1) to the bus ...
#pragma once

#include <array>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/master/network.hpp"
#include "gateway_clients.hpp"
#include "gateway_command.hpp"
#include "gateway_lss.hpp"
#include "gateway_own_node.hpp"
#include "gateway_pdo.hpp"

namespace hal::canopen::gateway {

/// The gateway: nets count from 1, clients are numbers from connect().
class Gateway {
public:
    static constexpr std::size_t max_line = Clients::max_line;
    static constexpr std::size_t max_output = 32 << 20;
    static constexpr std::size_t max_pending = Clients::max_pending;

    /// Creates a gateway with `nets` networks. A single net is the default of every client.
    explicit Gateway(unsigned nets, Identity identity = {});
    ~Gateway();

    /// Sets the bit rate of a bus for the command `init`: an index of CiA 305, 9 is automatic.
    /// Returns false if it is not available.
    std::function<bool(unsigned net, std::uint32_t bit_rate_index)> initialise =
        [](unsigned, std::uint32_t) { return true; };
    /// Stores the settings for the command `store`, as commands for configure(). Returns false if
    /// there is no storage.
    std::function<bool(const std::string& commands)> keep = [](const std::string&) {
        return false;
    };
    /// Executes stored settings.
    void configure(std::string_view commands, Time now);

    /// Adds a client and returns its number.
    int connect();
    /// Removes a client and cancels its pending commands.
    void disconnect(int client);
    /// Processes bytes from a client, complete lines or parts.
    void receive(int client, std::string_view bytes, Time now);
    /// Returns the output for a client; the caller removes what it sent. A client whose output
    /// exceeds max_output does not read and should be disconnected.
    std::string& output(int client) { return clients_.output(client); }
    /// Returns true when all commands of a client are done and the caller has sent the output.
    bool is_served(int client) const { return clients_.is_served(client); }

    /// Returns the transmit queue of a net.
    FrameQueue& out(unsigned net) { return nets_[net - 1]->out; }
    /// Processes a received frame.
    void handle(unsigned net, const Frame&, Time now);
    /// Continues pending commands and checks timeouts.
    void poll(Time now);
    /// Returns true if no command is pending.
    bool idle() const { return pending_.empty(); }

private:
    struct Pending;
    struct Net final : DeviceEvents {
        Net(Gateway& gateway, unsigned number);
        void on_node(std::uint8_t node, NodeEvent, NmtState, Time) noexcept override;
        void on_emergency(std::uint8_t node, const Emergency&) noexcept override;

        Gateway& gateway;
        const unsigned number;
        FrameQueue out{4096};
        Network network;
        LssMaster lss;
        Pdos pdos;
        OwnNode own;
        Time command_timeout = 0;
        Time sdo_timeout = 500 * millisecond;
        std::size_t command_size = 1 << 20;
        bool block = false;  ///< SDO block transfer
        bool boot_up = true;  ///< reports boot-up messages
        std::array<bool, 128> watches = {};  ///< nodes with error control
        const Pending* lss_owner = nullptr;  ///< the command that uses the LSS master
    };
    /// A command without a response yet.
    struct Pending {
        int client = 0;
        unsigned net = 0;
        std::uint8_t node = 0;
        Command command = {};
        SdoRequest request = {};
        std::unique_ptr<std::uint8_t[]> buffer = {};  ///< of a read
        Time since = 0;
        Time limit = 0;
        LssJob lss = {};
    };

    /// Net and node that a command is for.
    struct Address {
        Net& net;
        std::uint8_t node = 0;
    };
    void execute_line(int client, std::string_view text, Time now);
    void execute(int client, Command&&, Time now);
    bool execute_in_gateway(int client, const Command&);
    Error find_address(int client, const Command&, unsigned& net, std::uint8_t& node);
    void help(int client, const Command&);
    void set_default_node(int client, const Command&, const Net&);

    void network_command(int client, const Command&, const Address&);
    void error_control(int client, const Command&, const Address&, Time now);
    void setting(int client, const Command&, Net&, Time now);
    static void apply_setting(Verb, std::uint32_t value, Net&, Time now);
    void initialise_net(int client, const Command&, Net&, Time now);
    void save(int client, const Command&, const std::string& settings);
    void info_version(int client, const Command&);
    void pdo_command(int client, const Command&, Net&);
    void read_pdo(int client, Command&&, Net&, Time now);
    void start_transfer(int client, Command&&, const Address&, Time now);
    void start_lss(int client, Command&&, Net&, Time now);
    bool enqueue(int client, Command&&, const Address&, Time now);
    /// Returns true once the command has its response.
    bool proceed(Pending&, Time now);
    bool proceed_transfer(Pending&);
    bool proceed_pdo(Pending&, Time now);
    bool proceed_lss(Pending&, Time now);
    void cancel(Pending&);
    void reset(Net&, Time now);
    std::string commands() const;
    void answer(int client, const Command& c, const std::string& text) {
        clients_.answer(client, c.sequence, text);
    }
    void reject(int client, const Command& c, Error error, const std::string& why = "") {
        clients_.reject(client, c.sequence, error, why);
    }

    const Identity identity_;
    std::vector<std::unique_ptr<Net>> nets_;
    Clients clients_;
    std::list<Pending> pending_;
};

}  // namespace hal::canopen::gateway
