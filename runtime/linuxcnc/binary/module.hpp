// SPDX-License-Identifier: MIT
// One LinuxCNC module: its file, its code while it is loaded, and what it has declared. Setup calls
// come one at a time, under the session's lock; a module has static variables, so it is loaded once
// per process.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <new>
#include <set>
#include <string>
#include <vector>

#include "hal/modules.h"
#include "linuxcnc/binary/elf_file.hpp"
#include "linuxcnc/binary/interface.hpp"
#include "linuxcnc/binary/module_host.hpp"
#include "linuxcnc/binary/parameters.hpp"
#include "linuxcnc/binary/rtapi_interface.hpp"
#include "linuxcnc/binary/segments.hpp"

namespace hal::modules {

class Module;

/// The cycle in which the thread runs a function of a module; valid while in_cycle, and not in a
/// task of a module's own.
extern constinit thread_local const hal_cycle* cycle_now __attribute__((tls_model("initial-exec")));

/// A function of a module, in memory of the instance.
struct Function {
    void (*code)(void*, long);
    void* arg;
    Module* module;
    // Parameters that are copied before and after each call: those in the memory that `arg` points
    // to. Those of no function are copied by all functions.
    Parameter* const* own = nullptr;
    std::size_t own_count = 0;
    std::size_t calls = 0;
};

class Module {
    struct Shown {
        halcyon_module shown;  ///< first
        Module* owner;
    };

public:
    Module(std::string folder, std::string name, ElfFile file);
    Module(const Module&) = delete;

    const halcyon_module& description() const { return description_.shown; }
    /// The module behind a description that description() gave.
    static Module& of(const halcyon_module& description) {
        return *reinterpret_cast<const Shown&>(description).owner;
    }
    const std::string& name() const { return name_; }
    bool running() const { return running_; }
    bool broken() const { return broken_; }
    bool uses(const Module& other) const { return uses_.contains(&other); }
    Interface interface() const { return interface_; }

    /// Maps the code, takes the arguments and runs rtapi_app_main(). Returns false after reporting;
    /// then nothing remains of it.
    bool create(const hal_host* host, const hal_modules& extension, const hal_module_calls& calls);
    /// Prints what the module has printed while it was created.
    void start();
    /// Runs rtapi_app_exit() and unmaps the code: that of modules that use this one first.
    void destroy();

    // --- for the functions of the interface ------------------------------------------------------
    /// The module that create() is running for; nullptr: none.
    static Module* current();
    static const std::vector<Module*>& all_running();
    /// The module whose rtapi_app_exit() runs: its functions are in no thread any more; nullptr:
    /// none.
    static Module* unloading();
    const hal_host* host() const { return host_; }
    const hal_modules& extension() const { return *extension_; }
    const hal_module_calls& calls() const { return *calls_; }
    void* machine() const { return machine_; }
    /// True when its functions are called without anything around them: it has no parameters and
    /// accesses no ports.
    bool plain() const noexcept { return plain_; }
    /// Returns false for a name that the module has used already.
    bool reserve_name(bool parameter, const std::string& name) {
        return names_[parameter].insert(name).second;
    }
    bool has_pin(const std::string& name) const { return names_[false].contains(name); }
    /// Whether its file uses the symbol.
    bool imports(const char* symbol) const;
    /// A thread of it cannot be ended: its code and what its pointers lead to must stay.
    void keep_for_good() noexcept;

    ModuleParameters parameters;
    std::vector<Function*> declared;
    /// ids that it has from hal_init() and rtapi_init() and has not given back
    std::set<int> components;
    std::set<std::string> functions;
    std::vector<hal_value**> slots;  ///< its pointers to values of pins
    std::vector<int> ports;  ///< numbers of its port pins
    bool accesses_ports = false;  ///< its functions need what permit_ports() gives

private:
    void note_broken() noexcept;
    void find_neighbours();
    bool fits_the_others();
    void explain_loading(std::string problem) const;
    bool run_main();
    void announce_memory();
    void release();

    std::string name_, path_, folder_, summary_, doc_;
    ElfFile file_;
    struct Described {
        std::string name, doc;
    };
    std::vector<std::unique_ptr<Described>> texts_;
    std::vector<halcyon_module_parameter> described_;
    Shown description_{};
    std::set<const Module*> uses_;
    std::vector<std::unique_ptr<char[]>> strings_;  // values of text parameters
    std::set<std::string> names_[2];  // of pins and of parameters
    void* library_ = nullptr;
    const hal_host* host_ = nullptr;
    const hal_modules* extension_ = nullptr;
    const hal_module_calls* calls_ = nullptr;
    void* machine_ = nullptr;
    Interface interface_ = Interface::any;
    bool running_ = false;
    bool broken_ = false;
    bool plain_ = false;
};

/// Runs an action for a module. An exception must not cross its C frames. Returns a negative errno
/// for one.
template <class Action>
int guarded(Action action) noexcept {
    try {
        return action();
    } catch (const std::bad_alloc&) {
        return -12;  // ENOMEM
    } catch (...) {
        return -22;  // EINVAL
    }
}

/// Runs `action` so that a crash in it returns the signal's number; 0: it has returned. Not nested.
/// [setup]
int run_guarded_from_crashes(void (*action)(void*), void* argument) noexcept;
const char* crash_text(int signal) noexcept;

/// io_ports.cpp: permits this thread to access I/O ports, once. Returns 0 or the errno. [any]
int permit_ports() noexcept;

/// tasks.cpp: ends the tasks of a module. A task that does not end is reported, and its module
/// keeps what it needs.
void release_tasks(Module& module) noexcept;
/// The name of the module whose task the calling thread runs, or nullptr. [any]
const char* module_of_task() noexcept;
/// pll.cpp: a module that adjusts the clock of the threads takes it, if no other has it.
void take_clock(Module& module, const hal_host* host);
void release_clock(const Module& module) noexcept;
/// Before a function of a module with the clock: what is to be added to each period. [realtime]
void adjust_clock(const Module& module, const hal_cycle& cycle) noexcept;
/// system.cpp: lets the machine note the cycle counter of the processor where a module reads it.
/// [setup]
void take_readings(const hal_module_calls& calls);

/// components.cpp: forgets the ids of a module, and with the last module the memory of
/// hal_malloc().
void release_components(Module& module) noexcept;
/// machine_calls.cpp: carries out a command of the machine, given as its words up to a null
/// pointer, in the transaction that loads the current module. Returns 0, or a negative errno after
/// printing why.
int give_command(const char* function, const char* command,
                 std::initializer_list<const char*> words);
/// The period as a multiple of what rtapi_clock_set_period() has set.
std::uint64_t clock_multiple(std::uint64_t period_ns) noexcept;
/// An id that no other has.
int new_id() noexcept;
/// True if the id is one that the module has from hal_init() or rtapi_init().
bool is_id_of(const Module& module, int id);
/// Returns 0 if the component may declare something of that name, else a negative errno after
/// printing why.
int declaring(const char* function, const char* name, int comp);
/// pins.cpp: a pin or a parameter whose value is the runtime's; the pointer at `slot` leads to it.
/// 0, or a negative errno after printing why.
int new_slot(const char* function, bool parameter, const char* name, int type, int dir, void** slot,
             hal_value initial, int comp);
/// Formats a name. 0, or a negative errno after printing that it is too long.
int format_name(char (&name)[256], const char* function, const char* format, va_list arguments);
/// What a name may have in the module that is being created: 47 characters, or 55 in LinuxCNC 2.10.
/// [setup]
std::size_t longest_name() noexcept;
std::string too_long();
/// pci_cards.cpp, io_ports.cpp: gives back what a module has not, because it failed: its cards
/// without their remove function, its claims.
void release_cards(const Module& module) noexcept;
void release_claims(const Module& module) noexcept;
/// ports.cpp: modules give a port by its number (2.9) or by a pointer to the number (2.10). No
/// function of a module runs. [setup]
void take_ports_by_pointer(bool pointer) noexcept;
int new_port_pin(const char* name, int dir, void** slot, int comp);
/// Forgets the port pins of a module.
void release_ports(Module& module) noexcept;
/// The memory of hal_malloc() stays, even when no module is left.
void keep_memory() noexcept;
/// The block of hal_malloc() that contains the address: its end; 0: none.
std::uintptr_t end_of_block(const volatile void* address) noexcept;
/// Sets up what the modules share, before the first one is mapped. Returns false when out of
/// memory.
bool prepare_memory() noexcept;

}  // namespace hal::modules
