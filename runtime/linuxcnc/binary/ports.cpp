// SPDX-License-Identifier: MIT
// Byte streams between two pins (type `port`). A module has a number for each of its port pins, 0
// is none; what it reads and writes by that number is the port of the signal that the pin is linked
// to. Modules of LinuxCNC 2.9 give the number, those of 2.10 a pointer to it.
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>

#include "linuxcnc/binary/module.hpp"

namespace hal::modules {

namespace {

constexpr int port_type = 5;
constexpr int in = 16;
constexpr int out = 32;

struct PortPin {
    hal_pin pin;
    volatile int number;  ///< what the module's pointer points to
    hal_port* own = nullptr;  ///< not a pin's: of hal_port_alloc()
};
std::array<std::atomic<PortPin*>, 256> pins{};  // number - 1; fixed, because threads read it

// what modules give; written while no function of a module runs that has ports
bool by_pointer = false;

hal_port* port_of(std::intptr_t given) noexcept {
    if (by_pointer && given == 0) return nullptr;
    const int number =
        by_pointer ? *reinterpret_cast<const volatile int*>(given) : static_cast<int>(given);
    if (number < 1 || number > static_cast<int>(pins.size())) return nullptr;
    const PortPin* const pin =
        pins[static_cast<std::size_t>(number) - 1].load(std::memory_order_acquire);
    if (!pin) return nullptr;
    if (pin->own) return pin->own;
    return pin->pin.slot->port;
}
std::uint32_t held_by(const hal_port& port) noexcept {
    return static_cast<std::uint32_t>(__atomic_load_n(&port.head, __ATOMIC_ACQUIRE) -
                                      __atomic_load_n(&port.tail, __ATOMIC_ACQUIRE));
}

int fail(const char* name, const char* why) {
    rtapi_print_msg(RTAPI_MSG_ERR, "hal_pin_port_new: '%s': %s\n", name ? name : "(null)", why);
    return -EINVAL;
}

std::size_t free_index() noexcept {
    std::size_t free = 0;
    while (free < pins.size() && pins[free].load(std::memory_order_relaxed)) {
        ++free;
    }
    return free;
}

}  // namespace

void take_ports_by_pointer(bool pointer) noexcept {
    if (by_pointer != pointer) {
        by_pointer = pointer;
    }
}

int new_port_pin(const char* name, int dir, void** slot, int comp) {
    if (const int wrong = declaring("hal_pin_port_new", name, comp); wrong != 0) return wrong;
    Module& module = *Module::current();
    if (!slot) return fail(name, "no pointer");
    if (dir != in && dir != out) {
        return fail(name, "invalid direction: a port has one writer and one reader");
    }
    const std::size_t free = free_index();
    if (free == pins.size()) {
        fail(name, "all modules together have at most 256 ports");
        return -ENOMEM;
    }
    if (!module.reserve_name(false, name)) return fail(name, "duplicate pin name");
    const hal_host* const host = module.host();
    void* const memory = host->allocate(host, sizeof(PortPin), alignof(PortPin));
    if (!memory) return -ENOMEM;
    PortPin* const made = new (memory) PortPin{{}, static_cast<int>(free) + 1};
    hal_pin_decl decl{};
    decl.size = sizeof decl;
    decl.type = HAL_TYPE_PORT;
    decl.dir = dir == in ? HAL_DIR_IN : HAL_DIR_OUT;
    decl.name = name;
    decl.doc = decl.unit = "";
    if (!host->pin(host, &decl, &made->pin)) return -EINVAL;
    module.ports.push_back(static_cast<int>(free) + 1);
    pins[free].store(made, std::memory_order_release);
    *slot = const_cast<int*>(&made->number);
    return 0;
}

namespace {

/// A buffer that belongs to no signal: a number for hal_port_read() and the like of the same
/// process. 0: none.
int new_buffer(unsigned size) {
    Module* const module = Module::current();
    const std::size_t free = free_index();
    const char* why = nullptr;
    if (!module) {
        why = "only while a module is loaded";
    } else if (size == 0) {
        why = "the size is 0";
    } else if (free == pins.size()) {
        why = "all modules together have at most 256 ports";
    }
    if (why) {
        rtapi_print_msg(RTAPI_MSG_ERR, "hal_port_alloc: %s\n", why);
        return 0;
    }
    const hal_host* const host = module->host();
    void* const memory = host->allocate(host, sizeof(PortPin) + sizeof(hal_port), alignof(PortPin));
    void* const data = host->allocate(host, size, 1);
    if (!memory || !data) return 0;
    PortPin* const made = new (memory) PortPin{{}, static_cast<int>(free) + 1};
    made->own = new (static_cast<char*>(memory) + sizeof(PortPin))
        hal_port{size, 0, 0, 0, static_cast<std::uint8_t*>(data)};
    module->ports.push_back(static_cast<int>(free) + 1);
    pins[free].store(made, std::memory_order_release);
    return static_cast<int>(free) + 1;
}

}  // namespace

void release_ports(Module& module) noexcept {
    for (const int number : module.ports) {
        pins[static_cast<std::size_t>(number) - 1].store(nullptr, std::memory_order_release);
    }
    module.ports.clear();
}

}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

int hal_pin_port_new(const char* name, int dir, void** slot, int comp) {
    return hal_pin_new(name, port_type, dir, slot, comp);
}
int hal_pin_port_newf(int dir, void** slot, int comp, const char* format, ...) {
    char name[256];
    va_list arguments;
    va_start(arguments, format);
    const int wrong =
        guarded([&] { return format_name(name, "hal_pin_port_new", format, arguments); });
    va_end(arguments);
    return wrong != 0 ? wrong : hal_pin_port_new(name, dir, slot, comp);
}

int hal_port_alloc(unsigned size) {
    int number = 0;
    guarded([&] { return number = new_buffer(size); });
    return number;
}

unsigned hal_port_buffer_size(std::intptr_t number) {
    const hal_port* const port = port_of(number);
    return port ? port->capacity : 0;
}
unsigned hal_port_readable(std::intptr_t number) {
    const hal_port* const port = port_of(number);
    return port ? held_by(*port) : 0;
}
unsigned hal_port_writable(std::intptr_t number) {
    const hal_port* const port = port_of(number);
    return port ? port->capacity - held_by(*port) : 0;
}
bool hal_port_peek(std::intptr_t number, char* to, unsigned count) {
    const hal_port* const port = port_of(number);
    if (!port || count == 0 || held_by(*port) < count) return false;
    for (std::uint64_t i = 0; i < count; ++i) {
        to[i] = static_cast<char>(port->data[(port->tail + i) % port->capacity]);
    }
    return true;
}
bool hal_port_peek_commit(std::intptr_t number, unsigned count) {
    hal_port* const port = port_of(number);
    if (!port || held_by(*port) < count) return false;
    __atomic_store_n(&port->tail, port->tail + count, __ATOMIC_RELEASE);
    return true;
}
bool hal_port_read(std::intptr_t number, char* to, unsigned count) {
    return hal_port_peek(number, to, count) && hal_port_peek_commit(number, count);
}
void hal_port_clear(std::intptr_t number) {
    hal_port_peek_commit(number, hal_port_readable(number));
}
bool hal_port_write(std::intptr_t number, const char* from, unsigned count) {
    hal_port* const port = port_of(number);
    if (!port || count == 0 || port->capacity - held_by(*port) < count) return false;
    for (std::uint64_t i = 0; i < count; ++i) {
        port->data[(port->head + i) % port->capacity] = static_cast<std::uint8_t>(from[i]);
    }
    __atomic_store_n(&port->head, port->head + count, __ATOMIC_RELEASE);
    return true;
}
}
