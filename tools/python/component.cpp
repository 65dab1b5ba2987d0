// SPDX-License-Identifier: MIT
#include "component.hpp"
#include "released_gil.hpp"

#include <csignal>
#include <cstdio>
#include <new>
#include <set>
#include <utility>

#include <pthread.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "machine/processes/address.hpp"

namespace hal::python {

using namespace std::chrono_literals;

namespace {

using Clock = std::chrono::steady_clock;

/// Returns the reply of a request that succeeded; throws the error of one that failed.
Json checked(Json reply) {
    if (!reply.value("ok", false)) throw Problem(reply.value("error", "the machine sent no reply"));
    return reply;
}

/// All components of this process: flushed before another process is started, and ended with the
/// program.
struct Registry {
    std::mutex mutex;
    std::set<Component*> components;
};
Registry& registry() {
    // never destroyed: outlives every component in any order of Python's clean-up
    static Registry* const one = new Registry;
    return *one;
}

// among the components; compared only, and used while it is registered
std::atomic<Component*> last_writer{nullptr};

template <class Action>
void for_all(Action action) {
    const std::scoped_lock lock(registry().mutex);
    for (Component* const component : registry().components) {
        try {
            action(*component);
        } catch (const std::exception&) {
            // the next access reports it
        }
    }
}

}  // namespace

std::unique_ptr<hal::Client> connect_to_instance() {
    std::string problem;
    auto client = hal::Client::connect(hal::instance_wanted(""), problem);
    if (!client) throw Problem(problem);
    return client;
}

std::string dump(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Component::Component(std::string name, std::string prefix, Json timeout, long every_ms,
                     bool ends_when_lost)
    : name_(std::move(name)),
      prefix_(std::move(prefix)),
      timeout_(std::move(timeout)),
      every_ms_(every_ms),
      ends_when_lost_(ends_when_lost) {
    {
        const ReleasedGil release_gil;
        client_ = connect_to_instance();
        note_connected();
        checked(client_->request(announcement()));
    }
    sigset_t every, before;  // signals go to Python's main thread
    sigfillset(&every);
    pthread_sigmask(SIG_SETMASK, &every, &before);
    flusher_ = std::thread([this] { run_flusher(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    const std::scoped_lock lock(registry().mutex);
    registry().components.insert(this);
}

Component::~Component() {
    {
        const ReleasedGil release_gil;
        leave(true);
    }
    const std::scoped_lock lock(registry().mutex);
    registry().components.erase(this);
    Component* here = this;
    last_writer.compare_exchange_strong(here, nullptr);
}

std::size_t Component::add(const std::string& name, int type, const std::string& dir,
                           const std::string& more) {
    Item item{.name = name,
              .full = prefix_ + "." + name,
              .type = hal::row(static_cast<hal_type>(type)),
              .dir = dir,
              .declared = Json::parse(more),
              .value = initial_value(static_cast<hal_type>(type))};
    item.declared.update(Json{{"name", name}, {"type", item.type.name}, {"dir", dir}});
    // The items change under the mutex and the GIL: look-ups hold only the GIL, the flusher only
    // the mutex. The mutex is locked without the GIL, for which its holder may wait.
    std::unique_lock lock(mutex_, std::defer_lock);
    Json reply;
    {
        const ReleasedGil release_gil;
        acquire(lock);
        if (index_.contains(name)) {
            throw Problem("component '" + name_ + "': duplicate pin or parameter '" + name + "'");
        }
        reply = checked(client_->request(
            {{"component", name_}, {"prefix", prefix_}, {"pins", Json::array({item.declared})}}));
    }
    if (item.type.type != HAL_TYPE_PORT) {
        // a pin that a dead predecessor left has a value
        item.value = reply.at("values").at(0);
    }
    const std::size_t index = items_.size();
    prefixes_.push_back(prefix_);
    items_.push_back(std::move(item));
    index_.emplace(name, index);
    fetched_ = {};
    return index;
}

void Component::ready(bool on) {
    const ReleasedGil release_gil;
    std::unique_lock lock(mutex_, std::defer_lock);
    acquire(lock);
    exchange(false);  // a program that waited for ready sees what was set before
    checked(client_->request({{"component", name_}, {"ready", on}}));
    ready_ = on;
}

long Component::find(const std::string& name) const {
    const auto at = index_.find(name);
    return at == index_.end() ? -1 : static_cast<long>(at->second);
}

py::object Component::get(std::size_t i) {
    std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || stale(items_[i]) || report_due()) {
        const ReleasedGil release_gil;
        acquire(lock);
        if (stale(items_[i])) {
            exchange(true);
        } else if (report_due()) {
            report();
        }
    }
    check_usable();
    return to_python(items_[i]);
}

void Component::send_earlier_writes() {
    Component* const before = last_writer.exchange(this);
    if (!before || before == this || forked_) return;
    const ReleasedGil release_gil;
    for_all([before](Component& component) {
        if (&component != before || component.forked_) return;
        const std::scoped_lock lock(component.mutex_);
        if (component.dirty_ && !component.left_ && component.lost_.empty()) {
            component.exchange(false);
        }
    });
}

void Component::set(std::size_t i, const py::object& value) {
    Json wanted = to_json(items_[i], value);
    send_earlier_writes();
    std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) {
        const ReleasedGil release_gil;
        acquire(lock);
    }
    check_usable();
    Item& item = items_[i];
    item.value = std::move(wanted);
    item.dirty = true;
    if (!std::exchange(dirty_, true)) {
        changed_.notify_one();
    }
}

std::string Component::request(const std::string& text) {
    send_earlier_writes();
    const ReleasedGil release_gil;
    std::unique_lock lock(mutex_, std::defer_lock);
    acquire(lock);
    exchange(false);
    fetched_ = {};
    return dump(client_->request(Json::parse(text)));
}

void Component::flush() {
    if (forked_ || left_) return;
    const std::scoped_lock lock(mutex_);
    fetched_ = {};
    if (dirty_ && !left_) {
        exchange(false);
    }
}

void Component::alive() {
    const ReleasedGil release_gil;
    std::unique_lock lock(mutex_, std::defer_lock);
    acquire(lock);
    report();
}

void Component::invalidate() {
    const ReleasedGil release_gil;
    std::unique_lock lock(mutex_, std::defer_lock);
    acquire(lock);
    fetched_ = {};
}

void Component::leave(bool clean) {
    // behind the end of the program, another thread may keep the mutex for ever
    if (forked_ || left_) return;
    {
        const std::scoped_lock lock(mutex_);
        if (left_) return;
        if (clean && client_->connected()) {
            client_->request({{"exit", name_}});
        } else if (client_->connected()) {
            exchange(false);
        }
        client_.reset();
        left_ = true;
        changed_.notify_one();
    }
    flusher_.join();
}

void Component::forget() {
    forked_ = true;
    // the flusher exists in the parent only: it cannot be joined, may have held the mutex, and
    // would be awaited by the destructor of the condition
    new std::thread(std::move(flusher_));
    new (&mutex_) std::mutex;
    new (&changed_) std::condition_variable;
    if (client_) {
        client_.release()->close_in_child();
    }
}

bool Component::is_connected() {
    if (forked_) return false;
    const ReleasedGil release_gil;
    const std::scoped_lock lock(mutex_);
    return !left_ && client_ && client_->connected();
}

Json Component::announcement() const {
    Json body{{"component", name_}, {"prefix", prefix_}, {"ready", false}};
    if (!timeout_.is_null()) {
        body["timeout_ms"] = timeout_;
    }
    if (every_ms_ > 0) {
        body["every_ms"] = every_ms_;
    }
    return body;
}

void Component::acquire(std::unique_lock<std::mutex>& lock) const {
    check_process();
    if (!lock) {
        lock.lock();
    }
    check_usable();
}

void Component::check_process() const {
    if (forked_) {
        throw Problem(
            "component '" + name_ +
            "' belongs to the parent process; create a component of its own in the child");
    }
}

void Component::check_usable() const {
    check_process();
    if (left_) throw Problem("component '" + name_ + "' has ended with exit()");
    if (!lost_.empty()) throw Problem(lost_);
}

bool Component::stale(const Item& item) const {
    if (item.own() || item.type.type == HAL_TYPE_PORT || item.dirty) return false;
    return (dirty_ && loops_) || Clock::now() - fetched_ > 1ms;
}

bool Component::report_due() const {
    const std::chrono::microseconds every(std::int64_t{every_ms_} * 1000);
    return every_ms_ > 0 && !dirty_ && Clock::now() - reported_ > every / 4;
}

void Component::report() {
    if (!client_->connected()) return;
    client_->request({{"exchange", name_}});
    reported_ = Clock::now();
}

void Component::exchange(bool read) {
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
    if (read) {
        body["read"] = true;
    }
    const Json reply = client_->request(std::move(body));
    if (!client_->connected()) {  // the values stay as they are until the component reconnects
        for (Item& item : items_) {
            item.dirty = item.own() && item.type.type != HAL_TYPE_PORT;
        }
        dirty_ = true;
        changed_.notify_one();
        return;
    }
    if (!reply.value("ok", false)) {
        lost_ = reply.value("error", "the machine sent no reply");
        throw Problem(lost_);
    }
    reported_ = Clock::now();
    if (!read) return;
    const Json& values = reply.at("values");
    std::size_t k = 0;
    for (Item& item : items_) {
        if (!item.own()) {
            item.value = values.at(k++);
        }
    }
    loops_ = reply.value("loops", false);
    fetched_ = Clock::now();
}

void Component::run_flusher() {
    std::unique_lock lock(mutex_);
    while (!left_) {
        if (!client_->look()) {
            reconnect();
            if (!client_->connected()) {
                changed_.wait_for(lock, 200ms);
            }
            continue;
        }
        if (!dirty_) {
            changed_.wait_for(lock, 100ms);
            continue;
        }
        lock.unlock();
        std::this_thread::sleep_for(500us);  // collects the writes that follow
        lock.lock();
        try {
            if (!left_ && lost_.empty()) {
                exchange(false);
            }
        } catch (const std::exception&) {
            dirty_ = false;  // the next access reports it
        }
    }
}

void Component::note_connected() {
    int death_signal = 0;
    tied_ = prctl(PR_GET_PDEATHSIG, &death_signal) == 0 && death_signal != 0 &&
            getppid() == client_->pid();
    loss_reported_ = false;
}

void Component::handle_loss() {
    if (std::exchange(loss_reported_, true)) return;
    if (ends_when_lost_ && tied_) {
        return;  // the kernel or the machine sends SIGTERM
    }
    std::fprintf(stderr, "%s: the machine '%s' (process %lld) has ended; %s\n", name_.c_str(),
                 client_->instance().c_str(), static_cast<long long>(client_->pid()),
                 ends_when_lost_ ? "ending"
                                 : "pins take their safe values, others keep theirs, until it is "
                                   "running again (HALCYON_LOST=end ends the "
                                   "program instead)");
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

void Component::reconnect() {
    std::unique_ptr<hal::Client> client;
    try {
        client = connect_to_instance();
    } catch (const std::exception&) {
        handle_loss();
        return;
    }
    try {
        if (!client->request(announcement()).value("ok", false)) return;
        for (std::size_t i = 0; i < items_.size(); ++i) {
            checked(client->request({{"component", name_},
                                     {"prefix", prefixes_[i]},
                                     {"pins", Json::array({items_[i].declared})}}));
        }
        client_ = std::move(client);
        note_connected();
        for (Item& item : items_) {
            item.dirty = dirty_ = item.own() && item.type.type != HAL_TYPE_PORT;
        }
        for (const Item& item : items_) {
            dirty_ = dirty_ || item.dirty;
        }
        fetched_ = {};
        exchange(false);
        if (ready_) {
            client_->request({{"component", name_}, {"ready", true}});
        }
    } catch (const std::exception&) {
        // the flusher tries again
    }
}

void flush_all() {
    const ReleasedGil release_gil;
    for_all([](Component& component) { component.flush(); });
}

void leave_all(bool clean) {
    const ReleasedGil release_gil;
    for_all([clean](Component& component) { component.leave(clean); });
}

void forget_all() {
    ReleasedGil::after_fork();
    // a thread that held it in the parent does not exist here; components change under the GIL
    new (&registry().mutex) std::mutex;
    for_all([](Component& component) { component.forget(); });
}

}  // namespace hal::python
