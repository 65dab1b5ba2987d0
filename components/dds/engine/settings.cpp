// SPDX-License-Identifier: MIT
#include "settings.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <filesystem>
#include <mutex>
#include <stdexcept>

#include "leftovers.hpp"
#include "participant.hpp"

namespace hal::dds {
namespace {

using namespace eprosima;
using fastdds::dds::DomainParticipantQos;
using fastrtps::rtps::IPLocator;
using fastrtps::rtps::Locator_t;

[[noreturn]] void reject(const std::string& why) { throw std::runtime_error(why); }

bool is_address(const std::string& text) {
    in_addr to{};
    return inet_pton(AF_INET, text.c_str(), &to) == 1;
}

/// Addresses of this machine's interfaces by name; all names and addresses go to `known`.
std::vector<std::string> addresses_of(const std::string& interface, std::string& known) {
    ifaddrs* list = nullptr;
    if (getifaddrs(&list) != 0) {
        reject("cannot list the network interfaces of this machine");
    }
    std::vector<std::string> found;
    for (const ifaddrs* i = list; i != nullptr; i = i->ifa_next) {
        if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
        char text[INET_ADDRSTRLEN] = "";
        inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr, text,
                  sizeof text);
        if (interface == i->ifa_name || interface == text) {
            found.emplace_back(text);
        }
        known += std::string(known.empty() ? "" : ", ") + i->ifa_name + " (" + text + ")";
    }
    freeifaddrs(list);
    return found;
}

/// "192.168.1.7:11811"
Locator_t address_and_port(const std::string& text, const char* what) {
    const auto colon = text.find(':');
    std::uint16_t port = 0;
    const std::string address = text.substr(0, colon);
    if (colon != text.npos) {
        std::from_chars(text.data() + colon + 1, text.data() + text.size(), port);
    }
    if (!is_address(address) || port == 0) {
        reject(std::string(what) + "=" + text +
               ": expected ADDRESS:PORT, for example 192.168.1.7:11811");
    }
    Locator_t to;
    IPLocator::setIPv4(to, address);
    to.port = port;
    return to;
}

void transports(DomainParticipantQos& qos, const Settings& s) {
    const auto udp = std::make_shared<fastdds::rtps::UDPv4TransportDescriptor>();
    // participants per machine that are found without multicast; ROS 2 has the same number
    udp->maxInitialPeersRange = 32;
    const bool all = s.interfaces.size() == 1 && s.interfaces[0] == "all";
    if (s.interfaces.empty()) {
        udp->interfaceWhiteList.emplace_back("127.0.0.1");
    }
    for (const std::string& i : s.interfaces) {
        if (all) break;
        std::string known;
        const auto found = addresses_of(i, known);
        if (found.empty()) {
            reject("interfaces: unknown interface or address '" + i + "'; this machine has " +
                   known);
        }
        udp->interfaceWhiteList.insert(udp->interfaceWhiteList.end(), found.begin(), found.end());
    }
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    if (!s.shared_memory) return;
    remove_leftovers();
    qos.transport().user_transports.push_back(
        std::make_shared<fastdds::rtps::SharedMemTransportDescriptor>());
}

void discovery(DomainParticipantQos& qos, const Settings& s) {
    auto& builtin = qos.wire_protocol().builtin;
    auto& config = builtin.discovery_config;
    // after this a killed process is removed; the validity of topics does not depend on it
    config.leaseDuration = {static_cast<std::int32_t>(participant_lease_ns / 1'000'000'000), 0};
    config.leaseDuration_announcementperiod = {1, 0};
    config.initial_announcements.count = 10;
    config.initial_announcements.period = {0, 50'000'000};
    builtin.typelookup_config.use_client = builtin.typelookup_config.use_server = false;
    if (!s.servers.empty()) {
        config.discoveryProtocol = fastrtps::rtps::DiscoveryProtocol_t::CLIENT;
        for (std::size_t i = 0; i < s.servers.size(); ++i) {
            fastdds::rtps::RemoteServerAttributes server;
            // of the server with the id i, as `fast-discovery-server -i` makes it
            char prefix[64];
            std::snprintf(prefix, sizeof prefix, "44.53.%02zx.5f.45.50.52.4f.53.49.4d.41", i);
            server.ReadguidPrefix(prefix);
            server.metatrafficUnicastLocatorList.push_back(
                address_and_port(s.servers[i], "server"));
            config.m_DiscoveryServers.push_back(server);
        }
        return;
    }
    // The multicast group of DDSI-RTPS 2.3, 9.6.1.4, and this machine without it: a loopback may
    // have no multicast.
    Locator_t group, own;
    IPLocator::setIPv4(group, "239.255.0.1");
    group.port = static_cast<std::uint32_t>(7400 + 250 * s.domain);
    IPLocator::setIPv4(own, "127.0.0.1");
    own.port = 0;
    builtin.initialPeersList.push_back(group);
    builtin.initialPeersList.push_back(own);
    for (const std::string& p : s.peers) {
        if (!is_address(p)) {
            reject("peers: invalid address '" + p + "'; write one like 192.168.1.7");
        }
        Locator_t to;
        IPLocator::setIPv4(to, p);
        to.port = 0;
        builtin.initialPeersList.push_back(to);
    }
}

void security(DomainParticipantQos& qos, const Settings& s) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::absolute(s.security);
    if (!fs::is_directory(folder)) {
        reject("security: no such folder: " + folder.string());
    }
    const auto file = [&](const char* name) {
        const fs::path path = folder / name;
        if (!fs::is_regular_file(path)) {
            reject("security: missing file " + path.string() +
                   "; the folder needs identity_ca.cert.pem, cert.pem, key.pem, "
                   "permissions_ca.cert.pem, governance.p7s and permissions.p7s (a ROS 2 enclave)");
        }
        return "file://" + path.string();
    };
    auto& to = qos.properties().properties();
    to.emplace_back("dds.sec.auth.plugin", "builtin.PKI-DH");
    to.emplace_back("dds.sec.auth.builtin.PKI-DH.identity_ca", file("identity_ca.cert.pem"));
    to.emplace_back("dds.sec.auth.builtin.PKI-DH.identity_certificate", file("cert.pem"));
    to.emplace_back("dds.sec.auth.builtin.PKI-DH.private_key", file("key.pem"));
    to.emplace_back("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
    to.emplace_back("dds.sec.access.plugin", "builtin.Access-Permissions");
    to.emplace_back("dds.sec.access.builtin.Access-Permissions.permissions_ca",
                    file("permissions_ca.cert.pem"));
    to.emplace_back("dds.sec.access.builtin.Access-Permissions.governance", file("governance.p7s"));
    to.emplace_back("dds.sec.access.builtin.Access-Permissions.permissions",
                    file("permissions.p7s"));
}

/// Prints what Fast DDS logs.
class LogForwarder : public fastdds::dds::LogConsumer {
public:
    void Consume(const fastdds::dds::Log::Entry& entry) override {
        std::string line = entry.message;
        while (!line.empty() && line.back() == '\n') {
            line.pop_back();
        }
        const std::string source =
            std::string("Fast DDS, ") + (entry.context.category ? entry.context.category : "?");
        engine_log().print(hal::MessageSubject{source, hal::MessageLog::without_numbers(line)},
                           line + " (" + source + ")");
    }
};

}  // namespace

void prepare_library() {
    static std::once_flag once;
    std::call_once(once, [] {
        // DEFAULT_FASTRTPS_PROFILES.xml in the current folder would be read silently
        setenv("SKIP_DEFAULT_XML_FILE", "1", 0);
        unsetenv("FASTRTPS_DEFAULT_PROFILES_FILE");
        fastdds::dds::Log::ClearConsumers();
        fastdds::dds::Log::SetVerbosity(fastdds::dds::Log::Kind::Error);
        fastdds::dds::Log::RegisterConsumer(std::make_unique<LogForwarder>());
    });
}

hal::MessageLog& engine_log() {
    // never destroyed: Fast DDS logs until the end of the process
    static hal::MessageLog& log = *new hal::MessageLog("dds");
    return log;
}

DomainParticipantQos participant_qos(const Settings& s) {
    if (s.domain < 0 || s.domain > 232) {
        reject("domain=" + std::to_string(s.domain) + " is outside 0..232");
    }
    DomainParticipantQos qos = fastdds::dds::PARTICIPANT_QOS_DEFAULT;
    if (s.profile.empty()) {
        transports(qos, s);
        discovery(qos, s);
    } else {
        const auto colon = s.profile.rfind(':');
        const std::string file = s.profile.substr(0, colon);

        const std::string name = colon == s.profile.npos ? "halcyon" : s.profile.substr(colon + 1);
        auto* factory = fastdds::dds::DomainParticipantFactory::get_instance();
        if (!std::filesystem::is_regular_file(file)) {
            reject("profile: no such file: " + file);
        }
        if (!(factory->load_XML_profiles_file(file) == fastrtps::types::ReturnCode_t::RETCODE_OK)) {
            reject("profile: Fast DDS cannot read " + file + "; see its own message");
        }
        if (!(factory->get_participant_qos_from_profile(name, qos) ==
              fastrtps::types::ReturnCode_t::RETCODE_OK)) {
            reject("profile: " + file + " has no participant profile '" + name +
                   "'; write profile=" + file + ":NAME");
        }
    }
    if (!s.security.empty()) {
        security(qos, s);
    }
    if (!s.name.empty()) {
        qos.name(s.name);
    }
    if (!s.user_data.empty()) {
        qos.user_data().setValue(
            std::vector<fastrtps::rtps::octet>(s.user_data.begin(), s.user_data.end()));
    }
    return qos;
}

}  // namespace hal::dds
