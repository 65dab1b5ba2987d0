// SPDX-License-Identifier: MIT
// The files of mobile robots: floor plans, lists of goals, programs of steps. The first byte
// chooses which.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "mobile/texts/floor_plan.hpp"
#include "mobile/texts/goal_list.hpp"
#include "mobile/texts/step_text.hpp"
#include "tests/fuzz/driver/require.hpp"

using namespace hal::mobile;
using hal::fuzz::require;

namespace {

template <class Problems>
void places(const Problems& problems, std::size_t size) {
    for (const auto& p : problems) {
        require(p.begin <= p.end && p.end <= size, "a problem has a place in the text");
        require(!p.sentence.empty() && !p.help.empty(), "a problem has a message and a help text");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
    if (data[0] % 3 == 0) {
        FloorPlan floor;
        floor.read(text);
        places(floor.problems, text.size());
        require(
            floor.walls.size() + floor.discs.size() + floor.beacons.size() <= FloorPlan::max_shapes,
            "a floor plan is bounded");
        for (int i = 0; i < 8; ++i) {
            const Hit hit = floor.cast(0.1, 0.2, i * 0.8, 10.0);
            require(hit.distance >= 0.0 && !std::isnan(hit.distance), "a ray has a length");
            require(hit.incidence >= 0.0 && hit.incidence <= 1.0 + 1e-9, "and an angle");
        }
        require(!std::isnan(floor.clearance(0.1, 0.2)), "a place has a clearance");
    } else if (data[0] % 3 == 1) {
        GoalList list;
        list.read(text);
        places(list.problems, text.size());
        require(!list.problems.empty() ||
                    (!list.goals.empty() && list.goals.size() <= GoalList::max_goals),
                "a list that is taken has goals");
    } else {
        StepText program;
        program.read(text);
        places(program.problems, text.size());
        if (!program.problems.empty()) return 0;
        require(!program.steps.empty() && program.steps.size() <= StepText::max_steps,
                "a program that is taken has steps");
        for (const Step& s : program.steps) {
            for (const Transition& t : s.transitions) {
                require(t.to < program.steps.size(), "a transition leads to a step");
            }
        }
        for (const Transition& t : program.alarms) {
            require(t.to < program.steps.size(), "and so does an alarm");
        }
    }
    return 0;
}
