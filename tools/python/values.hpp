// SPDX-License-Identifier: MIT
// One pin or parameter of a Python component, and the conversion of its value between Python and
// the control protocol.
#pragma once

#include <string>

#include <nlohmann/json.hpp>
#include <pybind11/pybind11.h>

#include "base/types.hpp"

namespace py = pybind11;

namespace hal::python {

using Json = nlohmann::json;

/// A pin or parameter with the local copy of its value.
struct Item {
    std::string name, full;  ///< without and with the component's prefix
    hal::TypeRow type;
    std::string dir;         ///< in, out, io, ro or rw
    Json declared;           ///< the declaration as sent to the machine
    Json value;              ///< the local copy
    bool dirty = false;      ///< written locally and not sent yet
    /// Returns whether only this program writes the value.
    bool own() const { return dir == "out" || dir == "ro"; }
};

/// Returns the value a new pin of this type starts with: 0, FALSE, or null for a port.
Json initial_value(hal_type type);
/// Returns the local copy as a Python object; None for a port. Needs the GIL.
py::object to_python(const Item& item);
/// Returns the Python value as the protocol's value. Raises OverflowError outside of the type's
/// range, TypeError for a port. Needs the GIL.
Json to_json(const Item& item, const py::object& value);

}  // namespace hal::python
