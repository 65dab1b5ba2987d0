// SPDX-License-Identifier: MIT
// Writes a byte per run into a port and reads what the other side wrote.
#include "hal/component.hpp"

namespace {

struct PortUser : hal::Component {
    using Component::Component;
    hal::Out<hal::Port> to{*this, "to", "a growing number per run"};
    hal::In<hal::Port> from{*this, "from", "what another instance wrote"};
    hal::Out<std::uint32_t> written{*this, "written", "bytes"};
    hal::Out<std::uint32_t> read{*this, "read", "bytes"};
    hal::Out<std::uint32_t> wrong{*this, "wrong", "bytes that were not the next number"};
    hal::Out<std::uint32_t> room{*this, "room", "capacity of the port it writes"};
    hal::Function run{*this, "", &PortUser::move, "writes and reads"};

    void move(hal::Cycle) noexcept {
        room = static_cast<std::uint32_t>(to.get().capacity());
        if (to.get().write(&next_, 1)) {
            ++next_;
            written = written + 1;
        }
        for (std::uint8_t byte; from.get().read(&byte, 1);) {
            if (byte != expected_) {
                wrong = wrong + 1;
            }
            expected_ = static_cast<std::uint8_t>(byte + 1);
            read = read + 1;
        }
    }

private:
    std::uint8_t next_ = 0;

private:
    std::uint8_t expected_ = 0;
};

}  // namespace

HAL_COMPONENT(PortUser, "test-port", "A byte stream in both directions")
