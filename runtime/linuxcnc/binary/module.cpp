// SPDX-License-Identifier: MIT
#include "linuxcnc/binary/module.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>

#include "linuxcnc/binary/arguments.hpp"
#include "linuxcnc/binary/messages.hpp"

namespace hal::modules {

constinit thread_local bool in_cycle __attribute__((tls_model("initial-exec"))) = false;
constinit thread_local const hal_cycle* cycle_now __attribute__((tls_model("initial-exec"))) =
    nullptr;
const bool runs_modules = true;

namespace {

// of the thread that loads or unloads
constinit thread_local Module* constructing __attribute__((tls_model("initial-exec"))) = nullptr;
constinit thread_local Module* exiting __attribute__((tls_model("initial-exec"))) = nullptr;
std::vector<Module*> running_modules;  // in the order of loading
// of modules whose code stays mapped, with the values of its variables
std::set<std::string> broken_names;

constexpr const char* info = "rtapi_info_";

bool create_instance(const hal_host* host, void* memory) {
    const auto* const extension =
        static_cast<const hal_modules*>(host->extension(host, HAL_MODULES));
    const auto* const calls =
        static_cast<const hal_module_calls*>(host->extension(host, HAL_MODULE_CALLS));
    if (!extension || extension->size < sizeof *extension || !calls ||
        calls->size < sizeof *calls) {
        host->fail(host, "this host cannot run LinuxCNC's modules");
        return false;
    }
    // the description is the first member of what the module owns
    const auto* const description =
        reinterpret_cast<const halcyon_module*>(extension->component(host));
    return guarded([&] {
        for (Module* const other : running_modules) {
            if (other->name() == description->component.name) {
                host->fail(host,
                           "it is still loaded: an unload in the same transaction takes "
                           "effect at its end");

                return 0;
            }
        }
        Module& module = Module::of(*description);
        *static_cast<Module**>(memory) = &module;
        return module.create(host, *extension, *calls) ? 1 : 0;
    }) == 1;
}
bool start_instance(void* memory, const hal_host* host) {
    Module& module = **static_cast<Module**>(memory);
    module.start();
    return guarded([&] {
        take_clock(module, host);
        return 0;
    }) == 0;
}
void stop_instance(void*) {}
void destroy_instance(void* memory) { (*static_cast<Module**>(memory))->destroy(); }

/// "component:TEXT" and the like: what the module's author wrote for its manual page.
struct Record {
    std::string key, text;
};
std::vector<Record> records_of(const ElfFile& file) {
    std::map<long, Record> by_line;
    const std::string prefix = std::string(info) + "linuxcnc_";
    for (const auto& [symbol, address] : file.defined()) {
        if (!symbol.starts_with(prefix)) continue;
        const std::string text = file.text_of(symbol);
        const auto colon = text.find(':');
        if (colon != text.npos) {
            by_line[std::strtol(symbol.c_str() + prefix.size(), nullptr, 10)] = {
                text.substr(0, colon), text.substr(colon + 1)};
        }
    }
    std::vector<Record> records;
    for (auto& [line, record] : by_line) {
        records.push_back(std::move(record));
    }
    return records;
}

}  // namespace

/// Describes a compiled module by what its file states: parameters, summary, author, license. No
/// code of the module runs.
Module::Module(std::string folder, std::string name, ElfFile file)
    : name_(std::move(name)),
      path_(folder + "/" + name_ + ".so"),
      folder_(std::move(folder)),
      file_(std::move(file)) {
    const std::string type = std::string(info) + "type_";
    for (const auto& [symbol, address] : file_.defined()) {
        if (!symbol.starts_with(type)) continue;
        const std::string parameter = symbol.substr(type.size());
        const std::string kind = file_.text_of(symbol);
        if (kind.size() != 1 || !std::strchr("ils", kind[0]) ||
            !file_.defines(std::string(info) + "address_" + parameter)) {
            continue;
        }
        texts_.push_back(std::make_unique<Described>(
            Described{parameter, file_.text_of(std::string(info) + "description_" + parameter)}));
        described_.push_back({texts_.back()->name.c_str(), texts_.back()->doc.c_str(), kind[0],
                              file_.number_of(std::string(info) + "size_" + parameter, 0)});
    }
    summary_ = "LinuxCNC module";
    for (const Record& record : records_of(file_)) {
        if (record.key == "component") {
            const auto colon = record.text.find(':');
            const std::string text = colon == record.text.npos ? "" : record.text.substr(colon + 1);
            if (!text.empty()) {
                summary_ = text;
            }
        } else if (record.key == "funct" || record.key == "pin" || record.key == "param") {
            doc_ += (doc_.empty() ? "" : "\n\n") + record.key + ": " + record.text;
        }
    }
    if (const std::string text = file_.text_of(std::string(info) + "description"); !text.empty()) {
        summary_ = text;
    }
    for (const char* const key : {"author", "license", "supported_device"}) {
        if (const std::string text = file_.text_of(std::string(info) + key); !text.empty()) {
            doc_ += (doc_.empty() ? "" : "\n\n") + std::string(key) + ": " + text;
        }
    }
    doc_ += (doc_.empty() ? "" : "\n\n") + std::string("A compiled module of LinuxCNC: ") + path_;
    description_ = {{{sizeof(hal_component), HAL_ABI_MAJOR, HAL_ABI_MINOR, name_.c_str(),
                      summary_.c_str(), doc_.c_str(),
                      HAL_COMPONENT_SINGLETON | HAL_COMPONENT_WHOLE_NAMES |
                          HAL_COMPONENT_LOOSE_PINS | HAL_COMPONENT_MODULE,
                      1, sizeof(Module*), alignof(Module*), create_instance, start_instance,
                      stop_instance, destroy_instance},
                     path_.c_str(),
                     described_.data(),
                     described_.size()},
                    this};
}

Module* Module::current() { return constructing; }
Module* Module::unloading() { return exiting; }
const std::vector<Module*>& Module::all_running() { return running_modules; }

namespace {

/// "tpmod", "trivkins, genhexkins and 18 more": the modules in the folder that define the symbol.
std::string definers_of(const std::string& symbol, const std::string& folder, std::string& first) {
    std::vector<std::string> names;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
        // whose place this library takes
        if (entry.path().extension() != ".so" || entry.path().stem() == "hal_lib") continue;
        const ElfFile file(entry.path().string());
        if (file.problem().empty() && file.defines(symbol)) {
            names.push_back(entry.path().stem().string());
        }
    }
    std::sort(names.begin(), names.end());
    const auto usual = std::find_if(names.begin(), names.end(), [](const std::string& n) {
        return n == "trivkins" || n == "homemod" || n == "tpmod";
    });
    if (usual != names.end()) {
        std::rotate(names.begin(), usual, usual + 1);
    }
    if (names.empty()) {
        return {};
    }
    first = names[0];
    if (names.size() == 1) return "module '" + first + "'";
    return "'" + first + "' and " + std::to_string(names.size() - 1) + " other modules";
}

}  // namespace

namespace {

bool is_of_linuxcnc(std::string_view symbol) {
    return symbol.starts_with("hal_") || symbol.starts_with("halpr_") ||
           symbol.starts_with("rtapi_") || symbol.starts_with("_rtapi_");
}

/// What LinuxCNC 2.9 and 2.10 define beside what this library does: these read its memory.
bool reads_its_memory(std::string_view symbol) {
    return symbol.starts_with("halpr_") || symbol == "hal_data";
}

/// What its headers declare and nothing of it defines for modules.
bool is_declared_only(std::string_view symbol) {
    constexpr std::string_view beginnings[] = {"rtapi_sem_",
                                               "rtapi_fifo_",
                                               "rtapi_irq_",
                                               "rtapi_enable_interrupt",
                                               "rtapi_disable_interrupt",
                                               "hal_thread_delete",
                                               "hal_port_wait_",
                                               "hal_stream_wait_"};
    return std::ranges::any_of(beginnings,
                               [&](std::string_view one) { return symbol.starts_with(one); });
}

/// Why a symbol that no loaded library defines is missing; the first that fits.
struct MissingKind {
    bool (*is)(std::string_view symbol);
    const char* text;
    const char* help;
};
constexpr MissingKind missing_kinds[] = {
    {reads_its_memory,
     " reads LinuxCNC's memory directly, which a machine of Halcyon does not have",
     "hal_get_pin_value_by_name and the like read values by name"},
    {only_in_2_10, " is a function of LinuxCNC 2.10 that this runtime does not have",
     "docs/linuxcnc-compatibility.md lists what is not supported; "
     "hal compile builds a component from its source"},
    {is_declared_only,
     " is declared in LinuxCNC's headers, but LinuxCNC does not export it to modules either",
     "a port or a stream passes data between a module and a program"},
    {is_of_linuxcnc,
     " is not in the interface of LinuxCNC 2.9 or 2.10: the module is built for another version",
     "use the module of LinuxCNC 2.9 (linuxcnc-uspace) or 2.10, or build this one again with the "
     "halcompile of one of these"},
};

const MissingKind* kind_of(std::string_view symbol) {
    const auto kind =
        std::ranges::find_if(missing_kinds, [&](const MissingKind& one) { return one.is(symbol); });
    return kind == std::end(missing_kinds) ? nullptr : kind;
}

}  // namespace

bool Module::imports(const char* symbol) const {
    return std::find(file_.undefined().begin(), file_.undefined().end(), symbol) !=
           file_.undefined().end();
}

void Module::note_broken() noexcept {
    broken_ = true;
    guarded([&] {
        broken_names.insert(name_);
        return 0;
    });
}

void Module::keep_for_good() noexcept {
    static hal_value nowhere;
    note_broken();
    for (hal_value** const slot : slots) {
        *slot = &nowhere;
    }
    keep_memory();
}

void Module::find_neighbours() {
    uses_.clear();
    for (Module* const other : running_modules) {
        if (std::any_of(file_.undefined().begin(), file_.undefined().end(),
                        [&](const std::string& symbol) { return other->file_.defines(symbol); })) {
            uses_.insert(other);
        }
    }
}

// The loader names the first missing symbol only, and not who defines it.
void Module::explain_loading(std::string problem) const {
    std::vector<std::string> missing;
    for (const std::string& symbol : file_.undefined()) {
        if (!dlsym(RTLD_DEFAULT, symbol.c_str())) {
            missing.push_back(symbol);
        }
    }
    if (missing.empty() || problem.find("undefined symbol") == problem.npos) {
        return host_->fail(host_, problem.c_str());
    }
    // one of another version of the interface explains the others
    std::stable_partition(missing.begin(), missing.end(), [](const std::string& s) {
        return is_of_linuxcnc(s) && !reads_its_memory(s) && !is_declared_only(s) &&
               !only_in_2_10(s);
    });
    std::string first;
    const std::string& symbol = missing[0];
    const std::string owners = definers_of(symbol, folder_, first);
    std::string text = "it uses " + symbol;
    if (missing.size() == 1) {
        text += ", which";
    } else {
        text += " and " + std::to_string(missing.size() - 1) + " more missing symbols; " + symbol;
    }
    std::string help;
    if (!owners.empty()) {
        text += " is defined by " + owners;
        help = "load that first: loadrt " + first;
    } else if (const MissingKind* const kind = kind_of(symbol)) {
        text += kind->text;
        help = kind->help;
    } else {
        text += " is defined neither by this runtime nor by a module in " + folder_;
        help = "check that it was built for LinuxCNC 2.9 or 2.10";
    }
    const hal_rejection rejection{sizeof rejection, HAL_SUBJECT_INSTANCE, "", 0, 0, "",
                                  text.c_str(),     help.c_str()};
    host_->reject(host_, &rejection);
}

// Functions of the same name differ between the versions, and modules share variables with each
// other.
bool Module::fits_the_others() {
    interface_ = interface_of(file_, folder_);
    if (interface_ == Interface::any) return true;
    for (const Module* const other : running_modules) {
        if (other->interface_ == Interface::any || other->interface_ == interface_) continue;
        const std::string text = std::string("it is built for LinuxCNC ") +
                                 version_text(interface_) + ", and '" + other->name_ +
                                 "', which is loaded, for " + version_text(other->interface_) +
                                 ": a machine runs the modules of one version";
        const hal_rejection rejection{
            sizeof rejection,
            HAL_SUBJECT_INSTANCE,
            "",
            0,
            0,
            "",
            text.c_str(),
            "take all modules from the folder of one LinuxCNC, which HAL_RTMOD_DIR names"};
        host_->reject(host_, &rejection);
        return false;
    }
    take_ports_by_pointer(interface_ == Interface::v2_10);
    return true;
}

bool Module::create(const hal_host* host, const hal_modules& extension,
                    const hal_module_calls& calls) {
    if (broken_names.contains(name_)) {
        host->fail(host,
                   "it has crashed, or a task of it did not end; end this machine and start "
                   "it again before you load it");

        return false;
    }
    if (!prepare_memory()) {
        host->fail(host, "out of memory");
        return false;
    }
    find_neighbours();
    host_ = host;
    extension_ = &extension;
    calls_ = &calls;
    take_readings(calls);
    machine_ = calls.machine(host);
    if (!fits_the_others()) {
        release();
        return false;
    }
    constructing = this;
    begin_capture();
    const rtapi_msg_handler_t handler = rtapi_get_msg_handler();
    const int level = rtapi_get_msg_level();
    bool good = false;
    library_ = dlopen(path_.c_str(), RTLD_NOW | RTLD_GLOBAL);
    if (!library_) {
        explain_loading(dlerror());
    } else {
        good = apply_arguments(host_, library_, described_, strings_) &&
               extension.arguments_known(host) && run_main();
    }
    constructing = nullptr;
    for (const char* const call : {"ioperm", "iopl", "rtapi_inb", "rtapi_outb"}) {
        if (good && imports(call)) {
            accesses_ports = permit_ports() == 0;
        }
    }
    if (good) {
        parameters.assign(declared);
        announce_memory();
        plain_ = parameters.empty() && !accesses_ports && !imports("rtapi_task_pll_set_correction");
        parameters.settle(true);
        running_ = true;
        running_modules.push_back(this);
        start_printer();
        return true;
    }
    end_capture();
    rtapi_set_msg_handler(handler);
    rtapi_set_msg_level(level);
    release();
    if (running_modules.empty()) {
        stop_printer();
    }
    return false;
}

namespace {

std::string one_line(std::string text) {
    text.erase(std::min(text.find_first_of('\n'), text.size()));
    for (char& c :
         text) {  // hostmot2 prints the bytes of a board's name, which end the text when they are 0
        if (static_cast<unsigned char>(c) < ' ' && c != '\t') {
            c = '?';
        }
    }
    return text;
}

}  // namespace

bool Module::run_main() {
    const auto main = reinterpret_cast<int (*)()>(dlsym(library_, "rtapi_app_main"));
    struct Call {
        int (*main)();
        int result;
    } call{main, 0};
    const int signal = run_guarded_from_crashes(
        [](void* c) { static_cast<Call*>(c)->result = static_cast<Call*>(c)->main(); }, &call);
    if (signal == 0 && call.result >= 0) return true;
    const std::string cause = one_line(captured_cause());
    print_captured();  // all of it, in lines of its own: LinuxCNC's users search for these
    const std::string why = signal != 0 ? std::string(crash_text(signal))
                                        : std::string(std::strerror(-call.result)) + " (" +
                                              std::to_string(call.result) + ")";
    if (signal != 0) {
        note_broken();  // its code stays mapped: who knows who has a pointer to it
    }
    std::string text = "rtapi_app_main failed: " + why;
    if (signal != 0) {
        text = "rtapi_app_main crashed (" + why + ")" + (cause.empty() ? "" : ": " + cause);
    } else if (!cause.empty()) {
        text = cause + " (rtapi_app_main: " + why + ")";
    }
    host_->fail(host_, text.c_str());
    return false;
}

void Module::announce_memory() {
    for (const int id : components) {
        each_segment(id, [](void* self, const void* begin, unsigned long bytes) {
            const Module& module = *static_cast<const Module*>(self);
            module.extension_->memory(module.host_, begin, bytes);
        }, this);
    }
}

void Module::start() { print_captured(); }

void Module::destroy() {
    if (!running_) return;
    const std::vector<Module*> others = running_modules;
    for (auto other = others.rbegin(); other != others.rend(); ++other) {
        if (*other != this && (*other)->uses(*this)) {
            (*other)->destroy();
        }
    }
    running_ = false;
    std::erase(running_modules, this);
    const auto exit = reinterpret_cast<void (*)()>(dlsym(library_, "rtapi_app_exit"));
    if (accesses_ports) {
        permit_ports();
    }
    exiting = this;
    const int signal = run_guarded_from_crashes([](void* e) { reinterpret_cast<void (*)()>(e)(); },
                                                reinterpret_cast<void*>(exit));
    exiting = nullptr;
    if (signal != 0) {
        note_broken();
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: rtapi_app_exit crashed (%s)\n", name_.c_str(),
                        crash_text(signal));
    }
    print_captured();
    release();
    if (running_modules.empty()) {
        stop_printer();
    }
}

void Module::release() {
    release_tasks(*this);
    release_clock(*this);
    parameters.settle(false);
    release_components(*this);
    release_ports(*this);
    release_cards(*this);
    release_claims(*this);
    parameters.clear();
    declared.clear();
    functions.clear();
    slots.clear();
    accesses_ports = false;
    for (auto& names : names_) {
        names.clear();
    }
    if (library_ && !broken_) {
        dlclose(library_);
    }
    library_ = nullptr;
    strings_.clear();
    host_ = nullptr;
    uses_.clear();
}

}  // namespace hal::modules
