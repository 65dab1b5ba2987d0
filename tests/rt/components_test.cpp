// SPDX-License-Identifier: MIT
// Every component of the build tree runs a thousand cycles under the real-time guard, its inputs
// changing at random.
#include <filesystem>
#include <limits>
#include <map>
#include <random>
#include <sys/resource.h>

#include "paths.hpp"
#include "rt/guard.hpp"
#include "unit/machine.hpp"

namespace hal::test {
namespace {

#define SCOCAN_TABLE                                                                           \
    " table=\"cycle 10ms; slots 10; node clock A sync; node n A; node bridge A bridge; node "  \
    "watch B monitor; mode 0 run; 0 sync; "                                                    \
    "1 private n 0x100; 2 private clock 0x101; message a 0x100 fields x:f64; message b 0x101 " \
    "fields y:s16,z:u8; "                                                                      \
    "message c 0x300 node n event 10ms fields w:f32\""
// Load arguments of components that cannot be made without.
const std::map<std::string, std::string> arguments{
    {"canopen", "inputs=24831 outputs=24675 slavenodeid=2"},
    {"dds_publish", "topic=rt/pins fields=f:float,b:bit,i:s32,u:u32,l:s64,k:u64 rate=0 domain=230"},
    {"dds_subscribe", "topic=rt/pins fields=f:float,b:bit,i:s32,u:u32,l:s64,k:u64 domain=230"},
    {"ethercat", "config=tests/rt/drive.ethercat"},
    {"lcec", "config=tests/rt/ethercat-conf.xml link=sim:rt/lcec"},
    {"scocan", "link=sim:rt-scocan node=n" SCOCAN_TABLE},
    {"scocan_bridge", "link=sim:rt-scocan node=bridge pc=sim:rt-pc" SCOCAN_TABLE},
    {"scocan_monitor", "link=sim:rt-scocan node=watch" SCOCAN_TABLE},
    {"scocan_sync", "link=sim:rt-scocan node=clock" SCOCAN_TABLE},
    {"segment_record", "link=sim:rt/recorder file=/dev/null"},
    {"tdma", "link=sim:rt/master station=master schedule=\"master:; cycle 2000; slot 0 100\""},
};

std::vector<std::string> all_components() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(paths::build_components)) {
        if (entry.path().extension() == ".so") {
            names.push_back(entry.path().stem().string());
        }
    }
    std::sort(names.begin(), names.end());
    return names;
}

std::string load(const std::string& name) {
    const auto given = arguments.find(name);
    return "loadrt " + name + (given == arguments.end() ? "" : " " + given->second) + "\n";
}

// Ordinary values mostly, and now and then one from the edge of the type.
class RandomInputs {
public:
    explicit RandomInputs(const Model& model, std::uint32_t seed) : random_(seed) {
        for (const Pin* pin : model.sorted_pins()) {
            if (pin->instance && pin->type != HAL_TYPE_PORT && pin->dir != HAL_DIR_OUT) {
                pins_.push_back(pin);
            }
        }
    }
    void change() {
        for (const Pin* pin : pins_) {
            if (random_() % 4 == 0) {
                pin->memory->slot->raw = value(pin->type).raw;
            }
        }
    }

private:
    hal_value value(hal_type type) {
        hal_value value{.raw = 0};
        const bool edge = random_() % 32 == 0;
        const auto wide = (std::uint64_t{random_()} << 32) | random_();
        switch (type) {
        case HAL_TYPE_BIT: value.bit = random_() & 1; break;
        case HAL_TYPE_FLOAT: {
            constexpr double edges[] = {0.0,
                                        -0.0,
                                        1e300,
                                        -1e300,
                                        1e-310,
                                        std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::quiet_NaN()};
            value.real = edge ? edges[random_() % std::size(edges)]
                              : std::uniform_real_distribution(-10.0, 10.0)(random_);
            break;
        }
        case HAL_TYPE_S32:
            value.s32 = edge ? static_cast<std::int32_t>(random_())
                             : static_cast<std::int32_t>(random_() % 21) - 10;
            break;
        case HAL_TYPE_U32:
            value.u32 = edge ? static_cast<std::uint32_t>(random_())
                             : static_cast<std::uint32_t>(random_() % 20);
            break;
        case HAL_TYPE_S64:
            value.s64 = edge ? static_cast<std::int64_t>(wide)
                             : static_cast<std::int64_t>(random_() % 21) - 10;
            break;
        case HAL_TYPE_U64: value.u64 = edge ? wide : random_() % 20; break;
        case HAL_TYPE_PORT: break;
        }
        return value;
    }
    std::mt19937 random_;
    std::vector<const Pin*> pins_;
};

long page_faults() {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_minflt + usage.ru_majflt;
}

struct Component : testing::TestWithParam<std::string> {
    // One instance, all functions in one thread; `linked`: every pin on a signal of its own.
    void run(bool linked) {
        Machine machine;
        machine.must("newthread t 1000000\n" + load(GetParam()));
        std::string text;
        for (const LoadedFunction* function : machine.session.model().sorted_functions()) {
            text += "addf " + function->name + " t\n";
        }
        int number = 0;
        for (const Pin* pin : machine.session.model().sorted_pins()) {
            if (!linked || !pin->instance || pin->dir == HAL_DIR_PARAM) continue;
            text += "net s" + std::to_string(++number) + " " + pin->name + "\n";
            if (pin->type == HAL_TYPE_PORT) {
                text += "sets s" + std::to_string(number) + " 256\n";
            }
        }
        machine.must(text);
        RandomInputs inputs(machine.session.model(), 1);
        machine.start();
        long fewest = std::numeric_limits<long>::max();
        for (int part = 0; part < 10; ++part) {
            const long before = page_faults();
            for (int cycle = 0; cycle < 100; ++cycle) {
                inputs.change();
                machine.cycles(1);
            }
            if (part > 0) {
                fewest = std::min(fewest, page_faults() - before);
            }
        }
        EXPECT_EQ(machine.get("t.threadbeat"), "1000");
        for (const FaultRecord& fault : machine.session.reports().faults()) {
            EXPECT_NE(fault.code, "exception") << fault.sentence;
        }
        // the kernel may take a page away at any moment, but not in each of nine rows of a hundred
        // cycles
        if (guarded) {
            EXPECT_EQ(fewest, 0) << "it touches new memory all the time";
        }
    }
};

TEST_P(Component, neither_allocates_nor_locks_nor_blocks) { run(false); }
TEST_P(Component, neither_allocates_nor_locks_nor_blocks_with_all_pins_linked) { run(true); }

INSTANTIATE_TEST_SUITE_P(Of, Component, testing::ValuesIn(all_components()),
                         [](const auto& component) { return component.param; });

TEST(All_components, are_found) { EXPECT_GT(all_components().size(), 30u); }

// All of them at once on a real thread, with edits: taking plans, carrying values and answering are
// real time, too.
TEST(All_components, run_together_on_a_real_thread_while_it_is_edited) {
    Machine machine(Clock::real);
    std::string text = "newthread t 2000000\nnewthread u 4000000\n";
    for (const std::string& name : all_components()) {
        text += load(name);
    }
    machine.must(text + "loadrt test-counter names=a,b\nloadrt test-two names=w\n");
    machine.must(
        "addf a t\naddf w.fast t\naddf w.first u\naddf w.last u\nnet a w.a => w.a-in "
        "w.a-again\nnet b w.b => w.b-in w.b-again");
    machine.must("addf --auto t");
    machine.start();
    for (int i = 0; i < 50; ++i) {
        machine.must(i % 2 ? "delf a t\naddf a t\ndelsig x"
                           : "delf b t\naddf b t 1\nnet x a.sum => b.step\nsetp a.step 2");
    }
    ASSERT_TRUE(eventually([&] { return machine.number("t.threadbeat") >= 300; }));
    EXPECT_EQ(machine.get("w.torn"), "0");
}

}  // namespace
}  // namespace hal::test
