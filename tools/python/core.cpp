// SPDX-License-Identifier: MIT
// What Python's module `hal` is made of: a connection, and a component with a copy of its pins' values. hal/__init__.py
// gives them LinuxCNC's names.
//
// Reading and writing a pin touches the copy. What was written goes out with the next look at the inputs, or half a millisecond
// later by a thread of the component's own; inputs are fetched, all of them in one request, when the copy is older than a
// millisecond. So a row of accesses costs one request, and who has slept sees what is new.
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include <nlohmann/json.hpp>
#include <pthread.h>
#include <sys/prctl.h>
#include <unistd.h>
#include <pybind11/pybind11.h>
#include <csignal>

#include "base/types.hpp"
#include "machine/address.hpp"
#include "control/client.hpp"

namespace py = pybind11;
using Json = nlohmann::json;
using namespace std::chrono_literals;

namespace {

using Clock = std::chrono::steady_clock;

struct Problem : std::runtime_error {
    using std::runtime_error::runtime_error;
};

std::unique_ptr<hal::Client> connected() {
    std::string problem;
    auto client = hal::Client::connect(hal::instance_wanted(""), problem);
    if (!client) throw Problem(problem);
    return client;
}

/// The reply to a request, or its refusal as an exception.
Json good(Json reply) {
    if (!reply.value("ok", false)) throw Problem(reply.value("error", "no answer"));
    return reply;
}

std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// Requests of the module's own functions.
class Link {
public:
    std::string request(const std::string& text) {
        const py::gil_scoped_release others_may_run;
        const std::scoped_lock lock(mutex_);
        const Json body = Json::parse(text);
        if (client_ && !client_->connected()) client_.reset();
        if (!client_) client_ = connected();
        Json reply = client_->request(body);
        if (!client_->connected()) {  // the instance has been started anew meanwhile
            client_ = connected();
            reply = client_->request(body);
        }
        return dumped(reply);
    }

private:
    std::mutex mutex_;
    std::unique_ptr<hal::Client> client_;
};

class Component;

/// All components of this process; those that flush before another process is started, and are left at the end.
struct All {
    std::mutex mutex;
    std::set<Component*> components;
};
All& all() {
    static All* const one = new All;  // outlives every component, whatever Python destroys when
    return *one;
}

struct Item {
    std::string name, full;
    hal::TypeRow type;
    std::string dir;
    Json declared;
    Json value;
    bool dirty = false;
    bool own() const { return dir == "out" || dir == "ro"; }
};

Json initial(hal_type type) { return type == HAL_TYPE_BIT ? Json(false) : type == HAL_TYPE_FLOAT ? Json(0.0) : type == HAL_TYPE_PORT ? Json(nullptr) : Json(0); }

class Component {
public:
    Component(std::string name, std::string prefix, Json timeout, long every_ms, bool ends_when_lost)
        : name_(std::move(name)), prefix_(std::move(prefix)), timeout_(std::move(timeout)), every_ms_(every_ms), ends_when_lost_(ends_when_lost) {
        {
            const py::gil_scoped_release others_may_run;
            client_ = connected();
            found();
            good(client_->request(announcement()));
        }
        sigset_t every, before;  // signals are Python's main thread's
        sigfillset(&every);
        pthread_sigmask(SIG_SETMASK, &every, &before);
        flusher_ = std::thread([this] { flush_later(); });
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
        const std::scoped_lock lock(all().mutex);
        all().components.insert(this);
    }
    ~Component() {
        {
            const py::gil_scoped_release others_may_run;
            leave(true);
        }
        const std::scoped_lock lock(all().mutex);
        all().components.erase(this);
        if (forked_) new std::thread(std::move(flusher_));  // it is the parent's; nobody can join it here
    }
    Component(const Component&) = delete;

    const std::string& name() const { return name_; }
    const std::string& prefix() const { return prefix_; }
    void set_prefix(std::string prefix) { prefix_ = std::move(prefix); }

    std::size_t add(const std::string& name, int type, const std::string& dir, const std::string& more) {
        std::unique_lock lock(mutex_, std::defer_lock);
        Item item{name, prefix_ + "." + name, hal::row(static_cast<hal_type>(type)), dir, Json::object(), {}, false};
        item.declared = Json::parse(more);
        item.declared.update(Json{{"name", name}, {"type", item.type.name}, {"dir", dir}});
        item.value = initial(item.type.type);
        Json reply;
        {
            const py::gil_scoped_release others_may_run;
            take(lock);
            if (index_.contains(name)) throw Problem("component '" + name_ + "' has a pin or parameter '" + name + "' already");
            reply = good(client_->request({{"component", name_}, {"prefix", prefix_}, {"pins", Json::array({item.declared})}}));
        }
        // with Python's lock and ours: what only looks up holds the first, the flusher the second
        if (item.type.type != HAL_TYPE_PORT) item.value = reply.at("values").at(0);  // of a dead predecessor's pin: what it is
        prefixes_.push_back(prefix_);
        items_.push_back(std::move(item));
        index_.emplace(name, items_.size() - 1);
        fetched_ = {};
        return items_.size() - 1;
    }

    void ready(bool on) {
        const py::gil_scoped_release others_may_run;
        std::unique_lock lock(mutex_, std::defer_lock);
        take(lock);
        exchange(false);  // what was set before is seen by whoever has waited
        good(client_->request({{"component", name_}, {"ready", on}}));
        ready_ = on;
    }

    long find(const std::string& name) const {
        const auto at = index_.find(name);
        return at == index_.end() ? -1 : static_cast<long>(at->second);
    }

    py::object get(std::size_t i) {
        std::unique_lock lock(mutex_, std::try_to_lock);
        if (!lock || stale(items_[i])) {
            const py::gil_scoped_release others_may_run;
            take(lock);
            if (stale(items_[i])) exchange(true);
        }
        usable();
        return python(items_[i]);
    }

    void set(std::size_t i, const py::object& value) {
        Json wanted = json(items_[i], value);
        std::unique_lock lock(mutex_, std::try_to_lock);
        if (!lock) {
            const py::gil_scoped_release others_may_run;
            take(lock);
        }
        usable();
        Item& item = items_[i];
        item.value = std::move(wanted);
        item.dirty = true;
        if (!std::exchange(dirty_, true)) changed_.notify_one();
    }

    std::string request(const std::string& text) {
        const py::gil_scoped_release others_may_run;
        std::unique_lock lock(mutex_, std::defer_lock);
        take(lock);
        exchange(false);
        fetched_ = {};
        return dumped(client_->request(Json::parse(text)));
    }

    void flush() {
        if (forked_) return;
        const std::scoped_lock lock(mutex_);
        fetched_ = {};
        if (dirty_ && !left_) exchange(false);
    }
    /// A sign of life, for a component with a declared rate that accesses no pin.
    void alive() {
        const py::gil_scoped_release others_may_run;
        std::unique_lock lock(mutex_, std::defer_lock);
        take(lock);
        if (client_->connected()) client_->request({{"exchange", name_}});
    }
    /// The next look at an input fetches them anew.
    void look() {
        const py::gil_scoped_release others_may_run;
        std::unique_lock lock(mutex_, std::defer_lock);
        take(lock);
        fetched_ = {};
    }

    /// Ends it: its pins go at once (`clean`), or as if this process had died.
    void leave(bool clean) {
        if (forked_) return;  // where another thread may have held the lock for ever
        {
            const std::scoped_lock lock(mutex_);
            if (left_) return;
            if (clean && client_->connected()) client_->request({{"exit", name_}});
            else if (client_->connected()) exchange(false);
            client_.reset();
            left_ = true;
            changed_.notify_one();
        }
        flusher_.join();
    }
    void forget() { forked_ = true; }
    bool is_connected() {
        if (forked_) return false;
        const py::gil_scoped_release others_may_run;
        const std::scoped_lock lock(mutex_);
        return !left_ && client_ && client_->connected();
    }

    const Item& item(std::size_t i) const { return items_.at(i); }
    std::size_t size() const { return items_.size(); }

private:
    Json announcement() const {
        Json body{{"component", name_}, {"prefix", prefix_}, {"ready", false}};
        if (!timeout_.is_null()) body["timeout_ms"] = timeout_;
        if (every_ms_ > 0) body["every_ms"] = every_ms_;
        return body;
    }

    /// Who waits for our lock must not hold Python's: its holder may want that.
    void take(std::unique_lock<std::mutex>& lock) const {
        check_process();
        if (!lock) lock.lock();
        usable();
    }
    void check_process() const {
        if (forked_) throw Problem("component '" + name_ + "' belongs to the process that made it, not to its child");
    }
    void usable() const {
        check_process();
        if (left_) throw Problem("component '" + name_ + "' has left with exit()");
        if (!lost_.empty()) throw Problem(lost_);
    }

    bool stale(const Item& item) const { return !item.own() && item.type.type != HAL_TYPE_PORT && !item.dirty && ((dirty_ && loops_) || Clock::now() - fetched_ > 1ms); }

    /// One request with all that was written since the last one, and for all inputs.
    void exchange(bool read) {
        if (!client_->connected() || (!dirty_ && !read)) return;
        Json body{{"exchange", name_}};
        if (dirty_) {
            Json& write = body["write"] = Json::array();
            for (std::size_t i = 0; i < items_.size(); ++i) {
                if (!std::exchange(items_[i].dirty, false)) continue;
                write.push_back(i);
                write.push_back(items_[i].value);
            }
            dirty_ = false;
        }
        if (read) body["read"] = true;
        const Json reply = client_->request(std::move(body));
        if (!client_->connected()) {  // the values stay as they are until there is a connection again
            for (Item& item : items_) item.dirty = item.own() && item.type.type != HAL_TYPE_PORT;
            dirty_ = true;
            changed_.notify_one();
            return;
        }
        if (!reply.value("ok", false)) {
            lost_ = reply.value("error", "no answer");
            throw Problem(lost_);
        }
        if (!read) return;
        const Json& values = reply.at("values");
        std::size_t k = 0;
        for (Item& item : items_)
            if (!item.own()) item.value = values.at(k++);
        loops_ = reply.value("loops", false);
        fetched_ = Clock::now();
    }

    void flush_later() {
        std::unique_lock lock(mutex_);
        while (!left_) {
            if (!client_->look()) {
                reconnect();
                if (!client_->connected()) changed_.wait_for(lock, 200ms);
                continue;
            }
            if (!dirty_) {
                changed_.wait_for(lock, 100ms);
                continue;
            }
            lock.unlock();
            std::this_thread::sleep_for(500us);  // more will come
            lock.lock();
            try {
                if (!left_ && lost_.empty()) exchange(false);
            } catch (const std::exception&) {
                dirty_ = false;  // the next access says why
            }
        }
    }

    void found() {
        int death_signal = 0;
        tied_ = prctl(PR_GET_PDEATHSIG, &death_signal) == 0 && death_signal != 0 && getppid() == client_->pid();
        lost_said_ = false;
    }

    /// The machine is gone. Ends the program as SIGTERM does, or takes the declared values.
    void be_lost() {
        if (std::exchange(lost_said_, true)) return;
        if (ends_when_lost_ && tied_) return;  // the kernel's SIGTERM, or the machine's, is on its way
        std::fprintf(stderr, "%s: the machine '%s' (process %lld) is gone; %s\n", name_.c_str(), client_->instance().c_str(),
                     static_cast<long long>(client_->pid()),
                     ends_when_lost_ ? "ending" : "pins take their declared values, others keep theirs, until it is back (HALCYON_LOST=end ends the program instead)");
        if (ends_when_lost_) {
            kill(getpid(), SIGTERM);
            return;
        }
        for (Item& item : items_) {
            const auto safe = item.declared.find("safe");
            if (safe == item.declared.end()) continue;
            item.value = *safe;
            item.dirty = item.dirty || item.own();
        }
    }

    /// The same component in an instance that has been started again, or that has dropped this connection.
    void reconnect() {
        std::unique_ptr<hal::Client> client;
        try {
            client = connected();
        } catch (const std::exception&) {
            be_lost();
            return;
        }
        try {
            if (!client->request(announcement()).value("ok", false)) return;
            for (std::size_t i = 0; i < items_.size(); ++i)
                good(client->request({{"component", name_}, {"prefix", prefixes_[i]}, {"pins", Json::array({items_[i].declared})}}));
            client_ = std::move(client);
            found();
            for (Item& item : items_) item.dirty = dirty_ = item.own() && item.type.type != HAL_TYPE_PORT;
            for (const Item& item : items_) dirty_ = dirty_ || item.dirty;
            fetched_ = {};
            exchange(false);
            if (ready_) client_->request({{"component", name_}, {"ready", true}});
        } catch (const std::exception&) {
            // not yet
        }
    }

    static double real(const Json& value) { return value.is_number() ? value.get<double>() : value == "inf" ? HUGE_VAL : value == "-inf" ? -HUGE_VAL : NAN; }

    static py::object python(const Item& item) {
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

    template <class T>
    static Json whole(const Item& item, const py::object& value) {
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
            if (beyond == 0 && got >= static_cast<long long>(std::numeric_limits<T>::min()) && got <= static_cast<long long>(std::numeric_limits<T>::max())) return got;
        }
        PyErr_SetString(PyExc_OverflowError, (py::str(value).cast<std::string>() + " is out of range for " + item.type.name + " '" + item.full + "'").c_str());
        throw py::error_already_set();
    }

    static Json json(const Item& item, const py::object& value) {
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
            return std::isnan(got) ? "nan" : got > 0 ? "inf" : "-inf";
        }
        case HAL_TYPE_S32: return whole<std::int32_t>(item, value);
        case HAL_TYPE_U32: return whole<std::uint32_t>(item, value);
        case HAL_TYPE_S64: return whole<std::int64_t>(item, value);
        case HAL_TYPE_U64: return whole<std::uint64_t>(item, value);
        case HAL_TYPE_PORT: break;
        }
        PyErr_SetString(PyExc_TypeError, ("port '" + item.full + "' has no value; use write()").c_str());
        throw py::error_already_set();
    }

    std::string name_, prefix_;
    Json timeout_;
    long every_ms_;
    bool ends_when_lost_;
    bool tied_ = false, lost_said_ = false;  // the kernel ends this process with the machine; its loss has been reported
    std::mutex mutex_;                 // holds for everything below
    std::condition_variable changed_;
    std::unique_ptr<hal::Client> client_;
    std::vector<Item> items_;          // changed with Python's lock, too
    std::vector<std::string> prefixes_;
    std::unordered_map<std::string, std::size_t> index_;
    bool dirty_ = false;               // something was written and has not gone out
    bool loops_ = false;               // an output of ours is linked to an input of ours
    bool ready_ = false, left_ = false;
    std::string lost_;                 // why the instance knows us no more
    std::atomic<bool> forked_{false};
    Clock::time_point fetched_{};
    std::thread flusher_;
};

template <class Action>
void for_all(Action action) {
    const std::scoped_lock lock(all().mutex);
    for (Component* const component : all().components) {
        try {
            action(*component);
        } catch (const std::exception&) {
            // the next access says why
        }
    }
}

void flush_all() {
    const py::gil_scoped_release others_may_run;
    for_all([](Component& component) { component.flush(); });
}

// Another process may look at what was written: it has to be there before that process starts.
int before_processes(const char* event, PyObject*, void*) {
    if (std::strcmp(event, "subprocess.Popen") == 0 || std::strcmp(event, "os.system") == 0 || std::strcmp(event, "os.posix_spawn") == 0 || std::strcmp(event, "os.fork") == 0)
        flush_all();
    return 0;
}

}  // namespace

PYBIND11_MODULE(_core, module) {
    module.doc() = "What the module hal is made of";
    py::register_exception<Problem>(module, "error", PyExc_RuntimeError);
    py::class_<Link>(module, "Link").def(py::init<>()).def("request", &Link::request);
    py::class_<Component, std::shared_ptr<Component>>(module, "Component")
        .def(py::init([](std::string name, std::string prefix, long timeout_ms, long every_ms, bool ends_when_lost) {
            return std::make_shared<Component>(std::move(name), std::move(prefix), timeout_ms < -1 ? Json(nullptr) : Json(timeout_ms), every_ms, ends_when_lost);
        }))
        .def("add", &Component::add)
        .def("ready", &Component::ready)
        .def("find", &Component::find)
        .def("get", &Component::get)
        .def("set", &Component::set)
        .def("get_named", [](Component& c, const std::string& name) {
            const long at = c.find(name);
            if (at < 0) throw py::attribute_error("component '" + c.name() + "' has no pin or parameter '" + name + "'");
            return c.get(static_cast<std::size_t>(at));
        })
        .def("set_named", [](Component& c, const std::string& name, const py::object& value) {
            const long at = c.find(name);
            if (at < 0) throw py::attribute_error("component '" + c.name() + "' has no pin or parameter '" + name + "'");
            c.set(static_cast<std::size_t>(at), value);
        })
        .def("request", &Component::request)
        .def("look", &Component::look)
        .def("alive", &Component::alive)
        .def("leave", [](Component& c, bool clean) {
            const py::gil_scoped_release others_may_run;
            c.leave(clean);
        })
        .def("connected", &Component::is_connected)
        .def("prefix", &Component::prefix)
        .def("set_prefix", &Component::set_prefix)
        .def("describe", [](const Component& c, std::size_t i) { return py::make_tuple(c.item(i).name, c.item(i).full, static_cast<int>(c.item(i).type.type), c.item(i).dir); })
        .def("size", &Component::size);
    module.def("leave_all", [](bool clean) {
        const py::gil_scoped_release others_may_run;
        for_all([clean](Component& component) { component.leave(clean); });
    });
    module.def("after_fork", [] {
        const bool free = all().mutex.try_lock();  // whoever held it is not in this process
        for (Component* const component : all().components) component->forget();
        if (free) all().mutex.unlock();
    });
    module.def("flush_all", &flush_all);
    PySys_AddAuditHook(before_processes, nullptr);
}
