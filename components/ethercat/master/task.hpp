// SPDX-License-Identifier: MIT
// Sequential work of the master, such as the start-up of a slave, spread over cycles: coroutines
// that wait for the answer of a datagram. Their frames come from the memory of the Channel they
// work on, so that they run in real time without allocation.
//
//     Task<bool> set_address(Channel& channel, std::uint16_t position, std::uint16_t address) {
//         put(channel.data(), address);
//         const Answer answer = co_await channel.exchange(Command::apwr, at_position(position, registers::station_address), 2);
//         co_return answer.wkc == 1;
//     }
//
// A task takes `Channel&` as its first parameter (after `this`), which is how its frame finds its
// memory. It is started with
// `channel.start()` or awaited by another task of the same channel.
#pragma once

#include <array>
#include <coroutine>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <span>
#include <utility>
#include <vector>

namespace hal::ethercat::master {

class Channel;

/// Memory of the frames of one channel's tasks: last in, first out.
class TaskMemory {
public:
    explicit TaskMemory(std::size_t bytes) : bytes_(bytes) {}
    void* take(std::size_t size) noexcept {
        size = round(size);
        // the deepest chain of tasks is fixed; the tests run all of them
        if (used_ + size > bytes_.size()) {
            std::terminate();
        }
        void* at = bytes_.data() + used_;
        used_ += size;
        if (used_ > most_) {
            most_ = used_;
        }
        return at;
    }
    void give_back(std::size_t size) noexcept { used_ -= round(size); }
    /// Returns the largest use so far, in bytes. [any]
    std::size_t most() const noexcept { return most_; }

private:
    static std::size_t round(std::size_t size) noexcept { return (size + 15) / 16 * 16; }
    struct alignas(16) Block {
        std::byte bytes[16];
    };
    std::vector<std::byte> bytes_;
    std::size_t used_ = 0;
    std::size_t most_ = 0;
};

namespace detail {

TaskMemory& memory_of(Channel&) noexcept;

struct PromiseBase {
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
    static void* take(Channel& channel, std::size_t size) noexcept {
        TaskMemory& memory = memory_of(channel);
        auto* at = static_cast<std::byte*>(memory.take(size + header));
        *reinterpret_cast<TaskMemory**>(at) = &memory;
        return at + header;
    }
    template <class... Rest>
    static void* operator new(std::size_t size, Channel& channel, Rest&&...) {
        return take(channel, size);
    }
    template <class Self, class... Rest>
    static void* operator new(std::size_t size, Self&, Channel& channel, Rest&&...) {
        return take(channel, size);
    }
    static void operator delete(void* frame, std::size_t size) noexcept {
        auto* at = static_cast<std::byte*>(frame) - header;
        (*reinterpret_cast<TaskMemory**>(at))->give_back(size + header);
    }
};

template <class T>
struct Promise;

}  // namespace detail

/// A piece of sequential work that ends with a T. Move-only; destroyed with its work unfinished, it
/// ends the work where it waits.
template <class T = void>
class [[nodiscard]] Task {
public:
    using promise_type = detail::Promise<T>;
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
struct Promise : PromiseBase {
    T value{};
    Task<T> get_return_object() noexcept {
        return Task<T>(std::coroutine_handle<Promise>::from_promise(*this));
    }
    void return_value(T v) noexcept { value = std::move(v); }
    T result() noexcept { return std::move(value); }
};
template <>
struct Promise<void> : PromiseBase {
    Task<void> get_return_object() noexcept {
        return Task<void>(std::coroutine_handle<Promise>::from_promise(*this));
    }
    void return_void() const noexcept {}
    void result() const noexcept {}
};

}  // namespace detail

}  // namespace hal::ethercat::master
