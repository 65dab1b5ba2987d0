// SPDX-License-Identifier: MIT
// Of a build without the package tdma, in place of bus/tdma/.
#include "base/tree_packages.hpp"
#include "bus/node/node_station.hpp"

namespace hal::tools {

std::string make_tdma_station(const NodeOptions&, std::string&, const hal::LinePrefix&,
                              const std::function<bool()>&, std::unique_ptr<NodeStation>&) {
    return "--tdma needs the package tdma: " + find_tree_package("tdma")->problem();
}

}  // namespace hal::tools
