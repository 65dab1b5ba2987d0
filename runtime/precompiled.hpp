// SPDX-License-Identifier: MIT
// What nearly every source of these folders and of the programs includes, compiled once. A source
// includes what it uses all the same.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>
