// SPDX-License-Identifier: MIT
#include "gateway.hpp"

#include <algorithm>
#include <cstdio>

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
        if (c == '-') {
            c = '_';
        } else if (c >= 'a' && c <= 'z') {
            c = static_cast<char>(c - 'a' + 'A');
        } else {
            c = c;
        }
    }
    return out;
}

}  // namespace

Gateway::Net::Net(Gateway& owner, unsigned n)
    : gateway(owner),
      number(n),
      network(out, *this),
      lss(out),
      pdos(out),
      own(own_objects(owner.identity_)) {
    for (std::uint8_t node = 1; node <= 127; ++node) {
        network.add(node);
    }
}

void Gateway::Net::on_node(std::uint8_t node, NodeEvent event, NmtState state, Time) noexcept {
    const std::string who = std::to_string(number) + " " + std::to_string(node) + " ";
    const bool guarded = watches[node];
    if (event == NodeEvent::boot_up) {
        if (boot_up) {
            gateway.send_event(who + "BOOT_UP");
        }
    } else if (event == NodeEvent::lost) {
        const Error what =
            network.node(node)->guarded() ? Error::lost_guarding : Error::lost_heartbeat;
        gateway.send_event(who + "ERROR " + std::to_string(static_cast<unsigned>(what)) + " #" +
                           to_string(what));
    } else if (guarded) {
        gateway.send_event(who + upper(canopen::to_string(state)));
    }
}

void Gateway::Net::on_emergency(std::uint8_t node, const Emergency& e) noexcept {
    std::string text =
        format_text("%u %u EMCY 0x%04X 0x%02X", number, node, e.code, e.error_register);
    for (const auto byte : e.manufacturer) {
        text += " " + std::to_string(byte);
    }
    gateway.send_event(text + " #" + emergency_text(e.code));
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
    n.pdos.handle(f,
                  [&](const std::string& text) { send_event(std::to_string(net) + " " + text); });
}

void Gateway::poll(Time now) {
    for (auto& net : nets_) {
        net->network.poll(now);
        net->lss.poll(now);
        if (net->heartbeat == 0 || net->id == 0 || now < net->next_heartbeat) continue;
        Frame beat = make_frame(0x700U + net->id, 1);
        beat.data[0] = static_cast<std::uint8_t>(NmtState::operational);
        if (net->out.push(beat)) {
            net->next_heartbeat = std::max(net->next_heartbeat + net->heartbeat, now);
        }
    }
    for (auto p = pending_.begin(); p != pending_.end();) {
        if (!proceed(*p, now)) {
            ++p;
            continue;
        }
        Client& client = clients_[static_cast<std::size_t>(p->client)];
        if (client.pending > 0) {
            --client.pending;
        }
        p = pending_.erase(p);
    }
}

void Gateway::line(int client, std::string_view text, Time now) {
    Parsed parsed = parse(text);
    if (parsed.error != Error::none) {
        return reject(client, parsed.command.sequence, parsed.error, parsed.why);
    }
    execute(client, std::move(parsed.command), now);
}

/// Determines net and node of a command, or the defaults of the client. Returns false after
/// rejecting the command.
bool Gateway::address(Client& c, const Command& command, int client, bool with_node, unsigned& net,
                      std::uint8_t& node) {
    net = command.net.value_or(c.net);
    if (net == 0 && !command.net) {
        reject(client, command.sequence, Error::no_net);
        return false;
    }
    if (net < 1 || net > nets_.size()) {
        reject(client, command.sequence, Error::bad_net);
        return false;
    }
    if (!with_node) return true;
    if (!command.node && c.node == 0) {
        reject(client, command.sequence, Error::no_node);
        return false;
    }
    const auto id = command.node.value_or(c.node);
    if (id > 127) {
        reject(client, command.sequence, Error::bad_node);
        return false;
    }
    node = static_cast<std::uint8_t>(id);
    return true;
}

void Gateway::execute(int client, Command&& command, Time now) {
    Client& c = clients_[static_cast<std::size_t>(client)];
    unsigned net = 0;
    std::uint8_t node = 0;
    const bool to_node = command.verb == Verb::read || command.verb == Verb::write ||
                         (command.verb >= Verb::start && command.verb <= Verb::disable_heartbeat);
    switch (command.verb) {
    case Verb::none: return;
    case Verb::help: {
        std::string text = "OK";
        for (const char letter : help_text()) {
            text += letter == '\n' ? std::string("\r\n# ") : std::string(1, letter);
        }
        return answer(client, command.sequence,
                      text.insert(2, "\r\n# ").substr(0, text.size() - 4));
    }
    case Verb::set_network:
        if (command.numbers[0] < 1 || command.numbers[0] > nets_.size()) {
            return reject(client, command.sequence, Error::bad_net);
        }
        c.net = command.numbers[0];
        return answer(client, command.sequence, "OK");
    default: break;
    }
    if (!address(c, command, client, to_node, net, node)) return;
    Net& n = *nets_[net - 1];
    switch (command.verb) {
    case Verb::set_node:
        if (command.numbers[0] < 1 || command.numbers[0] > 127) {
            return reject(client, command.sequence, Error::bad_node);
        }
        c.net = net;
        c.node = command.numbers[0];
        return answer(client, command.sequence, "OK");
    case Verb::read:
    case Verb::write: return start_transfer(client, std::move(command), n, node, now);
    case Verb::read_pdo:
    case Verb::write_pdo:
    case Verb::set_rpdo:
    case Verb::set_tpdo: return pdo_command(client, std::move(command), n, now);
    case Verb::start:
    case Verb::stop:
    case Verb::preoperational:
    case Verb::reset_node:
    case Verb::reset_communication: return network_command(client, command, n, node, now);
    case Verb::enable_guarding:
    case Verb::disable_guarding:
    case Verb::enable_heartbeat:
    case Verb::disable_heartbeat: return error_control(client, command, n, node, now);
    default: break;
    }
    if (command.verb >= Verb::lss_switch_global) {
        return start_lss(client, std::move(command), n, now);
    }
    setting(client, command, n, now);
}

void Gateway::network_command(int client, const Command& c, Net& net, std::uint8_t node, Time) {
    const NmtCommand what = c.verb == Verb::start            ? NmtCommand::start
                            : c.verb == Verb::stop           ? NmtCommand::stop
                            : c.verb == Verb::preoperational ? NmtCommand::enter_pre_operational
                            : c.verb == Verb::reset_node     ? NmtCommand::reset_node
                                                             : NmtCommand::reset_communication;
    if (node != 0 && node == net.id) {
        return reject(
            client, c.sequence, Error::state,
            "node " + std::to_string(node) + " is the gateway itself, always operational");
    }
    if (!net.network.command(what, node)) {
        return reject(client, c.sequence, Error::no_memory, "the bus does not take it");
    }
    answer(client, c.sequence, "OK");
}

void Gateway::error_control(int client, const Command& c, Net& net, std::uint8_t node, Time now) {
    if (node == 0) return reject(client, c.sequence, Error::bad_node);
    if (node == net.id) {
        return reject(client, c.sequence, Error::state,
                      "node " + std::to_string(node) +
                          " is the gateway itself, which does not monitor itself");
    }
    RemoteNode& remote = *net.network.node(node);
    switch (c.verb) {
    case Verb::enable_guarding:
        if (c.numbers[0] < 1 || c.numbers[0] > 65535 || c.numbers[1] < 1 || c.numbers[1] > 255) {
            return reject(client, c.sequence, Error::syntax, "1 to 65535 ms, factor 1 to 255");
        }
        remote.guard(c.numbers[0] * millisecond, static_cast<std::uint8_t>(c.numbers[1]), now);
        break;
    case Verb::disable_guarding: remote.guard(0, 0, now); break;
    case Verb::enable_heartbeat:
        if (c.numbers[0] < 1 || c.numbers[0] > 65535) {
            return reject(client, c.sequence, Error::syntax, "1 to 65535 ms");
        }
        remote.expect_heartbeat(c.numbers[0] * millisecond);
        break;
    default: remote.expect_heartbeat(0); break;
    }
    net.watches[node] = c.verb == Verb::enable_guarding || c.verb == Verb::enable_heartbeat;
    answer(client, c.sequence, "OK");
}

void Gateway::reset(Net& net, Time now) {
    for (auto p = pending_.begin(); p != pending_.end();) {
        if (p->net != net.number) {
            ++p;
            continue;
        }
        cancel(*p);
        reject(p->client, p->command.sequence, Error::state, "ended by init");
        Client& client = clients_[static_cast<std::size_t>(p->client)];
        if (client.pending > 0) {
            --client.pending;
        }
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
        if (net->id != 0) {
            line("id", net->id);
        }
        line("heartbeat", static_cast<std::uint64_t>(net->heartbeat / millisecond));
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
    const std::uint32_t value = c.numbers.empty() ? 0 : c.numbers[0];
    const auto range = [&](std::uint32_t least, std::uint32_t most) {
        if (value >= least && value <= most) return true;
        reject(client, c.sequence, Error::syntax,
               std::to_string(least) + " to " + std::to_string(most));

        return false;
    };
    switch (c.verb) {
    case Verb::init:
        if (!range(0, 9)) return;
        if (!initialise(net.number, value)) {
            return reject(client, c.sequence, Error::init_failed,
                          "the bus runs at another bit rate");
        }
        reset(net, now);
        break;
    case Verb::set_heartbeat:
        if (!range(0, 65535)) return;
        net.heartbeat = value * millisecond;
        net.next_heartbeat = now;
        break;
    case Verb::set_id:
        if (!range(1, 127)) return;
        net.id = static_cast<std::uint8_t>(value);
        break;
    case Verb::set_command_timeout: net.command_timeout = value * millisecond; break;
    case Verb::set_command_size:
        if (!range(1, 16 << 20)) return;
        net.command_size = value;
        break;
    case Verb::set_sdo_timeout:
        if (!range(1, 600'000)) return;
        net.sdo_timeout = value * millisecond;
        for (std::uint8_t node = 1; node <= 127; ++node) {
            net.network.node(node)->sdo().settings().timeout = net.sdo_timeout;
        }
        break;
    case Verb::set_sdo_block:
        if (!range(0, 1)) return;
        net.block = value != 0;
        break;
    case Verb::boot_up_indication: net.boot_up = value != 0; break;
    case Verb::store:
        if (!keep(commands())) {
            return reject(client, c.sequence, Error::state, "there is no place to store in");
        }
        break;
    case Verb::restore: {
        if (!keep("")) {
            return reject(client, c.sequence, Error::state, "there is no place to store in");
        }
        break;
    }
    case Verb::info_version:
        // vendor, product, revision, serial, class, CiA 309, ours
        return answer(
            client, c.sequence,
            format_text("%u %u %u.%u %u 3 3.0 1.0", identity_.vendor, identity_.product,
                        identity_.revision >> 16, identity_.revision & 0xffff, identity_.serial));
    default: return reject(client, c.sequence, Error::not_supported);
    }
    answer(client, c.sequence, "OK");
}

bool Gateway::enqueue(int client, Command&& command, Net& net, std::uint8_t node, Time now) {
    Client& c = clients_[static_cast<std::size_t>(client)];
    if (c.pending >= most_pending) {
        reject(client, command.sequence, Error::no_memory,
               "too many commands wait for their answers");

        return false;
    }
    ++c.pending;
    Pending& p = pending_.emplace_back();
    p.client = client;
    p.net = net.number;
    p.node = node;
    p.command = std::move(command);
    p.since = now;
    p.limit = net.command_timeout;
    return true;
}

void Gateway::start_transfer(int client, Command&& command, Net& net, std::uint8_t node, Time now) {
    if (node == 0) return reject(client, command.sequence, Error::bad_node);
    if (command.value.size() > net.command_size) {
        return reject(client, command.sequence, Error::no_memory,
                      "set command_size allows " + std::to_string(net.command_size) + " bytes");
    }
    if (node == net.id) return own_transfer(client, command, net, now);
    if (!enqueue(client, std::move(command), net, node, now)) return;
    Pending& p = pending_.back();
    p.request.index = p.command.index;
    p.request.sub = p.command.sub;
    p.request.upload = p.command.verb == Verb::read;
    p.request.mode = net.block ? SdoMode::block : SdoMode::segmented;
    if (p.request.upload) {
        p.room = std::make_unique_for_overwrite<std::uint8_t[]>(net.command_size);
        p.request.buffer = {p.room.get(), net.command_size};
    } else {
        p.request.data = p.command.value;
    }
    net.network.node(node)->sdo().submit(p.request);
}

void Gateway::pdo_command(int client, Command&& c, Net& net, Time now) {
    std::string text;
    Error error = Error::none;
    switch (c.verb) {
    case Verb::set_rpdo:
    case Verb::set_tpdo: error = net.pdos.configure(c.verb == Verb::set_rpdo, c); break;
    case Verb::write_pdo: error = net.pdos.write(c, text); break;
    default:
        if (net.pdos.request(c.numbers[0])) {
            enqueue(client, std::move(c), net, 0, now);
            return;
        }
        error = net.pdos.read(c.numbers[0], text);
        if (error == Error::none) {
            return answer(client, c.sequence, std::to_string(net.number) + " " + text);
        }
        text = "nothing has come yet, or set rpdo is missing";
    }
    if (error != Error::none) return reject(client, c.sequence, error, text);
    answer(client, c.sequence, "OK");
}

void Gateway::cancel(Pending& p) {
    Net& net = *nets_[p.net - 1];
    if (p.command.verb == Verb::read || p.command.verb == Verb::write) {
        if (!p.request.done()) {
            net.network.node(p.node)->sdo().cancel(p.request);
        }
    } else if (p.lss_started) {
        net.lss.cancel();
        net.lss_owner = nullptr;
    }
}

bool Gateway::proceed(Pending& p, Time now) {
    if (p.limit != 0 && now - p.since >= p.limit && !p.request.done()) {
        cancel(p);
        reject(p.client, p.command.sequence, Error::timeout);
        return true;
    }
    switch (p.command.verb) {
    case Verb::read:
    case Verb::write: return proceed_transfer(p, now);
    case Verb::read_pdo: {
        Net& net = *nets_[p.net - 1];
        std::string text;
        if (net.pdos.read(p.command.numbers[0], text) == Error::none) {
            answer(p.client, p.command.sequence, std::to_string(p.net) + " " + text);
            return true;
        }
        if (now - p.since < net.sdo_timeout) return false;
        reject(p.client, p.command.sequence, Error::timeout);
        return true;
    }
    default: return proceed_lss(p, now);
    }
}

bool Gateway::proceed_transfer(Pending& p, Time) {
    if (!p.request.done()) return false;
    if (p.request.abort != Abort::none) {
        answer(p.client, p.command.sequence, abort_text(p.request.abort));
    } else if (p.command.verb == Verb::write) {
        answer(p.client, p.command.sequence, "OK");
    } else {
        const Format* f = p.command.format ? p.command.format : format("hex");
        answer(p.client, p.command.sequence, text_of({p.room.get(), p.request.size}, *f));
    }
    return true;
}

}  // namespace hal::canopen::gateway
