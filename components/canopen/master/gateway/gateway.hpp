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

#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/master/network.hpp"
#include "canopen/protocol/dictionary.hpp"
#include "gateway_command.hpp"
#include "gateway_pdo.hpp"

namespace hal::canopen::gateway {

/// Returns the response to an SDO abort: `ERROR:0x06020000 #object does not exist …`.
std::string abort_text(Abort);
/// The identity of a gateway in `info version`, and in its own node as 1018h, 1008h (product name)
/// and 2000h (the three names).
struct Identity {
    static constexpr std::size_t most_name = 200;  ///< bytes of a name
    /// as registered with CiA; 0: none. revision: major << 16 | minor
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    std::uint32_t serial = 0;
    std::string vendor_name = "Halcyon";
    std::string product_name = "Halcyon CiA 309-3 gateway";

    std::string order_code = "";
};
/// Returns the objects of the own node of a gateway.
Description own_objects(const Identity&);

/// The gateway: nets count from 1, clients are numbers from connect().
class Gateway {
public:
    static constexpr std::size_t most_line = 4 << 20;

public:
    static constexpr std::size_t most_output = 32 << 20;

public:
    static constexpr std::size_t most_pending = 64;

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
    /// exceeds most_output does not read and should be disconnected.
    std::string& output(int client) { return clients_[static_cast<std::size_t>(client)].out; }

    /// Returns true when all commands of a client are done and the caller has sent the output.
    bool is_served(int client) const {
        const Client& c = clients_[static_cast<std::size_t>(client)];
        return c.pending == 0 && c.out.empty();
    }

    /// Returns the transmit queue of a net.
    FrameQueue& out(unsigned net) { return nets_[net - 1]->out; }
    /// Processes a received frame.
    void handle(unsigned net, const Frame&, Time now);
    /// Continues pending commands and checks timeouts.
    void poll(Time now);
    /// Returns true if no command is pending.
    bool idle() const { return pending_.empty(); }

private:
    struct Client {
        /// skips: discards the rest of a line that was too long
        bool connected = false;
        bool skips = false;
        std::string in, out;
        unsigned net = 0;
        unsigned node = 0;  ///< defaults; 0: none
        std::size_t pending = 0;
    };
    struct Pending;
    struct Net final : Events {
        Net(Gateway& gateway, unsigned number);
        void on_node(std::uint8_t node, NodeEvent, NmtState, Time) noexcept override;
        void on_emergency(std::uint8_t node, const Emergency&) noexcept override;

        Gateway& gateway;
        const unsigned number;
        FrameQueue out{4096};
        Network network;
        LssMaster lss;
        Pdos pdos;
        std::uint8_t id = 0;  ///< own node; 0: none
        /// its objects, for clients of this gateway only, not for the bus
        Dictionary own;
        Time heartbeat = 0;
        Time next_heartbeat = 0;
        Time command_timeout = 0;
        Time sdo_timeout = 500 * millisecond;
        std::size_t command_size = 1 << 20;
        bool block = false, boot_up = true, watches[128] = {};
        const Pending* lss_owner = nullptr;  ///< the command that uses the LSS master
    };
    /// A command without a response yet.
    struct Pending {
        int client = 0;
        unsigned net = 0;
        std::uint8_t node = 0;
        Command command = {};
        SdoRequest request = {};
        std::unique_ptr<std::uint8_t[]> room = {};
        Time since = 0;
        Time limit = 0;
        bool lss_started = false;
        unsigned part = 0;  ///< of lss_inquire_addr
        std::string text = {};
    };

    void line(int client, std::string_view text, Time now);
    void execute(int client, Command&&, Time now);
    bool address(Client&, const Command&, int client, bool node, unsigned& net_number,
                 std::uint8_t& node_id);
    void answer(int client, std::uint32_t sequence, const std::string& text);
    void reject(int client, std::uint32_t sequence, Error, const std::string& why = "");
    void send_event(const std::string& event);

    void network_command(int client, const Command&, Net&, std::uint8_t node, Time now);
    void error_control(int client, const Command&, Net&, std::uint8_t node, Time now);
    void setting(int client, const Command&, Net&, Time now);
    void pdo_command(int client, Command&&, Net&, Time now);
    void start_transfer(int client, Command&&, Net&, std::uint8_t node, Time now);
    void start_lss(int client, Command&&, Net&, Time now);
    void own_transfer(int client, const Command&, Net&, Time now);
    bool enqueue(int client, Command&&, Net&, std::uint8_t node, Time now);
    /// Returns true once the command has its response.
    bool proceed(Pending&, Time now);
    bool proceed_transfer(Pending&, Time now);
    bool proceed_lss(Pending&, Time now);
    bool begin_lss(Pending&, Net&, Time now);
    void cancel(Pending&);
    void reset(Net&, Time now);
    std::string commands() const;

    const Identity identity_;
    std::vector<std::unique_ptr<Net>> nets_;
    std::vector<Client> clients_;
    std::list<Pending> pending_;
};

}  // namespace hal::canopen::gateway
