// SPDX-License-Identifier: MIT
// Sequential work spread over cycles: coroutines that wait for an answer, an event or a time. Their
// frames come from memory that a channel reserved, so that they run in real time without
// allocation.
//
//     class Sensor : public hal::TaskChannel {
//         struct Reply {
//             Sensor& sensor;
//             bool await_ready() const noexcept { return false; }
//             void await_suspend(std::coroutine_handle<> task) const noexcept { sensor.suspend(task); }
//             int await_resume() const noexcept { return sensor.value_; }
//         };
//         Reply ask(int what) noexcept;                       // sends the request
//         void on_reply(int value) noexcept {                 // the cycle received the reply
//             value_ = value;
//             resume();
//         }
//     };
//
//     hal::Task<bool> identify(Sensor& sensor) {
//         const int type = co_await sensor.ask(0);
//         if (type != expected_type) co_return false;
//         const int version = co_await sensor.ask(1);
//         co_return version >= oldest_version;
//     }
//
// The first parameter of a task is its channel, or `this` is: that is how its frame finds its
// memory. A task is started with `channel.start([&] { return work(channel); })`, or awaited by
// another task of the same channel.
#pragma once

#include <coroutine>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <utility>
#include <vector>

namespace hal {

class TaskChannel;

/// Memory of the frames of one channel's tasks: last in, first out.
class TaskMemory {
public:
    /// Reserves the memory. [setup]
    explicit TaskMemory(std::size_t bytes) : bytes_(bytes) {}
    /// Returns space for a frame. The deepest chain of tasks is fixed by the code, and the tests
    /// run all of them: too little memory ends the program. [realtime]
    void* take(std::size_t size) noexcept {
        size = round(size);
        if (used_ + size > bytes_.size()) {
            std::terminate();
        }
        void* at = bytes_.data() + used_;
        used_ += size;
        if (used_ > max_used_) {
            max_used_ = used_;
        }
        return at;
    }
    /// Returns the space of the newest frame to the memory. Another frame ends the program: the
    /// next one would overlap a frame in use. [realtime]
    void give_back(void* frame, std::size_t size) noexcept {
        size = round(size);
        if (size > used_ || frame != bytes_.data() + (used_ - size)) {
            std::terminate();
        }
        used_ -= size;
    }
    /// Returns the largest use so far, in bytes. [realtime]
    std::size_t max_used() const noexcept { return max_used_; }
    /// Returns the size of the memory, in bytes. [any]
    std::size_t size() const noexcept { return bytes_.size(); }

private:
    static std::size_t round(std::size_t size) noexcept { return (size + 15) / 16 * 16; }
    std::vector<std::byte> bytes_;
    std::size_t used_ = 0;
    std::size_t max_used_ = 0;
};

namespace detail {

TaskMemory& memory_of(TaskChannel&) noexcept;

struct TaskPromiseBase {
    std::coroutine_handle<> caller;

    struct Return {
        bool await_ready() const noexcept { return false; }
        template <class P>
        std::coroutine_handle<> await_suspend(std::coroutine_handle<P> done) const noexcept {
            const auto caller = done.promise().caller;
            return caller ? caller : std::noop_coroutine();
        }
        void await_resume() const noexcept {}
    };
    std::suspend_always initial_suspend() const noexcept { return {}; }
    Return final_suspend() const noexcept { return {}; }
    // tasks do not throw
    void unhandled_exception() const noexcept { std::terminate(); }

    /// Header in front of a frame: whose memory it is.
    static constexpr std::size_t header = 16;
    static void* take(TaskChannel& channel, std::size_t size) noexcept {
        TaskMemory& memory = memory_of(channel);
        auto* at = static_cast<std::byte*>(memory.take(size + header));
        *reinterpret_cast<TaskMemory**>(at) = &memory;
        return at + header;
    }
    // Inline: GCC 12 would warn of every task that its delete is not that of its new
    // (-Wmismatched-new-delete).
    template <class... Rest>
    [[gnu::always_inline]] static void* operator new(std::size_t size, TaskChannel& channel,
                                                     Rest&&...) {
        return take(channel, size);
    }
    template <class Self, class... Rest>
    [[gnu::always_inline]] static void* operator new(std::size_t size, Self&, TaskChannel& channel,
                                                     Rest&&...) {
        return take(channel, size);
    }
    static void operator delete(void* frame, std::size_t size) noexcept {
        auto* at = static_cast<std::byte*>(frame) - header;
        (*reinterpret_cast<TaskMemory**>(at))->give_back(at, size + header);
    }
};

template <class T>
struct TaskPromise;

}  // namespace detail

/// A piece of sequential work that ends with a T. Move-only; destroyed with its work unfinished, it
/// ends the work where it waits.
template <class T = void>
class [[nodiscard]] Task {
public:
    using promise_type = detail::TaskPromise<T>;
    using Handle = std::coroutine_handle<promise_type>;

    Task() = default;
    explicit Task(Handle handle) noexcept : handle_(handle) {}
    Task(Task&& o) noexcept : handle_(std::exchange(o.handle_, {})) {}
    Task& operator=(Task&& o) noexcept {
        if (this != &o) {
            reset();
            handle_ = std::exchange(o.handle_, {});
        }
        return *this;
    }
    ~Task() { reset(); }

    bool await_ready() const noexcept { return false; }
    std::coroutine_handle<> await_suspend(std::coroutine_handle<> caller) noexcept {
        handle_.promise().caller = caller;
        return handle_;
    }
    T await_resume() noexcept { return handle_.promise().result(); }

    /// Returns whether there is no work left. [realtime]
    bool done() const noexcept { return !handle_ || handle_.done(); }
    /// Returns the result of finished work. [realtime]
    T result() noexcept { return handle_.promise().result(); }
    /// Runs up to the first wait. [realtime]
    void begin() noexcept { handle_.resume(); }
    /// Ends the work where it waits. Not from within it. [realtime]
    void reset() noexcept {
        if (handle_) {
            std::exchange(handle_, {}).destroy();
        }
    }

private:
    Handle handle_;
};

namespace detail {

template <class T>
struct TaskPromise : TaskPromiseBase {
    T value{};
    Task<T> get_return_object() noexcept {
        return Task<T>(std::coroutine_handle<TaskPromise>::from_promise(*this));
    }
    void return_value(T v) noexcept { value = std::move(v); }
    T result() noexcept { return std::move(value); }
};
template <>
struct TaskPromise<void> : TaskPromiseBase {
    Task<void> get_return_object() noexcept {
        return Task<void>(std::coroutine_handle<TaskPromise>::from_promise(*this));
    }
    void return_void() const noexcept {}
    void result() const noexcept {}
};

}  // namespace detail

/// One sequential worker: the memory of its tasks, the task at work and where it waits. A class for
/// one kind of request derives from it; see the top of this file. All functions [realtime] unless
/// tagged otherwise, in one thread.
class TaskChannel {
public:
    /// Reserves `task_bytes` for the frames of the deepest chain of tasks. [setup]
    explicit TaskChannel(std::size_t task_bytes) : memory_(task_bytes) {}
    TaskChannel(const TaskChannel&) = delete;
    TaskChannel& operator=(const TaskChannel&) = delete;

    /// Ends the previous task, and starts the one that `make` returns. Not from within a task.
    template <class Make>
    void start(Make&& make) noexcept {
        stop();
        task_ = make();
        task_.begin();
    }
    /// Ends the task where it waits. Not from within a task.
    void stop() noexcept {
        resume_ = {};
        task_.reset();
    }
    /// Returns whether a task is running.
    bool busy() const noexcept { return !task_.done(); }
    /// Returns the memory of the tasks, for its statistics.
    const TaskMemory& task_memory() const noexcept { return memory_; }

protected:
    ~TaskChannel() = default;
    /// Remembers the task that waits; for await_suspend(). Precondition: no other task of the
    /// channel waits, that is, resume() or stop() has been called since the previous suspend().
    void suspend(std::coroutine_handle<> task) noexcept { resume_ = task; }
    /// Continues the task that waits, up to its next wait or its end. Precondition: a task waits,
    /// that is, neither resume() nor stop() has been called since the newest suspend().
    void resume() noexcept { std::exchange(resume_, {}).resume(); }

private:
    friend TaskMemory& detail::memory_of(TaskChannel&) noexcept;

    TaskMemory memory_;
    Task<void> task_;
    std::coroutine_handle<> resume_;
};

inline TaskMemory& detail::memory_of(TaskChannel& channel) noexcept { return channel.memory_; }

}  // namespace hal
