// SPDX-License-Identifier: MIT
// Which LinuxCNC a module is built for; why this is asked and how is in docs/decisions/0033.
#pragma once

#include <cstddef>
#include <string>

#include "linuxcnc/binary/elf_file.hpp"

namespace hal::modules {

/// `any`: the file uses nothing in which the two differ.
enum class Interface { any, v2_9, v2_10 };

/// Recognised by the functions that the file uses and, if these are in both, from the HAL of
/// LinuxCNC that is in the same folder. [setup]
Interface interface_of(const ElfFile& file, const std::string& folder);
/// "2.9", "2.10", "2.9 or 2.10".
const char* version_text(Interface interface) noexcept;
/// True for a function that belongs to the versions, whether this library has it or not.
bool only_in_2_10(std::string_view symbol);

}  // namespace hal::modules
