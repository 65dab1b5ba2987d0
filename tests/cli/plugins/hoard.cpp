// SPDX-License-Identifier: MIT
#include <cstdint>
#include <memory>
#include <vector>

#include "hal/component.hpp"

namespace {

/// Allocates memory at each moment at which a component can.
struct Hoard : hal::Component {
    using Component::Component;

    hal::Argument mib{*this, "mib", 0, "what its constructor allocates, MiB", {.min = 0}};
    hal::Argument cycle_mib{*this, "cycle-mib", 0, "what its first cycles allocate, MiB"};
    hal::Out<std::uint32_t> sum{*this, "sum", "cycles, counted in its memory"};
    hal::Function run{*this, "", &Hoard::step, "counts"};

    void start(const hal_host&) { more_ = std::vector<std::uint32_t>(7, 1); }
    void step(hal::Cycle) noexcept {
        constexpr std::int64_t block_mib = 4;  // locked memory takes time
        if (static_cast<std::int64_t>(grown_.size()) * block_mib < cycle_mib) {
            grown_.push_back(memory_of(block_mib));
        }
        sum = ++first_[2] + ++more_[3];
    }

private:
    static std::unique_ptr<char[]> memory_of(std::int64_t size) {
        return std::make_unique_for_overwrite<char[]>(static_cast<std::size_t>(size) << 20);
    }

    std::unique_ptr<char[]> own_ = memory_of(mib);
    std::vector<std::unique_ptr<char[]>> grown_;
    std::vector<std::uint32_t> first_ = std::vector<std::uint32_t>(5, 1);
    std::vector<std::uint32_t> more_;
};

}  // namespace

HAL_COMPONENT(Hoard, "hoard", "Allocates memory")
