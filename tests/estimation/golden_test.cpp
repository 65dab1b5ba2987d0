// SPDX-License-Identifier: MIT
// Riccati's equations and the gains that follow from them, against SciPy and python-control with
// SLICOT (golden/make.py).
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "estimation/design/riccati.hpp"
#include "estimation/matrices.hpp"
#include "golden/golden.hpp"
#include "unit/components/component_host.hpp"

namespace {

using namespace hal::estimation;
using golden::Case;

constexpr double decimals = 1e-8;

Dense matrix(const Case& c, const char* name) {
    MatrixText text;
    text.read_rows(name, c.arguments.at(name));
    EXPECT_TRUE(text.problems.empty());
    return text.found.at(0).value;
}

void expect_near(const Dense& got, const std::vector<double>& wanted, const char* what) {
    ASSERT_EQ(static_cast<std::size_t>(got.size()), wanted.size()) << what;
    for (Eigen::Index i = 0; i < got.rows(); ++i) {
        for (Eigen::Index j = 0; j < got.cols(); ++j) {
            const double w = wanted[static_cast<std::size_t>(i * got.cols() + j)];
            EXPECT_NEAR(got(i, j), w, decimals * std::max(1.0, std::fabs(w)))
                << what << " " << i << " " << j;
        }
    }
}

struct Golden : testing::TestWithParam<Case> {};

TEST_P(Golden, Solution_of_the_equation_agrees_with_SciPy_and_SLICOT) {
    const Case& c = GetParam();
    std::optional<Riccati> solved;
    const std::string plant = c.arguments.at("plant");
    if (c.component == std::string("kalman")) {
        solved = discrete_riccati(matrix(c, "a").transpose(), matrix(c, "c").transpose(),
                                  matrix(c, "qn"), matrix(c, "rn"));
    } else if (plant == "continuous") {
        solved = continuous_riccati(matrix(c, "a"), matrix(c, "b"), matrix(c, "q"), matrix(c, "r"));
    } else if (plant == "discrete") {
        solved = discrete_riccati(matrix(c, "a"), matrix(c, "b"), matrix(c, "q"), matrix(c, "r"));
    } else {
        const Sampled s =
            sample(matrix(c, "a"), matrix(c, "b"), matrix(c, "q"), matrix(c, "r"), 0.001);
        solved = discrete_riccati(s.a, s.b, s.q, s.r, s.n);
    }
    ASSERT_TRUE(solved);
    expect_near(solved->x, c.x, "X");
    EXPECT_LE(solved->doublings, 40);
}

TEST_P(Golden, Component_has_the_gain) {
    const Case& c = GetParam();
    hal::test::Arguments arguments(c.arguments.begin(), c.arguments.end());
    hal::test::Instance instance(c.component, arguments);
    if (c.component == std::string("kalman")) {  // its gain settles as the covariance does
        instance.set("show-gains", true);
        instance.run("update", 1'000'000, 20'000);
    }
    Dense gain(c.rows, c.columns);
    for (int i = 0; i < c.rows; ++i) {
        for (int j = 0; j < c.columns; ++j) {
            gain(i, j) =
                instance.get<double>("gain-" + std::to_string(i) + "-" + std::to_string(j));
        }
    }
    expect_near(gain, c.gain, "K");
}

INSTANTIATE_TEST_SUITE_P(Of, Golden, testing::ValuesIn(golden::cases), [](const auto& of) {
    return std::string(of.param.component) + "_" + of.param.name;
});

}  // namespace
