// SPDX-License-Identifier: MIT
// I/O ports of the PC. Modules access them by machine code, which the kernel permits thread by
// thread, to those with CAP_SYS_RAWIO.
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <linux/ppdev.h>
#include <map>
#include <string>
#include <sys/ioctl.h>
#include <unistd.h>
#if defined(__x86_64__) || defined(__i386__)
#include <sys/io.h>
#endif

#include "hal/privilege.hpp"
#include "linuxcnc/binary/module.hpp"

using namespace hal::modules;

namespace {

std::map<int, const Module*> claims;  // open files of the kernel's ports
thread_local bool permitted __attribute__((tls_model("initial-exec"))) = false;

int permit_all() noexcept {
#if defined(__x86_64__) || defined(__i386__)
    return iopl(3) == 0 ? 0 : errno;
#else
    return ENODEV;
#endif
}

std::string explanation(int why) {
    if (why == ENODEV) return "this processor has no I/O ports";
    if (why == ENOSYS) {
        return "this kernel permits no program to access I/O ports (it is built without "
               "CONFIG_X86_IOPL_IOPERM)";
    }
    const std::string command = hal::grant_command(hal::privilege::raw_io);
    return "access to I/O ports needs the capability CAP_SYS_RAWIO; " +
           std::string(hal::privilege::withheld() ? "" : "type: ") + command;
}

/// The kernel's parallel port: `name` is parport0 …
struct KernelPort {
    std::string name;
    unsigned short base = 0;
    unsigned short base_hi = 0;
};

/// Finds the kernel's port of this number, or at this address.
bool find(unsigned short base, KernelPort& port) {
    for (int number = 0; number < 16; ++number) {
        const std::string name = "parport" + std::to_string(number);
        std::ifstream text("/proc/sys/dev/parport/" + name + "/base-addr");
        unsigned long low = 0;
        unsigned long high = 0;
        if (!(text >> low)) continue;
        text >> high;
        if (base == number || base == low) {
            port = {name, static_cast<unsigned short>(low), static_cast<unsigned short>(high)};
            return true;
        }
    }
    return false;
}

/// What to type after an attempt to claim a port has failed, with a separator before it.
const char* remedy_of(int error) {
    switch (error) {
    case EACCES: return "; type: sudo usermod -aG lp $USER, and log in again";
    case ENOENT: return "; type: sudo modprobe ppdev";
    default: return "";
    }
}

}  // namespace

namespace hal::modules {

int permit_ports() noexcept {
    if (permitted) return 0;
    const int why = permit_all();
    permitted = why == 0;
    return why;
}

void release_claims(const Module& module) noexcept {
    for (auto claim = claims.begin(); claim != claims.end();) {
        const auto here = claim++;
        if (here->second != &module) continue;
        ioctl(here->first, PPRELEASE);
        close(here->first);
        claims.erase(here);
    }
}

}  // namespace hal::modules

extern "C" {

int rtapi_parport_get(const char* name, halcyon_parport* port, unsigned short base,
                      unsigned short base_hi, unsigned modes) {
    return guarded([&] {
        const char* const who = name ? name : "";
        *port = {base, base_hi, -1};
        if (const int why = permit_ports()) {
            rtapi_print_msg(RTAPI_MSG_ERR, "%s: parallel port at 0x%x: %s\n", who, base,
                            explanation(why).c_str());
            return -why;
        }
        if (Module* const module = Module::current()) {
            module->accesses_ports = true;
        }
        KernelPort known;
        if (!find(base, known)) {
            if (base >= 16) {
                return 0;  // a card that the kernel does not know
            }
            rtapi_print_msg(
                RTAPI_MSG_ERR,
                "%s: the kernel has no parallel port %u; give the address, as in cfg=\"0x378\"\n",
                who, base);
            return -ENOENT;
        }
        const std::string file = "/dev/" + known.name;
        port->fd = open(file.c_str(), O_RDWR | O_CLOEXEC);
        if (port->fd < 0 || ioctl(port->fd, PPCLAIM) != 0) {
            const int why = errno;
            rtapi_print_msg(RTAPI_MSG_ERR, "%s: cannot claim %s: %s%s\n", who, file.c_str(),
                            std::strerror(why), remedy_of(why));
            rtapi_parport_release(port);
            return -why;
        }
        claims[port->fd] = Module::current();
        unsigned possible = ~0U;
        if (ioctl(port->fd, PPGETMODES, &possible) == 0 && (possible & modes) != modes) {
            rtapi_print_msg(RTAPI_MSG_WARN, "%s: %s does not have all of the modes 0x%x\n", who,
                            file.c_str(), modes);
        }
        port->base = known.base;
        port->base_hi = known.base_hi;
        return 0;
    });
}

void rtapi_parport_release(halcyon_parport* port) {
    if (!port || port->fd < 0) return;
    ioctl(port->fd, PPRELEASE);
    close(port->fd);
    claims.erase(port->fd);
    port->fd = -1;
}

// Without the permission the access is a crash, which names the function; the message has the
// reason.
void rtapi_outb([[maybe_unused]] unsigned char byte, unsigned number) {
    if (const int why = permit_ports(); why != 0) {
        rtapi_print_msg(RTAPI_MSG_ERR, "rtapi_outb: port 0x%x: %s\n", number,
                        in_cycle ? std::strerror(why) : explanation(why).c_str());
    }
#if defined(__x86_64__) || defined(__i386__)
    outb(byte, static_cast<unsigned short>(number));
#else
    std::abort();
#endif
}
unsigned char rtapi_inb(unsigned number) {
    if (const int why = permit_ports(); why != 0) {
        rtapi_print_msg(RTAPI_MSG_ERR, "rtapi_inb: port 0x%x: %s\n", number,
                        in_cycle ? std::strerror(why) : explanation(why).c_str());
    }
#if defined(__x86_64__) || defined(__i386__)
    return inb(static_cast<unsigned short>(number));
#else
    std::abort();
#endif
}
}
