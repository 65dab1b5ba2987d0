// SPDX-License-Identifier: MIT
// What a user gives a filter or a controller: a file of matrices, or a model in formulas. The first
// byte chooses which.
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "estimation/matrices.hpp"
#include "estimation/model.hpp"
#include "tests/fuzz/driver/require.hpp"

using namespace hal::estimation;
using hal::fuzz::require;

namespace {

template <class Problems>
void places(const Problems& problems, std::size_t size) {
    for (const auto& p : problems) {
        require(p.begin <= p.end && p.end <= size, "a problem has a place in the text");
        require(!p.sentence.empty() && !p.help.empty(), "a problem has a message and a help text");
    }
}

void matrices(const std::string& text) {
    MatrixText read;
    read.read_file(text);
    places(read.problems, text.size());
    if (!read.problems.empty()) return;
    for (const Given& given : read.found) {
        require(given.value.rows() >= 1 && given.value.rows() <= max && given.value.cols() >= 1 &&
                    given.value.cols() <= max,
                "a matrix that is taken has a size that one may have");
        require(given.value.allFinite(), "and consists of numbers");
    }
}

void model(const std::string& text) {
    Model read;
    read.read(text);
    places(read.problems, text.size());
    if (!read.problems.empty()) return;
    require(!read.states.empty() && read.states.size() <= max_slopes && !read.measures.empty() &&
                read.inputs.size() <= Model::max_inputs,
            "a model that is taken has states and measurements, and not too many");
    std::vector<Dual> values(read.variables());
    for (std::size_t i = 0; i < read.constants.size(); ++i) {
        require(std::isfinite(read.constants[i]), "a constant is a number");
        values[max_slopes + Model::max_inputs + i].value = read.constants[i];
    }
    for (const Model::State& s : read.states) {
        require(s.sigma >= 0.0 && s.noise >= 0.0 && std::isfinite(s.start),
                "so are the state's figures");
        s.rate(values.data(), read.states.size());
    }
    for (const Model::Measure& m : read.measures) {
        require(m.sigma > 0.0, "and those of a measurement");
        m.value(values.data(), read.states.size());
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
    if (data[0] == 'm') {
        matrices(text);
    } else {
        model(text);
    }
    return 0;
}
