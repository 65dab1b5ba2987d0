// SPDX-License-Identifier: MIT
#include "node_status.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>

#include "canopen/protocol/emcy.hpp"
#include "text/text_table.hpp"

namespace hal::canopen {

const char* to_string(Step s) noexcept {
    constexpr TextRow<Step> texts[] = {
        {Step::off, "off"},
        {Step::queued, "queued"},
        {Step::resetting, "resetting"},
        {Step::identifying, "identifying"},
        {Step::checking_state, "checking its state"},
        {Step::checking_program, "checking its program"},
        {Step::updating, "updating its program"},
        {Step::restoring, "restoring its defaults"},
        {Step::configuring, "configuring"},
        {Step::saving, "saving"},
        {Step::watching, "waiting for its heartbeat"},
        {Step::ready, "ready"},
        {Step::starting, "starting"},
        {Step::running, "running"},
        {Step::waiting, "waiting"},
        {Step::failed, "failed"},
        {Step::stopped, "stopped"},
    };
    return find_text(texts, s, "?");
}

const char* to_string(BootResult r) noexcept {
    constexpr TextRow<BootResult> texts[] = {
        {BootResult::none, "not booted yet"},
        {BootResult::good, "booted"},
        {BootResult::not_listed, "not in the network list"},
        {BootResult::no_answer, "no response"},
        {BootResult::device_type, "wrong device type"},
        {BootResult::vendor, "wrong vendor"},
        {BootResult::no_heartbeat, "no heartbeat while its state was checked"},
        {BootResult::no_guarding, "no response to node guarding"},
        {BootResult::no_program, "program or program objects missing"},
        {BootResult::no_update, "wrong program, update not allowed"},
        {BootResult::update, "program download failed"},
        {BootResult::configuration, "configuration failed"},
        {BootResult::watching, "no heartbeat at the start of error control"},
        {BootResult::was_operational, "already operational"},
        {BootResult::product, "wrong product"},
        {BootResult::revision, "wrong revision"},
        {BootResult::serial, "wrong serial number"},
    };
    return find_text(texts, r, "?");
}

const char* to_string(NetworkState s) noexcept {
    constexpr TextRow<NetworkState> texts[] = {
        {NetworkState::off, "off"},
        {NetworkState::booting, "booting"},
        {NetworkState::operational, "operational"},
        {NetworkState::degraded, "degraded"},
        {NetworkState::stopped, "stopped"},
        {NetworkState::failed, "failed"},
    };
    return find_text(texts, s, "?");
}

namespace {

template <class... T>
std::string print(const char* format, T... values) {
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(), format, values...);
    return text.data();
}
std::string hex(std::uint64_t value) {
    const auto number = static_cast<unsigned long long>(value);
    if (value > 0xffffffff) return print("%016llXh", number);
    if (value > 0xffff) return print("%08llXh", number);
    return print("%04llXh", number);
}
std::string seconds(Time t) { return print("%.2f s", static_cast<double>(t) / second); }
std::string text(std::uint64_t value) {
    std::array<char, 9> bytes{};
    std::memcpy(bytes.data(), &value, 8);
    return '\'' + std::string(bytes.data()) + '\'';
}
std::string node_name(const NodeSetup& n) {
    return "node " + std::to_string(n.id) + (n.name.empty() ? std::string() : " (" + n.name + ')');
}
std::string object(const NodeSetup& n, const NodeStatus& s) {
    std::string result = print("%04X:%u", unsigned{s.index}, unsigned{s.sub});
    if (s.write == 0 || s.write > n.writes.size() || n.writes[s.write - 1U].name.empty()) {
        return result;
    }
    return result + " (" + n.writes[s.write - 1U].name + ')';
}
const char* identity(std::uint16_t index, std::uint8_t sub) {
    if (index == 0x1000) return "device type";
    constexpr std::array names{"vendor ID", "product code", "revision number", "serial number"};
    return sub >= 1 && sub <= 4 ? names[sub - 1U] : "identity";
}

/// Returns the meaning of the error code in 1F57h, bits 7 to 1 (CiA 302-3).
const char* flash_error_text(std::uint64_t status) {
    constexpr TextRow<std::uint64_t> texts[] = {
        {1, "no valid program"},
        {2, "unknown data format"},
        {3, "data format error or CRC error"},
        {4, "flash not erased before writing"},
        {5, "flash write error"},
        {6, "address out of range"},
        {7, "flash write-protected"},
    };
    return find_text(texts, status >> 1 & 0x7f, "unspecified error");
}

const char* during(Step s) {
    constexpr TextRow<Step> texts[] = {
        {Step::identifying, "while it was identified"},
        {Step::checking_state, "while its state was checked"},
        {Step::checking_program, "while its program was checked"},
        {Step::updating, "while its program was updated"},
        {Step::restoring, "while its defaults were restored"},
        {Step::saving, "while it saved its configuration"},
        {Step::watching, "at the start of error control"},
    };
    return find_text(texts, s, "while it was configured");
}

std::string command_text(std::uint8_t command) {
    const char* const name = to_string(static_cast<NmtCommand>(command));
    return name == nullptr ? "an NMT command" : std::string("NMT ") + name;
}

std::string program(const NodeSetup& n, const NodeStatus& s) {
    if (s.index == 0x100a) {
        return text(s.found) + " (100A:0) where " + text(s.expected) + " is expected";
    }
    return hex(s.found) + print(" (1F56:%u) where ", unsigned{n.program.number}) + hex(s.expected) +
           " is expected";
}

std::string emergency(const NodeStatus& s) {
    if (s.emergency.code == 0) {
        return {};
    }
    return print("; last emergency %04Xh (", unsigned{s.emergency.code}) +
           emergency_text(s.emergency.code) + ')';
}

std::string aborted(const NodeSetup& n, const NodeStatus& s) {
    const std::string abort =
        std::string(to_string(s.abort)) + print(" (%08lXh)", static_cast<unsigned long>(s.abort));
    if (s.failed_in == Step::identifying) {
        return "rejects the read of its " + std::string(identity(s.index, s.sub)) + ", " +
               object(n, s) + ": " + abort + "; connect the right device, or remove this check";
    }
    if (static_cast<std::uint32_t>(s.abort) >> 24 == 5) {
        return "failed the SDO transfer of object " + object(n, s) + ' ' + during(s.failed_in) +
               ": " + abort +
               "; another device disturbs the transfer, or the node's SDO server is defective";
    }
    if (s.failed_in == Step::configuring) {
        return "rejects " + hex(s.expected) + " for object " + object(n, s) + ": " + abort +
               "; correct the value in its configuration or remove the object";
    }
    return "rejects object " + object(n, s) + ' ' + during(s.failed_in) + ": " + abort;
}

std::string unresponsive(const NodeSetup& n, const NodeStatus& s) {
    if (s.result == BootResult::no_answer) {
        return "does not respond (" + object(n, s) +
               "): check its power, cable, bit rate and node ID; 'hal can scan' lists the "
               "nodes that respond";
    }
    return "stopped responding at " + object(n, s) + ' ' + during(s.failed_in) +
           ": check its power and cable";
}

std::string mismatch(const NodeSetup& n, const NodeStatus& s) {
    if (s.failed_in == Step::checking_program) {
        return "runs program " + program(n, s) +
               ", and updates are not allowed: update it by hand or allow the update";
    }
    return "is another device: its " + std::string(identity(s.index, s.sub)) + " (" + object(n, s) +
           ") is " + hex(s.found) + " where " + hex(s.expected) +
           " is expected; connect the right device or correct its configuration";
}

std::string not_retained(const NodeSetup& n, const NodeStatus& s) {
    if (s.failed_in == Step::checking_program) {
        return "still runs program " + program(n, s) + " after the download; check the file";
    }
    return "accepted " + hex(s.expected) + " for object " + object(n, s) + " but holds " +
           hex(s.found) + "; write a value it can hold, or remove the object";
}

/// When a sign of life is missing.
std::string when_silent(const NodeStatus& s) {
    return s.failed_in >= Step::ready ? "within its timeout" : during(s.failed_in);
}

std::string rebooted(const NodeStatus& s) {
    if (s.foreign_command != 0) {
        return std::string("rebooted after another device sent ") +
               command_text(s.foreign_command) + ": remove the second NMT master";
    }
    return "rebooted without a command from this master: check its supply voltage, and the bus "
           "for another NMT master";
}

std::string left_operational(const NodeStatus& s) {
    if (s.foreign_command != 0) {
        return "left the operational state after another device sent " +
               command_text(s.foreign_command) + " and is " + to_string(s.state) +
               ": remove the second NMT master";
    }
    return "left the operational state without a command from this master and is " +
           std::string(to_string(s.state)) + emergency(s) +
           ": check the node, and the bus for another NMT master";
}

/// The predicate of the sentence whose subject is the node.
std::string predicate(const NodeSetup& n, const NodeStatus& s) {
    switch (s.cause) {
    case Cause::none: return {};
    case Cause::no_response: return unresponsive(n, s);
    case Cause::not_sent:
        return "could not be asked for " + object(n, s) + ' ' + during(s.failed_in) +
               ": the bus accepts no frames from the master; check the master's cable, the bit "
               "rate, and that another node is connected";
    case Cause::aborted: return aborted(n, s);
    case Cause::mismatch: return mismatch(n, s);
    case Cause::not_retained: return not_retained(n, s);
    case Cause::duplicate_id:
        return "has a duplicate node ID: two devices respond, object " + object(n, s) + " is " +
               hex(s.expected) + " and " + hex(s.found) + "; change the node ID of one of them";
    case Cause::restarting:
        return std::string("rebooted repeatedly ") + during(s.failed_in) +
               ": check its supply voltage";
    case Cause::no_object:
        return "has no object " + object(n, s) +
               ", so its program cannot be checked or updated: remove the program from its "
               "configuration";
    case Cause::no_image:
        return "runs program " + program(n, s) +
               ", and no program file is configured: configure one";
    case Cause::flash:
        return "reports a flash error: " + std::string(flash_error_text(s.found)) + " (" +
               object(n, s) + " is " + hex(s.found) + "); check that the file is for this device";
    case Cause::flash_busy:
        return "reports its flash busy for more than " + seconds(n.program.limit) + " (" +
               object(n, s) + ')';
    case Cause::heartbeat:
        return "sent no heartbeat " + when_silent(s) + ": check its power and cable";
    case Cause::guarding:
        return "did not respond to node guarding " + when_silent(s) +
               ": check its power and cable, and that it supports node guarding";
    case Cause::guard_toggle:
        return "responded to node guarding with a toggle bit that did not alternate: supervise it "
               "by heartbeat, or look for a second device "
               "with this node ID";
    case Cause::boot_up: return rebooted(s);
    case Cause::left_operational: return left_operational(s);
    case Cause::not_started:
        return "did not become operational after NMT start and is " +
               std::string(to_string(s.state)) +
               print("; its error register is %02Xh", unsigned{s.error_register});
    case Cause::commanded: return "was stopped by command";
    case Cause::network: return "was stopped because of another node";
    }
    return {};
}

}  // namespace

std::string sentence(const NodeSetup& n, const NodeStatus& s) {
    const auto cause = predicate(n, s);
    if (cause.empty()) {
        return {};
    }
    std::string result = node_name(n) + ' ' + cause;
    if (booted(s.result) || s.result == BootResult::none) return result;
    return result + " [result " + static_cast<char>(s.result) + ", " + to_string(s.result) + ']';
}

std::string sentence(const MasterSetup& setup, const NetworkStatus& s, const NodeStatus& of_node) {
    const auto node = std::ranges::find(setup.nodes, s.node, &NodeSetup::id);
    if (s.state == NetworkState::operational || s.state == NetworkState::off) {
        return std::string("the network is ") + to_string(s.state);
    }
    std::string result = std::string("the network is ") + to_string(s.state) + ": ";
    if (s.state == NetworkState::stopped) return result + "by command; 'start' boots it";
    if (node == setup.nodes.end()) return result + "cause unknown";
    const auto of = sentence(*node, of_node);
    const bool idle = of_node.step == Step::running && !of_node.operational;
    if (of.empty()) {
        result += node_name(*node) + " is ";
        result += idle ? to_string(of_node.state) : to_string(of_node.step);
    } else {
        result += of;
    }
    if (s.state == NetworkState::failed) {
        result += "; all nodes were stopped";
    } else if (of_node.step == Step::waiting) {
        result += "; retrying";
    }
    return result;
}

std::string progress(const NetworkStatus& s) {
    std::string result = std::string(to_string(s.state)) + ": " + std::to_string(s.operational) +
                         " of " + std::to_string(s.nodes);
    result += " nodes operational";
    if (s.booting != 0) {
        result += ", " + std::to_string(s.booting) + " booting";
    }
    if (s.failed != 0) {
        result += ", " + std::to_string(s.failed) + " failed or waiting";
    }
    return result;
}

std::vector<std::string> note_sentences(const NodeSetup& n, const NodeStatus& s) {
    std::vector<std::string> result;
    const auto add = [&](Note note, const std::string& what) {
        if ((s.notes & note) != 0) {
            result.push_back(node_name(n) + ' ' + what);
        }
    };
    add(note_guarded, "has no heartbeat producer (1017:0) and is supervised by node guarding");
    add(note_unsupervised, "is not supervised: its loss will not be detected");
    add(note_no_consumer, "has no free entry in 1016 and cannot detect the loss of the master");
    add(note_duplicate_id, "sends too many heartbeats: two devices may have this node ID");
    add(note_no_date, "has no usable 1020; its configuration is compared object by object");
    add(note_kept, "was already operational and was not reset");
    add(note_updated, "received a new program");
    return result;
}

}  // namespace hal::canopen
