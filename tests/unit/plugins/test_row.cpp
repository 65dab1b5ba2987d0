// SPDX-License-Identifier: MIT
// So small that many in a row are run by one loop.
#include <stdexcept>

#include "hal/component.hpp"

namespace {

struct Row : hal::Component {
    using Component::Component;
    hal::In<bool> throws{*this, "throws", "throw"};
    hal::In<std::int32_t> in{*this, "in", "from the one before"};
    hal::Out<std::int32_t> out{*this, "out", "one more than in"};
    hal::Function run{*this, "", hal::step<&Row::update>, "counts"};

    void update(hal::Cycle) noexcept {
        // out of a noexcept function
        if (throws) throw std::runtime_error("requested by the test");
        out = in + 1;
    }
};

}  // namespace

HAL_COMPONENT(Row, "test-row", "A link of a chain")
