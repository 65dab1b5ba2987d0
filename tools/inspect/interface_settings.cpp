// SPDX-License-Identifier: MIT
#include "inspect/interface_settings.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <fstream>
#include <linux/ethtool.h>
#include <net/if.h>
#include <optional>
#include <string_view>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

std::string first_line(const fs::path& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    return line;
}

/// Returns the folder of an interface in sysfs; empty where sysfs shows those of another network
/// namespace.
fs::path class_folder(const std::string& name) {
    const fs::path folder = fs::path("/sys/class/net") / name;
    const bool same =
        first_line(folder / "ifindex") == std::to_string(::if_nametoindex(name.c_str()));
    return same ? folder : fs::path();
}

/// Returns IFF_UP, IFF_RUNNING and others; 0: no such interface.
unsigned flags_of(const std::string& interface) {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket < 0) return 0;
    ifreq request{};
    interface.copy(request.ifr_name, IFNAMSIZ - 1);
    const bool known = ::ioctl(socket, SIOCGIFFLAGS, &request) == 0;
    ::close(socket);
    return known ? static_cast<unsigned>(request.ifr_flags) : 0;
}

/// Returns what the driver answers to a structure of linux/ethtool.h; nullopt: it does not have
/// the setting.
template <class Structure>
std::optional<Structure> get(const std::string& name, unsigned command) {
    Structure structure{};
    structure.cmd = command;
    if (ask_driver(name, &structure) != 0) return std::nullopt;
    return structure;
}

template <class Structure>
InterfaceSetting changed(Finding finding, unsigned set, Structure now, Structure wanted) {
    return {std::move(finding), {SettingWrite::of(wanted, set)}, {SettingWrite::of(now, set)}};
}

Finding driver(const ExaminedInterface& interface) {
    const fs::path folder = class_folder(interface.name);
    const auto about = get<ethtool_drvinfo>(interface.name, ETHTOOL_GDRVINFO);
    const std::string name = about ? about->driver : "unknown";
    const std::string bus = about ? about->bus_info : "";  // "0000:02:00.0", "usb-0000:00:14.0-2"
    // Drivers that the IgH EtherCAT master has a version of its own of.
    static constexpr std::array<std::string_view, 9> proven{
        "8139too", "bcmgenet", "e100", "e1000", "e1000e", "igb", "igc", "r8169", "st_gmac"};
    static constexpr std::array<std::string_view, 6> of_guests{"virtio_net", "vmxnet3", "hv_netvsc",
                                                               "vif",        "ena",     "gve"};
    const auto is_in = [](std::string_view word, const auto& list) {
        return std::find(list.begin(), list.end(), word) != list.end();
    };
    if (!folder.empty() && fs::exists(folder / "phy80211")) {
        return {Verdict::poor, "driver", name + ": wireless, frames wait for the radio channel",
                "use a wired interface"};
    }
    if (bus.starts_with("usb-")) {
        return {Verdict::fair, "driver",
                name + ": a USB adapter, frames wait for the transfers of the USB host controller",
                "use an interface on PCI Express, or of the processor"};
    }
    if (name == "veth") {
        return {Verdict::fair, "driver",
                "veth: one end of a pair in memory, for tests; the thread ksoftirqd may receive "
                "its frames"};
    }
    if (is_in(name, of_guests)) {
        return {Verdict::fair, "driver",
                name + ": an interface of a virtual machine, the host forwards each frame",
                "pass a network card through to the guest"};
    }
    if (bus.empty() || bus == "N/A") {
        return {Verdict::fair, "driver",
                name + ": made by software (a bridge, bond, VLAN or tunnel), not a port",
                "name the port itself"};
    }
    if (is_in(name, proven)) {
        return {Verdict::good, "driver", name + ": in use with EtherCAT masters"};
    }
    return {Verdict::good, "driver", fmt::format("{} ({}): no known problem", name, bus)};
}

Finding link_speed(const ExaminedInterface& interface) {
    const unsigned flags = flags_of(interface.name);
    if ((flags & IFF_UP) == 0) {
        return {Verdict::poor, "link", "down",
                fmt::format("sudo ip link set {} up", interface.name)};
    }
    if ((flags & IFF_RUNNING) == 0) {
        return {Verdict::poor, "link", "no carrier",
                "check the cable, and that the device at its other end is switched on"};
    }
    const auto link = get<ethtool_cmd>(interface.name, ETHTOOL_GSET);
    const std::uint32_t speed = link ? ethtool_cmd_speed(&*link) : 0;
    if (speed == 0 || speed == static_cast<std::uint32_t>(SPEED_UNKNOWN)) {
        return {Verdict::good, "link", "with carrier, of unknown speed"};
    }
    const bool half = link->duplex == DUPLEX_HALF;
    const std::string text = fmt::format("{} Mbit/s, {} duplex", speed, half ? "half" : "full");
    if (half || speed < 100) {
        return {Verdict::poor, "link", text + ": EtherCAT needs 100 Mbit/s with full duplex",
                fmt::format("sudo ethtool -s {} autoneg on advertise 0x008", interface.name)};
    }
    return {Verdict::good, "link", text};
}

Finding other_traffic(const ExaminedInterface& interface) {
    if (!interface.has_address) {
        return {Verdict::good, "other traffic",
                "no IP address: the interface is for the bus alone"};
    }
    if (interface.is_udp) {
        return {Verdict::good, "other traffic",
                "an IP address, which the card needs; keep other programs off this network"};
    }
    return {Verdict::fair, "other traffic",
            "an IP address: frames of other programs delay those of the bus, 123 us each at 100 "
            "Mbit/s",
            fmt::format("sudo ip addr flush dev {}", interface.name)};
}

std::optional<InterfaceSetting> coalescing(const ExaminedInterface& interface) {
    const auto now = get<ethtool_coalesce>(interface.name, ETHTOOL_GCOALESCE);
    if (!now) return std::nullopt;
    ethtool_coalesce wanted = *now;
    wanted.rx_coalesce_usecs = wanted.tx_coalesce_usecs = 0;
    wanted.use_adaptive_rx_coalesce = wanted.use_adaptive_tx_coalesce = 0;
    const std::string text =
        fmt::format("receive {} us{}, send {} us{}", now->rx_coalesce_usecs,
                    now->use_adaptive_rx_coalesce ? " (adaptive)" : "", now->tx_coalesce_usecs,
                    now->use_adaptive_tx_coalesce ? " (adaptive)" : "");
    if (std::memcmp(&wanted, &*now, sizeof wanted) == 0) {
        return InterfaceSetting{{Verdict::good, "coalescing", "off: an interrupt for each frame"}};
    }
    std::string command = fmt::format("sudo ethtool -C {}", interface.name);
    command += now->use_adaptive_rx_coalesce ? " adaptive-rx off" : "";
    command += now->use_adaptive_tx_coalesce ? " adaptive-tx off" : "";
    command += now->rx_coalesce_usecs != 0 ? " rx-usecs 0" : "";
    command += now->tx_coalesce_usecs != 0 ? " tx-usecs 0" : "";
    return changed({Verdict::fair, "coalescing",
                    text + ": the interrupt of a received frame waits for this time", command},
                   ETHTOOL_SCOALESCE, *now, wanted);
}

/// A feature that is on or off, with requests of its own.
struct Offload {
    const char* subject;
    const char* option;  ///< of `ethtool -K`
    unsigned get, set;
    bool of_stream;  ///< delays only beside traffic by IP
};
constexpr std::array offloads{
    Offload{"gro", "gro", ETHTOOL_GGRO, ETHTOOL_SGRO, false},
    Offload{"gso", "gso", ETHTOOL_GGSO, ETHTOOL_SGSO, true},
    Offload{"tso", "tso", ETHTOOL_GTSO, ETHTOOL_STSO, true},
};

std::optional<InterfaceSetting> offload(const ExaminedInterface& interface, const Offload& kind) {
    const auto now = get<ethtool_value>(interface.name, kind.get);
    if (!now) return std::nullopt;
    if (now->data == 0) return InterfaceSetting{{Verdict::good, kind.subject, "off"}};
    ethtool_value wanted = *now;
    wanted.data = 0;
    Finding finding{Verdict::fair, kind.subject,
                    "on: the kernel collects received frames before it passes them on",
                    fmt::format("sudo ethtool -K {} {} off", interface.name, kind.option)};
    if (kind.of_stream) {
        finding.sentence = interface.has_address
                               ? "on: segments of TCP leave in bursts of up to 64 KiB, 5 ms at "
                                 "100 Mbit/s"
                               : "on: no effect without TCP on this interface";
        finding.verdict = interface.has_address ? Verdict::fair : Verdict::good;
        finding.remedy = interface.has_address ? finding.remedy : "";
    }
    return changed(finding, kind.set, *now, wanted);
}

std::optional<InterfaceSetting> large_receive(const ExaminedInterface& interface) {
    const auto now = get<ethtool_value>(interface.name, ETHTOOL_GFLAGS);
    if (!now || (now->data & ETH_FLAG_LRO) == 0) return std::nullopt;
    ethtool_value wanted = *now;
    wanted.data &= ~static_cast<unsigned>(ETH_FLAG_LRO);
    return changed({Verdict::fair, "lro", "on: the card collects received frames",
                    fmt::format("sudo ethtool -K {} lro off", interface.name)},
                   ETHTOOL_SFLAGS, *now, wanted);
}

std::optional<InterfaceSetting> energy(const ExaminedInterface& interface) {
    const auto now = get<ethtool_eee>(interface.name, ETHTOOL_GEEE);
    if (!now) return std::nullopt;
    if (now->eee_enabled == 0) return InterfaceSetting{{Verdict::good, "EEE", "off"}};
    ethtool_eee wanted = *now;
    wanted.eee_enabled = 0;
    return changed({Verdict::fair, "EEE",
                    "on: a link that saves energy wakes up for 16 to 30 us before a frame leaves",
                    fmt::format("sudo ethtool --set-eee {} eee off", interface.name)},
                   ETHTOOL_SEEE, *now, wanted);
}

std::optional<InterfaceSetting> pause_frames(const ExaminedInterface& interface) {
    const auto now = get<ethtool_pauseparam>(interface.name, ETHTOOL_GPAUSEPARAM);
    if (!now) return std::nullopt;
    if (now->rx_pause == 0 && now->tx_pause == 0) {
        return InterfaceSetting{{Verdict::good, "pause frames", "off"}};
    }
    ethtool_pauseparam wanted = *now;
    wanted.rx_pause = wanted.tx_pause = 0;
    return changed({Verdict::fair, "pause frames",
                    "on: the other end can stop frames, for up to 0.34 s at 100 Mbit/s",
                    fmt::format("sudo ethtool -A {} rx off tx off", interface.name)},
                   ETHTOOL_SPAUSEPARAM, *now, wanted);
}

std::optional<InterfaceSetting> queues(const ExaminedInterface& interface) {
    const auto now = get<ethtool_channels>(interface.name, ETHTOOL_GCHANNELS);
    if (!now || now->combined_count == 0) return std::nullopt;
    if (now->combined_count == 1) return InterfaceSetting{{Verdict::good, "queues", "1"}};
    ethtool_channels wanted = *now;
    wanted.combined_count = 1;
    return changed({Verdict::fair, "queues",
                    fmt::format("{}: frames that are sent from several CPUs can change their order",
                                now->combined_count),
                    fmt::format("sudo ethtool -L {} combined 1", interface.name)},
                   ETHTOOL_SCHANNELS, *now, wanted);
}

/// A file with a number of ns or interrupts by which the kernel postpones the handling of frames.
std::optional<InterfaceSetting> postponed(const ExaminedInterface& interface, const char* file,
                                          const char* effect) {
    const fs::path folder = class_folder(interface.name);
    const fs::path path = folder / file;
    const std::string now = folder.empty() ? "" : first_line(path);
    if (now.empty() || now == "0") return std::nullopt;
    SettingWrite wanted;
    wanted.file = path;
    SettingWrite before = wanted;
    wanted.text = "0\n";
    before.text = now + "\n";
    return InterfaceSetting{{Verdict::fair, file, fmt::format("{}: {}", now, effect),
                             fmt::format("echo 0 | sudo tee {}", path.string())},
                            {wanted},
                            {before}};
}

/// Returns the numbers of the interrupts of an interface.
std::vector<int> interrupts(const std::string& name) {
    std::vector<int> numbers;
    const fs::path folder = class_folder(name);
    if (folder.empty()) return numbers;
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(folder / "device" / "msi_irqs", failed)) {
        numbers.push_back(std::atoi(entry.path().filename().c_str()));
    }
    if (numbers.empty()) {  // a line interrupt
        const int number = std::atoi(first_line(folder / "device" / "irq").c_str());
        if (number > 0) numbers.push_back(number);
    }
    std::sort(numbers.begin(), numbers.end());
    return numbers;
}

/// Returns the CPUs that the interrupts may use and that none of the threads uses, as a list.
std::string free_cpus(const std::vector<int>& of_threads) {
    std::vector<int> all = cpus_of_list(first_line("/sys/devices/system/cpu/online"));
    std::erase_if(all, [&](int cpu) {
        return std::find(of_threads.begin(), of_threads.end(), cpu) != of_threads.end();
    });
    return fmt::format("{}", fmt::join(all, ","));
}

InterfaceSetting interrupt_affinity(const ExaminedInterface& interface) {
    const std::vector<int> numbers = interrupts(interface.name);
    if (numbers.empty()) {
        return {{Verdict::good, "interrupts", "none of its own"}};
    }
    if (interface.cpus.empty()) {
        return {{Verdict::fair, "interrupts",
                 fmt::format("{}; the CPU of the threads is unknown", fmt::join(numbers, ", ")),
                 fmt::format("hal doctor --interface {} --cpu N, with N from newthread or isolcpus",
                             interface.name)}};
    }
    InterfaceSetting setting;
    const std::string others = free_cpus(interface.cpus);
    std::vector<int> disturbing;
    for (const int number : numbers) {
        const std::string file = fmt::format("/proc/irq/{}/smp_affinity_list", number);
        const std::string now = first_line(file);
        const std::vector<int> allowed = cpus_of_list(now);
        const bool meets = std::any_of(allowed.begin(), allowed.end(), [&](int cpu) {
            return std::find(interface.cpus.begin(), interface.cpus.end(), cpu) !=
                   interface.cpus.end();
        });
        if (!meets) continue;
        disturbing.push_back(number);
        SettingWrite write;
        write.file = file;
        write.text = now + "\n";
        setting.restore.push_back(write);
        write.text = others + "\n";
        setting.change.push_back(write);
    }
    if (disturbing.empty()) {
        setting.finding = {Verdict::good, "interrupts",
                           fmt::format("{}, not on the CPUs of the threads ({})",
                                       fmt::join(numbers, ", "), fmt::join(interface.cpus, ", "))};
        return setting;
    }
    setting.finding = {Verdict::fair, "interrupts",
                       fmt::format("{} may interrupt the threads on CPU {}",
                                   fmt::join(disturbing, ", "), fmt::join(interface.cpus, ", "))};
    if (others.empty()) {  // every CPU has a thread
        setting.change.clear();
        setting.restore.clear();
        return setting;
    }
    setting.finding.remedy =
        fmt::format("sudo sh -c 'for i in {}; do echo {} > /proc/irq/$i/smp_affinity_list; done'",
                    fmt::join(disturbing, " "), others);
    setting.finding.then = "sudo systemctl disable --now irqbalance, where it runs";
    return setting;
}

}  // namespace

bool has_link(const std::string& interface) {
    constexpr unsigned wanted = IFF_UP | IFF_RUNNING;
    return (flags_of(interface) & wanted) == wanted;
}

std::vector<int> cpus_of_list(const std::string& list) {
    std::vector<int> cpus;
    const char* at = list.data();
    const char* const end = at + list.size();
    while (at < end) {
        int first = 0;
        const auto [after, failed] = std::from_chars(at, end, first);
        if (failed != std::errc()) break;
        int last = first;
        at = after;
        if (at < end && *at == '-') at = std::from_chars(at + 1, end, last).ptr;
        for (int cpu = first; cpu <= last; ++cpu) {
            cpus.push_back(cpu);
        }
        if (at < end) ++at;  // the comma
    }
    return cpus;
}

std::vector<InterfaceSetting> examine(const ExaminedInterface& interface) {
    std::vector<InterfaceSetting> all{
        {driver(interface)}, {link_speed(interface)}, {other_traffic(interface)}};
    const auto add = [&](std::optional<InterfaceSetting> setting) {
        if (setting) all.push_back(std::move(*setting));
    };
    add(coalescing(interface));
    for (const Offload& kind : offloads) {
        add(offload(interface, kind));
    }
    add(large_receive(interface));
    add(energy(interface));
    add(pause_frames(interface));
    add(queues(interface));
    add(postponed(interface, "gro_flush_timeout", "ns for which the kernel keeps received frames"));
    add(postponed(interface, "napi_defer_hard_irqs",
                  "polls before the kernel enables the interrupt again"));
    all.push_back(interrupt_affinity(interface));
    return all;
}

}  // namespace hal::tools
