// SPDX-License-Identifier: MIT
// A pin of every type and direction; outputs copy inputs.
#include "hal/component.hpp"

namespace {

template <hal::PinType T>
struct Row {
    hal::In<T> in;
    hal::Out<T> out;
    hal::Io<T> io;
    Row(hal::Component& c, const char* in_name, const char* out_name, const char* io_name)
        : in(c, in_name, ""), out(c, out_name, ""), io(c, io_name, "") {}
    void copy() noexcept { out = in.get(); }
};

struct Types : hal::Component {
    using Component::Component;
    Row<bool> bit{*this, "bit-in", "bit-out", "bit-io"};
    Row<double> real{*this, "float-in", "float-out", "float-io"};
    Row<std::int32_t> s32{*this, "s32-in", "s32-out", "s32-io"};
    Row<std::uint32_t> u32{*this, "u32-in", "u32-out", "u32-io"};
    Row<std::int64_t> s64{*this, "s64-in", "s64-out", "s64-io"};
    Row<std::uint64_t> u64{*this, "u64-in", "u64-out", "u64-io"};
    hal::Param<double> real_param{*this, "float-param", ""};
    hal::Param<bool> bit_param{*this, "bit-param", ""};
    hal::Function run{*this, "", &Types::copy, "copies"};

    void copy(hal::Cycle) noexcept {
        bit.copy();
        real.copy();
        s32.copy();
        u32.copy();
        s64.copy();
        u64.copy();
    }
};

}  // namespace

HAL_COMPONENT(Types, "test-types", "A pin of every type and direction")
