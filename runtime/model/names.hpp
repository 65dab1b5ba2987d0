// SPDX-License-Identifier: MIT
// The names of a model, indexed for messages that offer similar ones.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <stop_token>

#include "text/suggest.hpp"

namespace hal {

struct Model;

/// Which names: UnknownName::group of diagnostics about a model.
enum class NameGroup : std::uint32_t { pins, signals, functions };

/// Indexes the names of a model once, for as long as the index is in use and no name is added or
/// removed. [setup]
class ModelNames {
public:
    /// Returns nullptr once `stop` is requested: indexing a large model takes long.
    std::shared_ptr<const NameIndex> get(const Model& model, NameGroup group,
                                         const std::stop_token& stop = {});

private:
    struct Taken {
        std::weak_ptr<const NameIndex> index;
        std::size_t size = 0;  // of the names, and the model's next number, when it was made
        std::uint32_t next_id = 0;
    };
    std::array<Taken, 3> taken_;
};

}  // namespace hal
