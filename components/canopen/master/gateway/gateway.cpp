// SPDX-License-Identifier: MIT
#include "gateway.hpp"

#include <algorithm>
#include <cstdio>

#include "text/characters.hpp"

namespace hal::canopen::gateway {

namespace {

template <class... Arguments>
std::string format_text(const char* form, Arguments... arguments) {
    char text[200];
    std::snprintf(text, sizeof text, form, arguments...);
    return text;
}

std::string upper(const char* text) {
    std::string out = text;
    for (char& c : out) {
        c = c == '-' ? '_' : hal::upper(c);
    }
    return out;
}

NmtCommand nmt_command(Verb verb) {
    switch (verb) {
    case Verb::start: return NmtCommand::start;
    case Verb::stop: return NmtCommand::stop;
    case Verb::preoperational: return NmtCommand::enter_pre_operational;
    case Verb::reset_node: return NmtCommand::reset_node;
    default: return NmtCommand::reset_communication;
    }
}

struct Range {
    std::uint32_t min = 0;
    std::uint32_t max = UINT32_MAX;
    std::string text() const { return std::to_string(min) + " to " + std::to_string(max); }
};

/// Returns the values that a setting may have.
Range range_of(Verb setting) {
    switch (setting) {
    case Verb::set_heartbeat: return {0, 65535};
    case Verb::set_id: return {1, 127};
    case Verb::set_command_size: return {1, 16 << 20};
    case Verb::set_sdo_timeout: return {1, 600'000};
    case Verb::set_sdo_block: return {0, 1};
    default: return {};
    }
}

}  // namespace

Gateway::Net::Net(Gateway& owner, unsigned n)
    : gateway(owner), number(n), network(out, *this), lss(out), pdos(out), own(owner.identity_) {
    for (std::uint8_t node = 1; node <= 127; ++node) {
        network.add(node);
    }
}

void Gateway::Net::on_node(std::uint8_t node, NodeEvent event, NmtState state, Time) noexcept {
    const std::string who = std::to_string(number) + " " + std::to_string(node) + " ";
    switch (event) {
    case NodeEvent::boot_up:
        if (boot_up) {
            gateway.clients_.send_event(who + "BOOT_UP");
        }
        return;
    case NodeEvent::lost: {
        const bool guarded = network.node(node)->guarded();
        const Error what = guarded ? Error::lost_guarding : Error::lost_heartbeat;
        gateway.clients_.send_event(who + "ERROR " + std::to_string(static_cast<unsigned>(what)) +
                                    " #" + to_string(what));
        return;
    }
    case NodeEvent::alive:
    case NodeEvent::changed:
        if (watches[node]) {
            gateway.clients_.send_event(who + upper(canopen::to_string(state)));
        }
        return;
    }
}

void Gateway::Net::on_emergency(std::uint8_t node, const Emergency& e) noexcept {
    std::string text =
        format_text("%u %u EMCY 0x%04X 0x%02X", number, node, e.code, e.error_register);
    for (const auto byte : e.manufacturer) {
        text += " " + std::to_string(byte);
    }
    gateway.clients_.send_event(text + " #" + emergency_text(e.code));
}

Gateway::Gateway(unsigned nets, Identity identity) : identity_(std::move(identity)) {
    for (unsigned n = 1; n <= nets; ++n) {
        nets_.push_back(std::make_unique<Net>(*this, n));
    }
}
Gateway::~Gateway() {
    for (Pending& p : pending_) {
        cancel(p);
    }
}

void Gateway::handle(unsigned net, const Frame& f, Time now) {
    if (f.error || f.fd) return;
    Net& n = *nets_[net - 1];
    if (n.lss.listens_to(f)) return n.lss.handle(f, now);
    n.network.handle(f, now);
    n.pdos.handle(
        f, [&](const std::string& text) { clients_.send_event(std::to_string(net) + " " + text); });
}

void Gateway::poll(Time now) {
    for (auto& net : nets_) {
        net->network.poll(now);
        net->lss.poll(now);
        net->own.poll(net->out, now);
    }
    for (auto p = pending_.begin(); p != pending_.end();) {
        if (!proceed(*p, now)) {
            ++p;
            continue;
        }
        clients_.remove_pending(p->client);
        p = pending_.erase(p);
    }
}

int Gateway::connect() { return clients_.connect({.net = nets_.size() == 1 ? 1U : 0U}); }

void Gateway::disconnect(int client) {
    for (auto p = pending_.begin(); p != pending_.end();) {
        if (p->client != client) {
            ++p;
            continue;
        }
        cancel(*p);
        p = pending_.erase(p);
    }
    clients_.disconnect(client);
}

void Gateway::receive(int client, std::string_view bytes, Time now) {
    clients_.receive(client, bytes,
                     [&](const std::string& text) { execute_line(client, text, now); });
}

void Gateway::configure(std::string_view commands, Time now) {
    const int client = connect();
    receive(client, commands, now);
    disconnect(client);
}

void Gateway::execute_line(int client, std::string_view text, Time now) {
    Parsed parsed = parse(text);
    if (parsed.error != Error::none) {
        return reject(client, parsed.command, parsed.error, parsed.why);
    }
    execute(client, std::move(parsed.command), now);
}

/// Determines net and node of a command, or the defaults of the client.
Error Gateway::find_address(int client, const Command& command, unsigned& net, std::uint8_t& node) {
    const Clients::Defaults& defaults = clients_.defaults(client);
    net = command.net.value_or(defaults.net);
    if (net == 0 && !command.net) return Error::no_net;
    if (net < 1 || net > nets_.size()) return Error::bad_net;
    const bool to_node = command.verb == Verb::read || command.verb == Verb::write ||
                         (command.verb >= Verb::start && command.verb <= Verb::disable_heartbeat);
    if (!to_node) return Error::none;
    if (!command.node && defaults.node == 0) return Error::no_node;
    const auto id = command.node.value_or(defaults.node);
    if (id > 127) return Error::bad_node;
    node = static_cast<std::uint8_t>(id);
    return Error::none;
}

/// Executes a command that is for no net. Returns false if it is for one.
bool Gateway::execute_in_gateway(int client, const Command& command) {
    switch (command.verb) {
    case Verb::none: return true;
    case Verb::help: help(client, command); return true;
    case Verb::set_network: {
        const unsigned net = command.numbers[0];
        if (net < 1 || net > nets_.size()) {
            reject(client, command, Error::bad_net);
            return true;
        }
        clients_.defaults(client).net = net;
        answer(client, command, "OK");
        return true;
    }
    default: return false;
    }
}

void Gateway::help(int client, const Command& command) {
    std::string text = "OK";
    for (const char letter : help_text()) {
        text += letter == '\n' ? std::string("\r\n# ") : std::string(1, letter);
    }
    answer(client, command, text.insert(2, "\r\n# ").substr(0, text.size() - 4));
}

void Gateway::set_default_node(int client, const Command& command, const Net& net) {
    const unsigned node = command.numbers[0];
    if (node < 1 || node > 127) return reject(client, command, Error::bad_node);
    clients_.defaults(client) = {.net = net.number, .node = node};
    answer(client, command, "OK");
}

/// Passes a command of CiA 309-3 to the part of the gateway that executes it. An invalid address is
/// rejected.
void Gateway::execute(int client, Command&& command, Time now) {
    if (execute_in_gateway(client, command)) return;
    unsigned net_number = 0;
    std::uint8_t node = 0;
    const Error error = find_address(client, command, net_number, node);
    if (error != Error::none) return reject(client, command, error);
    const Address to{*nets_[net_number - 1], node};
    switch (command.verb) {
    case Verb::set_node: return set_default_node(client, command, to.net);
    case Verb::read:
    case Verb::write: return start_transfer(client, std::move(command), to, now);
    case Verb::read_pdo: return read_pdo(client, std::move(command), to.net, now);
    case Verb::write_pdo:
    case Verb::set_rpdo:
    case Verb::set_tpdo: return pdo_command(client, command, to.net);
    case Verb::start:
    case Verb::stop:
    case Verb::preoperational:
    case Verb::reset_node:
    case Verb::reset_communication: return network_command(client, command, to);
    case Verb::enable_guarding:
    case Verb::disable_guarding:
    case Verb::enable_heartbeat:
    case Verb::disable_heartbeat: return error_control(client, command, to, now);
    default: break;
    }
    if (command.verb >= Verb::lss_switch_global) {
        return start_lss(client, std::move(command), to.net, now);
    }
    setting(client, command, to.net, now);
}

void Gateway::network_command(int client, const Command& c, const Address& to) {
    if (to.node != 0 && to.node == to.net.own.id()) {
        return reject(
            client, c, Error::state,
            "node " + std::to_string(to.node) + " is the gateway itself, always operational");
    }
    if (!to.net.network.command(nmt_command(c.verb), to.node)) {
        return reject(client, c, Error::no_memory, "the bus does not take it");
    }
    answer(client, c, "OK");
}

void Gateway::error_control(int client, const Command& c, const Address& to, Time now) {
    if (to.node == 0) return reject(client, c, Error::bad_node);
    if (to.node == to.net.own.id()) {
        return reject(client, c, Error::state,
                      "node " + std::to_string(to.node) +
                          " is the gateway itself, which does not monitor itself");
    }
    const auto fits = [&](std::size_t n, std::uint32_t max) {
        return c.numbers[n] >= 1 && c.numbers[n] <= max;
    };
    RemoteNode& remote = *to.net.network.node(to.node);
    switch (c.verb) {
    case Verb::enable_guarding:
        if (!fits(0, 65535) || !fits(1, 255)) {
            return reject(client, c, Error::syntax, "1 to 65535 ms, factor 1 to 255");
        }
        remote.guard(c.numbers[0] * millisecond, static_cast<std::uint8_t>(c.numbers[1]), now);
        break;
    case Verb::disable_guarding: remote.guard(0, 0, now); break;
    case Verb::enable_heartbeat:
        if (!fits(0, 65535)) return reject(client, c, Error::syntax, "1 to 65535 ms");
        remote.expect_heartbeat(c.numbers[0] * millisecond);
        break;
    default: remote.expect_heartbeat(0); break;
    }
    to.net.watches[to.node] = c.verb == Verb::enable_guarding || c.verb == Verb::enable_heartbeat;
    answer(client, c, "OK");
}

void Gateway::reset(Net& net, Time now) {
    for (auto p = pending_.begin(); p != pending_.end();) {
        if (p->net != net.number) {
            ++p;
            continue;
        }
        cancel(*p);
        reject(p->client, p->command, Error::state, "ended by init");
        clients_.remove_pending(p->client);
        p = pending_.erase(p);
    }
    net.pdos.clear();
    for (std::uint8_t node = 1; node <= 127; ++node) {
        net.network.node(node)->guard(0, 0, now);
        net.network.node(node)->expect_heartbeat(0);
        net.watches[node] = false;
    }
}

std::string Gateway::commands() const {
    std::string text;
    for (const auto& net : nets_) {
        const std::string to = std::to_string(net->number) + " set ";
        const auto line = [&](const char* what, std::uint64_t value) {
            text += to + what + " " + std::to_string(value) + "\n";
        };
        if (net->own.id() != 0) {
            line("id", net->own.id());
        }
        line("heartbeat", static_cast<std::uint64_t>(net->own.heartbeat() / millisecond));
        line("command_timeout", static_cast<std::uint64_t>(net->command_timeout / millisecond));
        line("command_size", net->command_size);
        line("sdo_timeout", static_cast<std::uint64_t>(net->sdo_timeout / millisecond));
        line("sdo_block", net->block ? 1 : 0);
        text += std::to_string(net->number) + " boot_up_indication " +
                (net->boot_up ? "enable" : "disable") + "\n";
    }
    return text;
}

void Gateway::setting(int client, const Command& c, Net& net, Time now) {
    switch (c.verb) {
    case Verb::init: return initialise_net(client, c, net, now);
    case Verb::store: return save(client, c, commands());
    case Verb::restore: return save(client, c, "");
    case Verb::info_version: return info_version(client, c);
    default: break;
    }
    const Range range = range_of(c.verb);
    const std::uint32_t value = c.numbers.empty() ? 0 : c.numbers[0];
    if (value < range.min || value > range.max) {
        return reject(client, c, Error::syntax, range.text());
    }
    apply_setting(c.verb, value, net, now);
    answer(client, c, "OK");
}

void Gateway::apply_setting(Verb verb, std::uint32_t value, Net& net, Time now) {
    switch (verb) {
    case Verb::set_heartbeat: net.own.set_heartbeat(value * millisecond, now); return;
    case Verb::set_id: net.own.set_id(static_cast<std::uint8_t>(value)); return;
    case Verb::set_command_timeout: net.command_timeout = value * millisecond; return;
    case Verb::set_command_size: net.command_size = value; return;
    case Verb::set_sdo_timeout:
        net.sdo_timeout = value * millisecond;
        for (std::uint8_t node = 1; node <= 127; ++node) {
            net.network.node(node)->sdo().settings().timeout = net.sdo_timeout;
        }
        return;
    case Verb::set_sdo_block: net.block = value != 0; return;
    case Verb::boot_up_indication: net.boot_up = value != 0; return;
    default: return;
    }
}

void Gateway::initialise_net(int client, const Command& c, Net& net, Time now) {
    const Range range{0, 9};
    const std::uint32_t bit_rate = c.numbers[0];
    if (bit_rate > range.max) return reject(client, c, Error::syntax, range.text());
    if (!initialise(net.number, bit_rate)) {
        return reject(client, c, Error::init_failed, "the bus runs at another bit rate");
    }
    reset(net, now);
    answer(client, c, "OK");
}

void Gateway::save(int client, const Command& c, const std::string& settings) {
    if (!keep(settings)) {
        return reject(client, c, Error::state, "there is no place to store in");
    }
    answer(client, c, "OK");
}

/// Vendor, product, revision, serial, class, CiA 309, ours.
void Gateway::info_version(int client, const Command& c) {
    answer(client, c,
           format_text("%u %u %u.%u %u 3 3.0 1.0", identity_.vendor, identity_.product,
                       identity_.revision >> 16, identity_.revision & 0xffff, identity_.serial));
}

bool Gateway::enqueue(int client, Command&& command, const Address& to, Time now) {
    if (!clients_.add_pending(client)) {
        reject(client, command, Error::no_memory, "too many commands wait for their answers");
        return false;
    }
    Pending& p = pending_.emplace_back();
    p.client = client;
    p.net = to.net.number;
    p.node = to.node;
    p.command = std::move(command);
    p.since = now;
    p.limit = to.net.command_timeout;
    return true;
}

void Gateway::start_transfer(int client, Command&& command, const Address& to, Time now) {
    Net& net = to.net;
    if (to.node == 0) return reject(client, command, Error::bad_node);
    if (command.value.size() > net.command_size) {
        return reject(client, command, Error::no_memory,
                      "set command_size allows " + std::to_string(net.command_size) + " bytes");
    }
    if (to.node == net.own.id()) return answer(client, command, net.own.transfer(command, now));
    if (!enqueue(client, std::move(command), to, now)) return;
    Pending& p = pending_.back();
    p.request.index = p.command.index;
    p.request.sub = p.command.sub;
    p.request.upload = p.command.verb == Verb::read;
    p.request.mode = net.block ? SdoMode::block : SdoMode::segmented;
    if (p.request.upload) {
        p.buffer = std::make_unique_for_overwrite<std::uint8_t[]>(net.command_size);
        p.request.buffer = {p.buffer.get(), net.command_size};
    } else {
        p.request.data = p.command.value;
    }
    net.network.node(to.node)->sdo().submit(p.request);
}

void Gateway::start_lss(int client, Command&& command, Net& net, Time now) {
    const Error error = lss_argument_error(command);
    if (error != Error::none) return reject(client, command, error);
    enqueue(client, std::move(command), {net}, now);
}

void Gateway::pdo_command(int client, const Command& c, Net& net) {
    std::string why;
    const Error error = c.verb == Verb::write_pdo ? net.pdos.write(c, why)
                                                  : net.pdos.configure(c.verb == Verb::set_rpdo, c);
    if (error != Error::none) return reject(client, c, error, why);
    answer(client, c, "OK");
}

/// Answers with the newest value, or requests a PDO of type `rtr` and waits for it.
void Gateway::read_pdo(int client, Command&& c, Net& net, Time now) {
    if (net.pdos.request(c.numbers[0])) {
        enqueue(client, std::move(c), {net}, now);
        return;
    }
    std::string text;
    const Error error = net.pdos.read(c.numbers[0], text);
    if (error != Error::none) {
        return reject(client, c, error, "nothing has come yet, or set rpdo is missing");
    }
    answer(client, c, std::to_string(net.number) + " " + text);
}

void Gateway::cancel(Pending& p) {
    Net& net = *nets_[p.net - 1];
    if (p.command.verb == Verb::read || p.command.verb == Verb::write) {
        if (!p.request.done()) {
            net.network.node(p.node)->sdo().cancel(p.request);
        }
    } else if (p.lss.uses_master()) {
        net.lss.cancel();
        net.lss_owner = nullptr;
    }
}

bool Gateway::proceed(Pending& p, Time now) {
    if (p.limit != 0 && now - p.since >= p.limit && !p.request.done()) {
        cancel(p);
        reject(p.client, p.command, Error::timeout);
        return true;
    }
    switch (p.command.verb) {
    case Verb::read:
    case Verb::write: return proceed_transfer(p);
    case Verb::read_pdo: return proceed_pdo(p, now);
    default: return proceed_lss(p, now);
    }
}

bool Gateway::proceed_transfer(Pending& p) {
    if (!p.request.done()) return false;
    if (p.request.abort != Abort::none) {
        answer(p.client, p.command, abort_text(p.request.abort));
    } else if (p.command.verb == Verb::write) {
        answer(p.client, p.command, "OK");
    } else {
        answer(p.client, p.command, value_text({p.buffer.get(), p.request.size}, p.command.format));
    }
    return true;
}

bool Gateway::proceed_pdo(Pending& p, Time now) {
    const Net& net = *nets_[p.net - 1];
    std::string text;
    if (net.pdos.read(p.command.numbers[0], text) == Error::none) {
        answer(p.client, p.command, std::to_string(p.net) + " " + text);
        return true;
    }
    if (now - p.since < net.sdo_timeout) return false;
    reject(p.client, p.command, Error::timeout);
    return true;
}

bool Gateway::proceed_lss(Pending& p, Time now) {
    Net& net = *nets_[p.net - 1];
    const bool in_use = net.lss_owner != nullptr && net.lss_owner != &p;
    const auto response = p.lss.proceed(p.command, net.lss, in_use, now);
    if (!response && p.lss.uses_master()) {
        net.lss_owner = &p;
    } else if (net.lss_owner == &p) {
        net.lss_owner = nullptr;
    }
    if (!response) return false;
    if (response->error != Error::none) {
        reject(p.client, p.command, response->error);
    } else {
        answer(p.client, p.command, response->text);
    }
    return true;
}

}  // namespace hal::canopen::gateway
