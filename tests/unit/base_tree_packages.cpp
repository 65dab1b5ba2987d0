// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "base/tree_packages.hpp"

namespace hal {
namespace {

TEST(TreePackage, names_its_switch_when_it_is_switched_off) {
    const TreePackage package{"ethercat", "EtherCAT", PackageState::switched_off, ""};
    EXPECT_FALSE(package.built());
    EXPECT_EQ(package.problem(),
              "the package ethercat is switched off in this build; in the source tree, type: cmake "
              "--preset release -DHALCYON_PACKAGE_ETHERCAT=ON, then build again");
}

TEST(TreePackage, names_the_debian_package_that_is_missing) {
    const TreePackage package{"panel", "the panel", PackageState::incomplete, "libwebsockets-dev"};
    EXPECT_EQ(package.problem(),
              "the package panel is left out of this build: it needs libwebsockets-dev; type: sudo "
              "apt-get install libwebsockets-dev, then build again");
}

TEST(TreePackage, has_no_remedy_for_what_no_debian_package_gives) {
    const TreePackage package{"python", "Python", PackageState::incomplete,
                              "a build without sanitizers"};
    EXPECT_EQ(package.remedy(), "");
    EXPECT_EQ(package.problem(),
              "the package python is left out of this build: it needs a build without sanitizers");
}

TEST(TreePackage, has_no_problem_when_it_is_built) {
    const TreePackage package{"dds", "DDS", PackageState::built, ""};
    EXPECT_TRUE(package.built());
    EXPECT_EQ(package.problem(), "");
}

TEST(TreePackages, are_found_by_their_names) {
    ASSERT_FALSE(tree_packages.empty());
    const TreePackage& first = tree_packages.front();
    EXPECT_EQ(find_tree_package(first.name), &first);
    EXPECT_EQ(find_tree_package("nothing"), nullptr);
    EXPECT_EQ(find_tree_package(""), nullptr);
    EXPECT_EQ(package_switch("scocan"), "HALCYON_PACKAGE_SCOCAN");
}

}  // namespace
}  // namespace hal
