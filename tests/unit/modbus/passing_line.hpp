// SPDX-License-Identifier: MIT
// A line that passes everything on to another one. Tests override what is to differ.
#pragma once

#include <memory>
#include <utility>

#include "link/line.hpp"

namespace hal::modbus::test {

class PassingLine : public line::Line {
public:
    explicit PassingLine(std::unique_ptr<line::Line> line) : line_(std::move(line)) {}
    const line::Description& description() const noexcept override { return line_->description(); }
    bool is_open(std::int64_t now) noexcept override { return line_->is_open(now); }
    bool send(std::span<const std::uint8_t> bytes, std::int64_t now) noexcept override {
        return line_->send(bytes, now);
    }
    std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t now) noexcept override {
        return line_->receive(bytes, now);
    }
    std::int64_t sent_until_ns() const noexcept override { return line_->sent_until_ns(); }

private:
    std::unique_ptr<line::Line> line_;
};

}  // namespace hal::modbus::test
