// SPDX-License-Identifier: MIT
#include "node_status.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>

#include "canopen/protocol/emcy.hpp"

namespace hal::canopen {

const char* to_string(Step s) noexcept {
    switch (s) {
    case Step::off: return "off";
    case Step::queued: return "queued";
    case Step::resetting: return "resetting";
    case Step::identifying: return "identifying";
    case Step::checking_state: return "checking its state";
    case Step::checking_program: return "checking its program";
    case Step::updating: return "updating its program";
    case Step::restoring: return "restoring its defaults";
    case Step::configuring: return "configuring";
    case Step::saving: return "saving";
    case Step::watching: return "waiting for its heartbeat";
    case Step::ready: return "ready";
    case Step::starting: return "starting";
    case Step::running: return "running";
    case Step::waiting: return "waiting";
    case Step::failed: return "failed";
    case Step::stopped: return "stopped";
    }
    return "?";
}

const char* to_string(BootResult r) noexcept {
    switch (r) {
    case BootResult::none: return "not booted yet";
    case BootResult::good: return "booted";
    case BootResult::not_listed: return "not in the network list";
    case BootResult::no_answer: return "no answer";
    case BootResult::device_type: return "wrong device type";
    case BootResult::vendor: return "wrong vendor";
    case BootResult::no_heartbeat: return "no heartbeat while its state was checked";
    case BootResult::no_guarding: return "no answer to guarding";
    case BootResult::no_program: return "no program, or no objects for it";
    case BootResult::no_update: return "wrong program, and no update allowed";
    case BootResult::update: return "program download failed";
    case BootResult::configuration: return "configuration failed";
    case BootResult::watching: return "no heartbeat at the start of error control";
    case BootResult::was_operational: return "was operational already";
    case BootResult::product: return "wrong product";
    case BootResult::revision: return "wrong revision";
    case BootResult::serial: return "wrong serial number";
    }
    return "?";
}

const char* to_string(NetworkState s) noexcept {
    switch (s) {
    case NetworkState::off: return "off";
    case NetworkState::booting: return "booting";
    case NetworkState::operational: return "operational";
    case NetworkState::degraded: return "degraded";
    case NetworkState::stopped: return "stopped";
    case NetworkState::failed: return "failed";
    }
    return "?";
}

namespace {

template <class... T>
std::string print(const char* format, T... values) {
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(), format, values...);
    return text.data();
}
std::string hex(std::uint64_t value) {
    return print(value > 0xffffffff ? "%016llXh" : value > 0xffff ? "%08llXh" : "%04llXh", static_cast<unsigned long long>(value));
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
    if (s.write == 0 || s.write > n.writes.size() || n.writes[s.write - 1U].name.empty()) return result;
    return result + " (" + n.writes[s.write - 1U].name + ')';
}
std::string refusal(const NodeStatus& s) { return std::string(to_string(s.abort)) + print(" (%08lXh)", static_cast<unsigned long>(s.abort)); }

const char* identity(std::uint16_t index, std::uint8_t sub) {
    if (index == 0x1000) return "device type";
    constexpr std::array names{"vendor id", "product code", "revision number", "serial number"};
    return sub >= 1 && sub <= 4 ? names[sub - 1U] : "identity";
}

const char* flash_word(std::uint64_t status) {
    switch (status >> 1 & 0x7f) {
    case 1: return "no valid program";
    case 2: return "data format unknown";
    case 3: return "data format error or CRC error";
    case 4: return "flash not cleared before it was written";
    case 5: return "flash could not be written";
    case 6: return "address out of range";
    case 7: return "flash secured";
    default: return "unspecified error";
    }
}

const char* doing(Step s) {
    switch (s) {
    case Step::identifying: return "while it was identified";
    case Step::checking_state: return "while its state was checked";
    case Step::checking_program: return "while its program was checked";
    case Step::updating: return "while its program was updated";
    case Step::restoring: return "while its defaults were restored";
    case Step::saving: return "while it saved its configuration";
    case Step::watching: return "at the start of error control";
    default: return "while it was configured";
    }
}

std::string program(const NodeSetup& n, const NodeStatus& s) {
    if (s.index == 0x100a) return text(s.found) + " (100A:0) where " + text(s.expected) + " is expected";
    return hex(s.found) + print(" (1F56:%u) where ", unsigned{n.program.number}) + hex(s.expected) + " is expected";
}

std::string what(const NodeSetup& n, const NodeStatus& s) {
    const bool of_program = s.failed_in == Step::checking_program;
    switch (s.cause) {
    case Cause::none: return {};
    case Cause::silent:
        if (s.result == BootResult::no_answer)
            return "does not answer (" + object(n, s) +
                   "): check its power, cable, bit rate and node id; 'hal can scan' shows who is there";
        return "fell silent at " + object(n, s) + ' ' + doing(s.failed_in) + ": check its power and cable";
    case Cause::unsent:
        return "could not be asked for " + object(n, s) + ' ' + doing(s.failed_in) +
               ": the bus takes no frames from the master; check the master's cable, the bit rate, and that some node is there";
    case Cause::aborted:
        if (s.failed_in == Step::identifying)
            return "does not tell its " + std::string(identity(s.index, s.sub)) + ", " + object(n, s) + ": " + refusal(s) +
                   "; it is another device, or this is not to be checked";
        if (static_cast<std::uint32_t>(s.abort) >> 24 == 5)
            return "could not be talked to about object " + object(n, s) + ' ' + doing(s.failed_in) + ": " + refusal(s) +
                   "; something spoils its answers, or its SDO server is wrong";
        if (s.failed_in == Step::configuring)
            return "refuses " + hex(s.expected) + " for object " + object(n, s) + ": " + refusal(s) +
                   "; correct the value in its configuration or take the object out";
        return "refuses object " + object(n, s) + ' ' + doing(s.failed_in) + ": " + refusal(s);
    case Cause::differs:
        if (of_program) return "runs program " + program(n, s) + ", and may not be updated: update it by hand or allow the update";
        return "is another device: its " + std::string(identity(s.index, s.sub)) + " (" + object(n, s) + ") is " + hex(s.found) +
               " where " + hex(s.expected) + " is expected; fit the right one or correct its configuration";
    case Cause::not_taken:
        if (of_program) return "still runs program " + program(n, s) + ", though it was downloaded; check the file";
        return "took " + hex(s.expected) + " for object " + object(n, s) + " but holds " + hex(s.found) +
               "; write what it can hold, or take the object out";
    case Cause::doubled:
        return "is there twice: two devices answer with this id, " + object(n, s) + " is " + hex(s.expected) + " and " + hex(s.found) +
               "; give one of them another id";
    case Cause::restarting:
        return std::string("booted again and again ") + doing(s.failed_in) + ": check its supply voltage";
    case Cause::no_object: return "has no object " + object(n, s) + ", so its program cannot be checked or updated: set no program for it";
    case Cause::no_image: return "runs program " + program(n, s) + ", and there is no file to download: name one";
    case Cause::flash:
        return "reports for its flash: " + std::string(flash_word(s.found)) + " (" + object(n, s) + " is " + hex(s.found) +
               "); check that the file is for this device";
    case Cause::flash_busy: return "was busy with its flash for more than " + seconds(n.program.limit) + " (" + object(n, s) + ')';
    case Cause::heartbeat:
        return "sent no heartbeat " + std::string(s.failed_in >= Step::ready ? "for its limit" : doing(s.failed_in)) +
               ": check its power and cable";
    case Cause::guarding:
        return "did not answer guarding " + std::string(s.failed_in >= Step::ready ? "for its limit" : doing(s.failed_in)) +
               ": check its power and cable, and that it can be guarded";
    case Cause::guard_toggle:
        return "answered guarding with a toggle bit that did not change for its limit: its answers do not count; watch it by heartbeat, or "
               "look for two devices with this id";
    case Cause::boot_up: return "booted by itself: check its supply voltage, and who else commands this network";
    case Cause::left_operational: {
        std::string result = "left operational by itself and is " + std::string(to_string(s.state));
        if (s.emergency.code == 0) return result;
        return result + print("; its last emergency was %04Xh, ", unsigned{s.emergency.code}) + emergency_text(s.emergency.code);
    }
    case Cause::not_started:
        return "was told to start and is " + std::string(to_string(s.state)) +
               print("; its error register is %02Xh", unsigned{s.error_register});
    case Cause::commanded: return "was stopped by command";
    case Cause::network: return "was stopped because of another node";
    }
    return {};
}

}  // namespace

std::string sentence(const NodeSetup& n, const NodeStatus& s) {
    const auto cause = what(n, s);
    if (cause.empty()) return {};
    std::string result = node_name(n) + ' ' + cause;
    if (booted(s.result) || s.result == BootResult::none) return result;
    return result + " [result " + static_cast<char>(s.result) + ", " + to_string(s.result) + ']';
}

std::string sentence(const MasterSetup& setup, const NetworkStatus& s, const NodeStatus& of_node) {
    const auto node = std::ranges::find(setup.nodes, s.node, &NodeSetup::id);
    if (s.state == NetworkState::operational || s.state == NetworkState::off) return std::string("the network is ") + to_string(s.state);
    std::string result = std::string("the network is ") + to_string(s.state) + ": ";
    if (s.state == NetworkState::stopped) return result + "by command; 'start' boots it";
    if (node == setup.nodes.end()) return result + "no node is known to be the cause";
    const auto of = sentence(*node, of_node);
    const bool idle = of_node.step == Step::running && !of_node.operational;
    result += of.empty() ? node_name(*node) + " is " + (idle ? to_string(of_node.state) : to_string(of_node.step)) : of;
    if (s.state == NetworkState::failed) result += "; all nodes were stopped";
    else if (of_node.step == Step::waiting) result += "; it is tried again";
    return result;
}

std::string progress(const NetworkStatus& s) {
    std::string result = std::string(to_string(s.state)) + ": " + std::to_string(s.operational) + " of " + std::to_string(s.nodes);
    result += " nodes operational";
    if (s.booting != 0) result += ", " + std::to_string(s.booting) + " booting";
    if (s.failed != 0) result += ", " + std::to_string(s.failed) + " failed or waited for";
    return result;
}

std::vector<std::string> note_sentences(const NodeSetup& n, const NodeStatus& s) {
    std::vector<std::string> result;
    const auto say = [&](Note note, const std::string& what) {
        if ((s.notes & note) != 0) result.push_back(node_name(n) + ' ' + what);
    };
    say(note_guarded, "has no heartbeat (1017:0) and is guarded instead");
    say(note_unwatched, "is not watched: its loss will not be noticed");
    say(note_no_consumer, "has no free entry in 1016 and does not notice when the master is gone");
    say(note_doubled, "sends more heartbeats than it should: two devices may have this id");
    say(note_no_date, "has no usable 1020, so its configuration is compared object by object");
    say(note_kept, "was operational already and was not touched");
    say(note_updated, "got a new program");
    return result;
}

}  // namespace hal::canopen
