// SPDX-License-Identifier: MIT
#include "hal/any_pin.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace any_pin_test {
namespace {

/// A host that only records pins and gives memory.
class Host {
public:
    struct Declared {
        std::string name;
        hal_type type;
        hal_dir dir;
        std::uint32_t flags;
        hal_value initial, safe;
        const void* function;
        hal_pin* memory;
    };

    const hal_host* get() const noexcept { return &host_; }
    std::vector<Declared> pins;
    std::size_t blocks_left = SIZE_MAX;  ///< of memory

private:
    static Host& of(const hal_host* host) { return *static_cast<Host*>(host->data); }
    static bool pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
        if (std::string(decl->name) == "rejected") return false;
        of(host).pins.push_back({decl->name, decl->type, decl->dir, decl->flags, decl->initial,
                                 decl->safe, decl->function, memory});
        return true;
    }
    static bool function(const hal_host*, const hal_function_decl*) { return true; }
    static void* allocate(const hal_host* host, std::size_t bytes, std::size_t) {
        if (of(host).blocks_left-- == 0) return nullptr;
        return of(host).memory_.emplace_back(std::calloc(1, bytes), &std::free).get();
    }

    std::vector<std::unique_ptr<void, void (*)(void*)>> memory_;
    hal_host host_ = [this] {
        hal_host host{};
        host.size = sizeof host;
        host.data = this;
        host.pin = &pin;
        host.function = &function;
        host.allocate = &allocate;
        return host;
    }();
};

struct Sum : hal::Component {
    using Component::Component;
    hal::Function run{*this, "", &Sum::update, "sums"};
    hal::AnyIns<int> ins;
    hal::AnyOuts<int> outs;
    double sum = 0;
    std::vector<int> order;

    void update(hal::Cycle) noexcept {
        sum = 0;
        ins.each([this]<class T>(const hal::In<T>& pin, int weight) {
            sum += weight * static_cast<double>(pin.get());
        });
        outs.each([]<class T>(hal::Out<T>& pin, int value) { pin = static_cast<T>(value); });
    }
    void declare(hal_type type, const std::string& name, int weight) {
        ins.declare(*this, &run, type, name, "an input", weight);
    }
};

constexpr hal_type types[] = {HAL_TYPE_FLOAT, HAL_TYPE_BIT, HAL_TYPE_U64,
                              HAL_TYPE_S32,   HAL_TYPE_U32, HAL_TYPE_S64};

TEST(AnyPins, keep_their_memory_while_others_are_declared) {
    Host host;
    Sum sum(host.get());
    int weight = 0;
    for (int n = 0; n < 50; ++n) {
        for (const hal_type type : types) {
            sum.declare(type, "in-" + std::to_string(n), ++weight);
        }
    }
    ASSERT_EQ(host.pins.size(), 300U);
    double expected = 0;
    for (std::size_t i = 0; i < host.pins.size(); ++i) {
        const Host::Declared& pin = host.pins[i];
        EXPECT_EQ(pin.type, types[i % 6]);
        EXPECT_EQ(pin.dir, HAL_DIR_IN);
        EXPECT_EQ(pin.function, &sum.run);
        if (pin.type == HAL_TYPE_FLOAT) {
            pin.memory->slot->real = 1.0;
        } else {
            pin.memory->slot->u64 = 1;
        }
        expected += static_cast<double>(i + 1);
    }
    sum.update(hal::Cycle{nullptr});
    EXPECT_EQ(sum.sum, expected);
}

TEST(AnyPins, are_visited_type_by_type_in_the_order_of_declaration) {
    Host host;
    Sum sum(host.get());
    sum.declare(HAL_TYPE_FLOAT, "a", 5);
    sum.declare(HAL_TYPE_BIT, "b", 1);
    sum.declare(HAL_TYPE_FLOAT, "c", 6);
    sum.declare(HAL_TYPE_S32, "d", 3);
    sum.declare(HAL_TYPE_BIT, "e", 2);
    sum.declare(HAL_TYPE_U32, "f", 4);
    std::vector<int> order;
    sum.ins.each([&order](const auto&, int weight) { order.push_back(weight); });
    EXPECT_EQ(order, (std::vector{1, 2, 3, 4, 5, 6}));
}

TEST(AnyPins, pass_initial_and_safe_values_of_their_type) {
    Host host;
    Sum sum(host.get());
    sum.outs.declare(sum, nullptr, HAL_TYPE_S32, "s", "an output", -7,
                     {.initial = hal_value{.s32 = -1}, .safe = hal_value{.s32 = -2}});
    sum.outs.declare(sum, nullptr, HAL_TYPE_BIT, "b", "an output", 1);
    ASSERT_EQ(host.pins.size(), 2U);
    EXPECT_EQ(host.pins[0].initial.s32, -1);
    EXPECT_EQ(host.pins[0].safe.s32, -2);
    EXPECT_TRUE(host.pins[0].flags & HAL_PIN_SAFE);
    EXPECT_FALSE(host.pins[1].flags & HAL_PIN_SAFE);
    EXPECT_EQ(host.pins[1].function, nullptr);
    sum.update(hal::Cycle{nullptr});
    EXPECT_EQ(host.pins[0].memory->slot->s32, -7);
    EXPECT_TRUE(host.pins[1].memory->slot->bit);
}

TEST(AnyPins, throw_when_a_pin_cannot_be_declared) {
    Host host;
    Sum sum(host.get());
    EXPECT_THROW(sum.declare(HAL_TYPE_BIT, "rejected", 1), std::runtime_error);
    EXPECT_THROW(sum.declare(HAL_TYPE_PORT, "port", 1), std::invalid_argument);
    host.blocks_left = 0;
    EXPECT_THROW(sum.declare(HAL_TYPE_FLOAT, "a", 1), std::bad_alloc);
    int visited = 0;
    sum.ins.each([&visited](const auto&, int) { ++visited; });
    EXPECT_EQ(visited, 0);  // the instance is not created
}

}  // namespace
}  // namespace any_pin_test
