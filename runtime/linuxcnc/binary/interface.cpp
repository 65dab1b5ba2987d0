// SPDX-License-Identifier: MIT
#include "linuxcnc/binary/interface.hpp"

#include <algorithm>

namespace hal::modules {
namespace {

bool any_of(const std::set<std::string>& symbols, bool (*is)(std::string_view)) {
    return std::any_of(symbols.begin(), symbols.end(),
                       [is](const std::string& symbol) { return is(symbol); });
}

}  // namespace

bool only_in_2_10(std::string_view symbol) {
    constexpr std::string_view beginnings[] = {"hal_pin_new_", "hal_param_new_", "hal_pin_s64_",
                                               "hal_pin_u64_", "hal_param_s64_", "hal_param_u64_",
                                               "hal_query_",   "hal_list_"};
    constexpr std::string_view names[] = {"hal_export_functf",
                                          "hal_init_funct_to_thread",
                                          "hal_is_init",
                                          "hal_lib_init",
                                          "hal_lib_exit",
                                          "hal_strerror",
                                          "hal_get_realtime_type",
                                          "hal_thread_delete",
                                          "hal_reference_map",
                                          "hal_reference_unmap",
                                          "rtapi_get_realtime_type",
                                          "rtapi_task_self_resync"};
    return std::any_of(std::begin(beginnings), std::end(beginnings), [&](std::string_view one) {
        return symbol.starts_with(one);
    }) || std::find(std::begin(names), std::end(names), symbol) != std::end(names);
}

Interface interface_of(const ElfFile& file, const std::string& folder) {
    if (any_of(file.undefined(), only_in_2_10)) return Interface::v2_10;
    const ElfFile host(folder + "/hal_lib.so");  // LinuxCNC's own, which is never loaded
    if (host.problem().empty()) {
        return host.defines("hal_pin_new_bool") ? Interface::v2_10 : Interface::v2_9;
    }
    const bool ports = any_of(
        file.undefined(), [](std::string_view symbol) { return symbol.starts_with("hal_port_"); });
    return ports ? Interface::v2_9 : Interface::any;
}

const char* version_text(Interface interface) noexcept {
    if (interface == Interface::v2_9) return "2.9";
    if (interface == Interface::v2_10) return "2.10";
    return "2.9 or 2.10";
}

}  // namespace hal::modules
