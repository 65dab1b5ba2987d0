// SPDX-License-Identifier: MIT
// The modes of floating-point arithmetic of the calling thread: rounding, flush to zero, which
// exceptions trap. They belong to the thread, so what a function changes holds for all functions
// behind it.
#pragma once

#include <cstdint>

namespace hal {

/// Reading costs a few CPU cycles; no system call. On a processor that is unknown here there are no
/// modes. [any]
struct FloatModes {
    /// What differs between two modes, as bits.
    enum Difference : unsigned {
        rounding = 1,
        flush_to_zero = 2,  ///< of results
        denormals_are_zero = 4,  ///< of operands
        traps = 8,  ///< which exceptions end in SIGFPE
        precision = 16,  ///< of the x87 unit
        default_nan = 32
    };

    std::uint32_t vector = 0;  ///< control bits of MXCSR, FPCR or FPSCR
    std::uint32_t x87 = 0;  ///< control word; 0 where there is no such unit

    bool operator==(const FloatModes&) const = default;

#if defined(__x86_64__)
    static constexpr FloatModes defaults() noexcept { return {0x1f80, 0x033f}; }
    static FloatModes now() noexcept {
        std::uint16_t word = 0;
        asm volatile("fnstcw %0" : "=m"(word));
        return {__builtin_ia32_stmxcsr() & vector_control, word & x87_control};
    }
    /// Also clears the flags of past exceptions, which would trap at once with other modes.
    void set() const noexcept {
        __builtin_ia32_ldmxcsr(vector);
        const auto word = static_cast<std::uint16_t>(x87 | x87_always);
        asm volatile("fnclex\n\tfldcw %0" : : "m"(word));
    }
    unsigned differences(const FloatModes& other) const noexcept {
        const std::uint32_t v = vector ^ other.vector;
        const std::uint32_t x = x87 ^ other.x87;
        return bit(rounding, (v & 0x6000) | (x & 0x0c00)) | bit(flush_to_zero, v & 0x8000) |
               bit(denormals_are_zero, v & 0x0040) | bit(traps, (v & 0x1f80) | (x & 0x003f)) |
               bit(precision, x & 0x0300);
    }

private:
    static constexpr std::uint32_t vector_control = 0xffc0;
    static constexpr std::uint32_t x87_control = 0x0f3f;
    static constexpr std::uint32_t x87_always = 0x0040;  // reserved: reads as 1

public:
#elif defined(__aarch64__) || (defined(__arm__) && defined(__ARM_FP))
    static constexpr FloatModes defaults() noexcept { return {}; }
    static FloatModes now() noexcept { return {read() & control, 0}; }
    void set() const noexcept { write(vector); }
    unsigned differences(const FloatModes& other) const noexcept {
        const std::uint32_t v = vector ^ other.vector;
        return bit(rounding, v & 0x00c0'0000) | bit(flush_to_zero, v & 0x0108'0000) |
               bit(denormals_are_zero, v & 1) | bit(traps, v & 0x9f00) |
               bit(default_nan, v & 0x0200'0000);
    }

private:
    static constexpr std::uint32_t control = 0x03c8'9f00;
#if defined(__aarch64__)
    static std::uint32_t read() noexcept {
        std::uint64_t value = 0;
        asm volatile("mrs %0, fpcr" : "=r"(value));
        return static_cast<std::uint32_t>(value);
    }
    static void write(std::uint32_t value) noexcept {
        asm volatile("msr fpcr, %0" : : "r"(std::uint64_t{value}));
    }
#else
    static std::uint32_t read() noexcept {
        std::uint32_t value = 0;
        asm volatile("vmrs %0, fpscr" : "=r"(value));
        return value;
    }
    static void write(std::uint32_t value) noexcept {
        asm volatile("vmsr fpscr, %0" : : "r"(value));
    }
#endif

public:
#else
    static constexpr FloatModes defaults() noexcept { return {}; }
    static FloatModes now() noexcept { return {}; }
    void set() const noexcept {}
    unsigned differences(const FloatModes&) const noexcept { return 0; }
#endif

private:
    [[maybe_unused]] static constexpr unsigned bit(Difference difference,
                                                   std::uint32_t differs) noexcept {
        return differs != 0 ? difference : 0U;
    }
};

/// Keeps the modes of the caller while code of a component runs with the default ones.
class DefaultFloatModes {
public:
    DefaultFloatModes() noexcept { FloatModes::defaults().set(); }
    ~DefaultFloatModes() { before_.set(); }
    DefaultFloatModes(const DefaultFloatModes&) = delete;

private:
    FloatModes before_ = FloatModes::now();
};

}  // namespace hal
