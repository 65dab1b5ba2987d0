// SPDX-License-Identifier: MIT
// The parameters of a module. Each lives twice: where the runtime reads and writes it, and in the
// module's variable, which has the width of its type only.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "hal/abi.h"

namespace hal::modules {

struct Function;

struct Parameter {
    hal_pin pin;
    volatile void* value;
    hal_value last;  ///< what both had when they were last compared
    std::uint32_t width;
};

/// Which function copies which parameters, and the copying.
class ModuleParameters {
public:
    bool empty() const { return all_.empty(); }
    void add(const char* name, Parameter* parameter);
    /// Returns nullptr for a name that is not a parameter's.
    Parameter* find(const std::string& name) const;
    /// All parameters and functions are known: assigns to each function the parameters in the
    /// memory of its argument. [setup]
    void assign(const std::vector<Function*>& declared);
    /// exchange() copies from now on, or no longer. [setup]
    void settle(bool settled) { settled_.store(settled, std::memory_order_release); }
    void clear();

    /// Before a call: copies parameters of the function that were set from outside. [realtime]
    void import(const Function& function) noexcept;
    /// After a call: copies parameters that the module has changed. [realtime]
    void show(Function& function) noexcept;
    /// Between two cycles of a task of the module's own: copies all parameters both ways.
    /// [realtime]
    void exchange() noexcept;

private:
    std::vector<Parameter*> all_;  // in the end sorted by the address of their values
    std::vector<Parameter*> shared_;  // of no function
    std::map<std::string, Parameter*> names_;
    std::atomic<bool> settled_{false};
};

}  // namespace hal::modules
