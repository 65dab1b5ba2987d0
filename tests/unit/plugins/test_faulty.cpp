// SPDX-License-Identifier: MIT
// Does in its cycle, on demand, what a component must not do.
#include <cfenv>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <mutex>
#include <sys/syscall.h>
#include <unistd.h>

#include "hal/component.hpp"
#include "hal/lasting_fault.hpp"

namespace {

struct Faulty : hal::Component {
    using Component::Component;
    hal::In<bool> throws{*this, "throws", "throw an exception"};
    hal::In<bool> bad_number{*this, "bad-number", "NaN on `value`"};
    hal::In<std::uint32_t> slow{*this, "slow", "busy for so many microseconds"};
    hal::In<bool> allocates{*this, "allocates", "take memory"};
    hal::In<bool> frees{*this, "frees", "give memory back"};
    hal::In<bool> locks{*this, "locks", "take a mutex"};
    hal::In<bool> sleeps{*this, "sleeps", "sleep"};
    hal::In<bool> raises{*this, "raises", "a fault of its own"};
    hal::In<bool> open{*this, "open", "a fault that lasts"};
    hal::In<std::uint32_t> dies{
        *this, "dies",
        "1 bad address, 2 abort, 3 endless recursion, 4 illegal instruction, 5 floating-point "
        "signal, 6 exit(0), 7 _exit(0), 8 quick_exit(0), 9 syscall(), 10 the instruction"};
    hal::In<bool> rounds{*this, "rounds", "change the rounding mode"};
    hal::Out<double> value{*this, "value", "the number of the run", {.safe = -5.0, .finite = true}};
    hal::Out<bool> on{*this, "on", "TRUE", {.safe = false}};
    hal::Function run{*this, "run", &Faulty::misbehave, "misbehaves"};
    hal::Emergency emergency{*this, &Faulty::make_safe, "prints a line on stderr"};

    void start() {
        faults_ = hal::extension<hal_faults>("hal.faults/1");
        taken_ = new char[64];
    }
    void stop() noexcept { delete[] taken_; }

    void misbehave(hal::Cycle cycle) noexcept {
        on = true;
        value = static_cast<double>(cycle.number());
        if (bad_number) {
            value = std::nan("");
        }
        if (throws) throw std::runtime_error("thrown in a cycle");
        if (raises) {
            faults_->raise(faults_, this, "a finger in the gear", 3.0);
        }
        if (open && !cover_.lasts()) {
            cover_.begin(faults_, this, "the cover is open");
        }
        if (!open && cover_.lasts()) {
            cover_.end(faults_, this);
        }
        if (allocates) {
            std::string text(1000, 'x');
            keep(text.data());
        }
        if (frees && taken_) {
            delete[] taken_;
            taken_ = nullptr;
        }
        if (locks) {
            const std::lock_guard hold(mutex_);
            keep(&mutex_);
        }
        if (sleeps) {
            usleep(1);
        }
        if (rounds) {
            std::fesetround(FE_UPWARD);
        }
        if (slow) {
            const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(slow);
            while (std::chrono::steady_clock::now() < end) {
            }
        }
        if (dies) {
            die(dies);
        }
    }
    void make_safe(hal::Cycle) noexcept {
        const char text[] = "emergency function called\n";
        if (!dies) return;
        [[maybe_unused]] const auto written = write(STDERR_FILENO, text, sizeof text - 1);
    }

private:
    static void keep(void* p) noexcept { asm volatile("" : : "r"(p) : "memory"); }
    static int deeper(int depth) noexcept {
        volatile char buffer[4096];
        buffer[0] = static_cast<char>(depth);
        return depth < 0 ? 0 : deeper(depth + 1) + buffer[0];
    }
    void die(std::uint32_t how) noexcept {
        switch (how) {
        case 1: *reinterpret_cast<volatile int*>(std::uintptr_t{16}) = 1; break;
        case 2: std::abort();
        case 3: keep(reinterpret_cast<void*>(static_cast<std::intptr_t>(deeper(0)))); break;
        case 4: __builtin_trap();
        case 6: std::exit(0);
        case 7: ::_exit(0);
        case 8: std::quick_exit(0);
        case 9: ::syscall(SYS_exit_group, 0); break;
        case 10: exit_by_instruction();
        default: raise(SIGFPE);
        }
    }
    [[noreturn]] static void exit_by_instruction() noexcept {
#if defined(__x86_64__)
        asm volatile("syscall" : : "a"(SYS_exit_group), "D"(0) : "rcx", "r11", "memory");
#elif defined(__aarch64__)
        register long number asm("x8") = SYS_exit_group;
        register long status asm("x0") = 0;
        asm volatile("svc 0" : : "r"(number), "r"(status) : "memory");
#endif
        __builtin_trap();
    }
    const hal_faults* faults_ = nullptr;
    hal::LastingFault cover_;
    std::mutex mutex_;
    char* taken_ = nullptr;
};

}  // namespace

HAL_COMPONENT(Faulty, "test-faulty", "Does in its cycle what a component must not do")
