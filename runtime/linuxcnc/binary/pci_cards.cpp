// SPDX-License-Identifier: MIT
// PCI cards, as sysfs shows them. The memory of a card is mapped from its file `resourceN`; who may
// open that file may use the card.
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <list>
#include <map>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

#include "linuxcnc/binary/module.hpp"

using namespace hal::modules;

namespace {

constexpr std::uint32_t any = 0xffffffff;
constexpr unsigned long is_memory = 0x200;  // IORESOURCE_MEM of the kernel's file `resource`

/// A card that a driver has accepted. The device is what the driver sees.
struct Card {
    halcyon_pci_driver* driver;
    const Module* module;
    halcyon_pci_device device;
};
std::list<Card> cards;  // a driver keeps pointers to its devices
std::map<const void*, std::size_t> mapped;

/// Where the kernel lists the cards; HALCYON_PCI names another folder, for a card that a test
/// makes.
std::string folder_of_cards() {
    const char* const other = std::getenv("HALCYON_PCI");
    return other && *other ? other : "/sys/bus/pci/devices";
}

unsigned long number_in(const std::filesystem::path& file) {
    std::ifstream text(file);
    std::string word;
    text >> word;
    return std::strtoul(word.c_str(), nullptr, 16);
}

bool describe(const std::filesystem::path& folder, halcyon_pci_device& device) {
    device = {};
    const std::string name = folder.filename().string();
    const std::string path = folder.string();
    if (name.size() >= sizeof device.name || path.size() >= sizeof device.path) return false;
    std::strcpy(device.name, name.c_str());
    std::strcpy(device.path, path.c_str());
    device.vendor = static_cast<std::uint16_t>(number_in(folder / "vendor"));
    device.device = static_cast<std::uint16_t>(number_in(folder / "device"));
    device.subvendor = static_cast<std::uint16_t>(number_in(folder / "subsystem_vendor"));
    device.subdevice = static_cast<std::uint16_t>(number_in(folder / "subsystem_device"));
    device.kind = static_cast<std::uint32_t>(number_in(folder / "class"));
    std::ifstream resources(folder / "resource");
    for (halcyon_pci_bar& bar : device.bars) {
        std::string start, end, flags;
        if (!(resources >> start >> end >> flags)) break;
        bar.start = static_cast<std::intptr_t>(std::strtoull(start.c_str(), nullptr, 16));
        bar.end = static_cast<std::intptr_t>(std::strtoull(end.c_str(), nullptr, 16));
        bar.flags = std::strtoul(flags.c_str(), nullptr, 16);
    }
    return true;
}

bool fits(const halcyon_pci_id& id, const halcyon_pci_device& device) {
    const auto same = [](std::uint32_t wanted, std::uint32_t is) {
        return wanted == any || wanted == is;
    };
    return same(id.vendor, device.vendor) && same(id.device, device.device) &&
           same(id.subvendor, device.subvendor) && same(id.subdevice, device.subdevice) &&
           ((id.kind ^ device.kind) & id.kind_mask) == 0;
}
bool ends(const halcyon_pci_id& id) {
    return id.vendor == 0 && id.device == 0 && id.subvendor == 0 && id.subdevice == 0 &&
           id.kind == 0;
}

const halcyon_pci_id* id_of(const halcyon_pci_driver& driver, const halcyon_pci_device& device) {
    for (const halcyon_pci_id* id = driver.ids; id && !ends(*id); ++id) {
        if (fits(*id, device)) return id;
    }
    return nullptr;
}

void unmap_bars(halcyon_pci_device& device) {
    for (halcyon_pci_bar& bar : device.bars) {
        if (bar.mapped) {
            rtapi_iounmap(bar.mapped);
        }
    }
}

}  // namespace

namespace hal::modules {

void release_cards(const Module& module) noexcept {
    for (auto card = cards.begin(); card != cards.end();) {
        if (card->module != &module) {
            ++card;
            continue;
        }
        unmap_bars(card->device);
        card = cards.erase(card);
    }
}

}  // namespace hal::modules

extern "C" {

// As in LinuxCNC, a driver without a card is an error, and a card that its driver declines is not.
int rtapi_pci_register_driver(halcyon_pci_driver* driver) {
    return guarded([&] {
        if (!driver || !driver->ids || !driver->probe) return -EINVAL;
        std::error_code none;
        std::map<std::string, std::filesystem::path> folders;  // in the order of their addresses
        for (const auto& entry : std::filesystem::directory_iterator(folder_of_cards(), none)) {
            folders.emplace(entry.path().filename().string(), entry.path());
        }
        int found = 0;
        for (const auto& [name, folder] : folders) {
            halcyon_pci_device device;
            if (!describe(folder, device)) continue;
            const halcyon_pci_id* const id = id_of(*driver, device);
            if (!id) continue;
            ++found;
            Card& card = cards.emplace_back(Card{driver, Module::current(), device});
            const int result = driver->probe(&card.device, id);
            if (result == 0) continue;
            rtapi_print_msg(RTAPI_MSG_ERR,
                            "%s: the card at %s is not used: its driver declines it (%d)\n",
                            driver->name ? driver->name : "", name.c_str(), result);
            unmap_bars(card.device);
            cards.pop_back();
        }
        if (found > 0) return 0;
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: no such card in %s\n", driver->name ? driver->name : "",
                        folder_of_cards().c_str());
        return -ENODEV;
    });
}

void rtapi_pci_unregister_driver(halcyon_pci_driver* driver) {
    for (auto card = cards.begin(); card != cards.end();) {
        if (card->driver != driver) {
            ++card;
            continue;
        }
        if (driver->remove) {
            driver->remove(&card->device);
        }
        unmap_bars(card->device);
        card = cards.erase(card);
    }
}

int rtapi_pci_enable_device(halcyon_pci_device* device) {
    return guarded([&] {
        const std::string file = std::string(device->path) + "/enable";
        const int enable = open(file.c_str(), O_RDWR | O_CLOEXEC);
        char state = '0';
        if (enable < 0) {
            const int why = errno;
            // enabled already, by the firmware or by a rule of udev
            const int read_only = open(file.c_str(), O_RDONLY | O_CLOEXEC);
            const bool on = read_only >= 0 && read(read_only, &state, 1) == 1 && state != '0';
            if (read_only >= 0) {
                close(read_only);
            }
            if (on) return 0;
            rtapi_print_msg(RTAPI_MSG_ERR, "%s: cannot open %s: %s\n", device->name, file.c_str(),
                            std::strerror(why));
            return -why;
        }
        const bool on = read(enable, &state, 1) == 1 && state != '0';
        const int result = on || pwrite(enable, "1", 1, 0) == 1 ? 0 : -errno;
        close(enable);
        return result;
    });
}
// it may have been enabled before, by another program
int rtapi_pci_disable_device(halcyon_pci_device*) { return 0; }

void* rtapi_pci_ioremap_bar(halcyon_pci_device* device, int number) {
    void* result = nullptr;
    guarded([&] {
        if (!device || number < 0 || number >= static_cast<int>(std::size(device->bars))) {
            return -EINVAL;
        }
        halcyon_pci_bar& bar = device->bars[number];
        const std::string file = std::string(device->path) + "/resource" + std::to_string(number);
        if ((bar.flags & is_memory) == 0 || bar.end <= bar.start) {
            rtapi_print_msg(RTAPI_MSG_ERR, "%s: region %d is not memory\n", device->name, number);
            return -EINVAL;
        }
        const int opened = open(file.c_str(), O_RDWR | O_SYNC | O_CLOEXEC);
        const auto bytes = static_cast<std::size_t>(bar.end - bar.start + 1);
        void* const memory =
            opened < 0 ? MAP_FAILED
                       : mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, opened, 0);
        const int why = errno;
        if (opened >= 0) {
            close(opened);
        }
        if (memory == MAP_FAILED) {
            rtapi_print_msg(RTAPI_MSG_ERR, "%s: cannot map %s: %s%s\n", device->name, file.c_str(),
                            std::strerror(why),
                            why == EACCES
                                ? "; a rule of udev can permit it (docs/linuxcnc-compatibility.md)"
                                : "");
            return -why;
        }
        mapped[memory] = bytes;
        bar.mapped = result = memory;
        return 0;
    });
    return result;
}

void rtapi_iounmap(void* address) {
    const auto known = mapped.find(address);
    if (known == mapped.end()) return;
    for (Card& card : cards) {
        for (halcyon_pci_bar& bar : card.device.bars) {
            if (bar.mapped == address) {
                bar.mapped = nullptr;
            }
        }
    }
    munmap(address, known->second);
    mapped.erase(known);
}
}
