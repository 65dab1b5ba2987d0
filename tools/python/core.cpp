// SPDX-License-Identifier: MIT
// The C++ part of Python's module `hal`, the module hal._core: a connection, and components.
// hal/__init__.py gives them LinuxCNC's names.
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#include <pybind11/stl.h>

#include "component.hpp"
#include "probe.hpp"
#include "released_gil.hpp"

using namespace hal::python;

namespace {

/// The connection that the module's functions share.
class Link {
public:
    std::string request(const std::string& text) {
        const ReleasedGil release_gil;
        const std::scoped_lock lock(mutex_);
        const Json body = Json::parse(text);
        if (client_ && !client_->connected()) {
            client_.reset();
        }
        if (!client_) {
            client_ = connect_to_instance();
        }
        Json reply = client_->request(body);
        if (!client_->connected()) {  // the instance was restarted in the meantime
            client_ = connect_to_instance();
            reply = client_->request(body);
        }
        return dump(reply);
    }
    /// In a child process, after fork(): the parent goes on using the connection, and a thread that
    /// used it does not exist here.
    void forget() {
        new (&mutex_) std::mutex;
        if (client_) {
            client_.release()->close_in_child();
        }
    }

private:
    std::mutex mutex_;
    std::unique_ptr<hal::Client> client_;
};

/// Returns the index of a pin or parameter. Throws AttributeError for an unknown name.
std::size_t index_of(const Component& component, const std::string& name) {
    const long at = component.find(name);
    if (at < 0) {
        throw py::attribute_error("component '" + component.name() + "' has no pin or parameter '" +
                                  name + "'");
    }
    return static_cast<std::size_t>(at);
}

/// Sends what was written before another process is started: that process may read it.
int before_processes(const char* event, PyObject*, void*) {
    for (const std::string_view starts :
         {"subprocess.Popen", "os.system", "os.posix_spawn", "os.fork"}) {
        if (event == starts) {
            flush_all();
        }
    }
    return 0;
}

}  // namespace

PYBIND11_MODULE(_core, module) {
    module.doc() = "C++ part of the module hal";
    py::register_exception<Problem>(module, "error", PyExc_RuntimeError);
    py::class_<Link>(module, "Link")
        .def(py::init<>())
        .def("request", &Link::request)
        .def("after_fork", &Link::forget);
    py::class_<Component, std::shared_ptr<Component>>(module, "Component")
        .def(py::init([](std::string name, std::string prefix, long timeout_ms, long every_ms,
                         bool ends_when_lost) {
        return std::make_shared<Component>(std::move(name), std::move(prefix),
                                           timeout_ms < -1 ? Json(nullptr) : Json(timeout_ms),
                                           every_ms, ends_when_lost);
    }))
        .def("add", &Component::add)
        .def("ready", &Component::ready)
        .def("find", &Component::find)
        .def("get", &Component::get)
        .def("set", &Component::set)
        .def("get_named",
             [](Component& c, const std::string& name) { return c.get(index_of(c, name)); })
        .def("set_named", [](Component& c, const std::string& name,
                             const py::object& value) { c.set(index_of(c, name), value); })
        .def("request", &Component::request)
        .def("invalidate", &Component::invalidate)
        .def("alive", &Component::alive)
        .def("leave",
             [](Component& c, bool clean) {
        const ReleasedGil release_gil;
        c.leave(clean);
    })
        .def("connected", &Component::is_connected)
        .def("prefix", &Component::prefix)
        .def("set_prefix", &Component::set_prefix)
        .def("describe", [](const Component& c, std::size_t i) {
        const hal::python::Item& item = c.item(i);
        return py::make_tuple(item.name, item.full, static_cast<int>(item.type.type), item.dir);
    }).def("size", &Component::size);
    py::class_<Probe>(module, "Probe")
        .def(py::init<const std::vector<std::string>&, std::uint32_t, int, int>())
        .def("columns", &Probe::columns)
        .def("next", &Probe::next)
        .def("unix_ns", &Probe::unix_ns)
        .def("lost", &Probe::lost);
    module.def("leave_all", &leave_all);
    module.def("end", &ReleasedGil::end);
    module.def("after_fork", &forget_all);
    module.def("flush_all", &flush_all);
    PySys_AddAuditHook(before_processes, nullptr);
}
