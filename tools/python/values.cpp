// SPDX-License-Identifier: MIT
#include "values.hpp"

#include <cmath>
#include <limits>

namespace hal::python {

namespace {

double real(const Json& value) {
    if (value.is_number()) return value.get<double>();
    if (value == "inf") return HUGE_VAL;
    if (value == "-inf") return -HUGE_VAL;
    return NAN;
}

template <class T>
Json integer(const Item& item, const py::object& value) {
    const auto number = py::reinterpret_steal<py::object>(PyNumber_Long(value.ptr()));
    if (!number) throw py::error_already_set();
    int beyond = 0;
    if (std::is_unsigned_v<T>) {
        const unsigned long long got = PyLong_AsUnsignedLongLong(number.ptr());
        if (PyErr_Occurred()) throw py::error_already_set();
        if (got <= std::numeric_limits<T>::max()) return got;
    } else {
        const long long got = PyLong_AsLongLongAndOverflow(number.ptr(), &beyond);
        if (PyErr_Occurred()) throw py::error_already_set();
        if (beyond == 0 && got >= static_cast<long long>(std::numeric_limits<T>::min()) &&
            got <= static_cast<long long>(std::numeric_limits<T>::max())) {
            return got;
        }
    }
    PyErr_SetString(PyExc_OverflowError,
                    (py::str(value).cast<std::string>() + " is out of range for " + item.type.name +
                     " '" + item.full + "'")
                        .c_str());
    throw py::error_already_set();
}

}  // namespace

Json initial_value(hal_type type) {
    if (type == HAL_TYPE_BIT) return Json(false);
    if (type == HAL_TYPE_FLOAT) return Json(0.0);
    if (type == HAL_TYPE_PORT) return Json(nullptr);
    return Json(0);
}

py::object to_python(const Item& item) {
    const Json& value = item.value;
    switch (item.type.type) {
    case HAL_TYPE_BIT: return py::bool_(value.is_boolean() && value.get<bool>());
    case HAL_TYPE_FLOAT: return py::float_(real(value));
    case HAL_TYPE_U32:
    case HAL_TYPE_U64: return py::int_(value.get<std::uint64_t>());
    case HAL_TYPE_S32:
    case HAL_TYPE_S64: return py::int_(value.get<std::int64_t>());
    case HAL_TYPE_PORT: break;
    }
    return py::none();
}

Json to_json(const Item& item, const py::object& value) {
    switch (item.type.type) {
    case HAL_TYPE_BIT: {
        const int truth = PyObject_IsTrue(value.ptr());
        if (truth < 0) throw py::error_already_set();
        return truth != 0;
    }
    case HAL_TYPE_FLOAT: {
        const auto number = py::reinterpret_steal<py::object>(PyNumber_Float(value.ptr()));
        if (!number) throw py::error_already_set();
        const double got = PyFloat_AsDouble(number.ptr());
        if (std::isfinite(got)) return got;
        if (std::isnan(got)) return "nan";
        if (got > 0) return "inf";
        return "-inf";
    }
    case HAL_TYPE_S32: return integer<std::int32_t>(item, value);
    case HAL_TYPE_U32: return integer<std::uint32_t>(item, value);
    case HAL_TYPE_S64: return integer<std::int64_t>(item, value);
    case HAL_TYPE_U64: return integer<std::uint64_t>(item, value);
    case HAL_TYPE_PORT: break;
    }
    PyErr_SetString(PyExc_TypeError,
                    ("port '" + item.full + "' has no value; use write()").c_str());
    throw py::error_already_set();
}

}  // namespace hal::python
