// SPDX-License-Identifier: MIT
// What show, list, save, completion and the protocol share: the selection of objects and the text
// of their values.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"

namespace hal {

class Session;

/// LinuxCNC's patterns: one matches a name it is a prefix of, or as a shell glob. No pattern
/// matches all.
class Patterns {
public:
    Patterns() = default;
    explicit Patterns(std::vector<std::string> patterns) : patterns_(std::move(patterns)) {}
    bool match(const std::string& name) const;
    bool empty() const { return patterns_.empty(); }

private:
    std::vector<std::string> patterns_;
};

/// The name show and list print: the alias when there is one.
const std::string& shown_name(const Pin& pin);
/// LinuxCNC knows three kinds of what is a pin here: pins; parameters that can be set; parameters
/// only the machine writes (`.tmax-increased`), which its tables list with the parameters.
bool is_parameter(const Pin& pin);
/// "IN", "OUT", "I/O" or, of a parameter, "RO", "RW".
const char* direction_text(const Pin& pin);

/// By the name that is shown. Empty when the end of the machine interrupts it: sorting many names
/// takes long.
std::vector<const Pin*> pins_by_name(const Session& session, bool parameters,
                                     const Patterns& patterns);
std::vector<const Signal*> signals_by_name(const Session& session, const Patterns& patterns);
std::vector<const LoadedFunction*> functions_by_name(const Model& model, const Patterns& patterns);
/// Newest first, as LinuxCNC lists them.
std::vector<const LoadedComponent*> components_newest_first(const Model& model,
                                                            const Patterns& patterns);
/// Slowest first, as LinuxCNC lists them.
std::vector<const Thread*> threads_slowest_first(const Model& model, const Patterns& patterns);

/// A line with the external clock reference of the threads and its drift; empty while they use the
/// local clock.
std::string clock_text(const Session& session);

/// Whose pin it is: the component of its instance or function, of a thread's own pins the one that
/// made it; nullptr when nobody's.
const LoadedComponent* owner(const Pin& pin);

/// "<==" reads, "==>" writes, "<=>" both; seen from the pin. The signal's view is the mirror image.
const char* arrow_of_pin(const Pin& pin);
const char* arrow_of_signal(const Pin& pin);

/// A value in LinuxCNC's tables: u32 as 0x%08X, u64 as 0x%016X, the rest as getp prints it.
std::string table_value(hal_type type, const hal_value& value);
/// As table_value, but floats with all their digits: what `save` writes.
std::string saved_value(hal_type type, const hal_value& value);

}  // namespace hal
