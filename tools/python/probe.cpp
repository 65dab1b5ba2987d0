// SPDX-License-Identifier: MIT
#include "probe.hpp"

#include <pybind11/stl.h>
#include <unistd.h>

#include "component.hpp"
#include "released_gil.hpp"

namespace hal::python {

Probe::Probe(const std::vector<std::string>& names, std::uint32_t every, int batch_ms,
             int buffer_ms)
    : process_(::getpid()) {
    const ReleasedGil release_gil;
    client_ = connect_to_instance();
    ProbeClient::Options options;
    options.every = every;
    options.batch_ms = batch_ms;
    options.buffer_ms = buffer_ms;
    std::string problem;
    probe_ = ProbeClient::attach(*client_, names, options, problem);
    if (!probe_) throw Problem(problem);
}

Probe::~Probe() {
    if (is_inherited()) {
        client_->close_in_child();  // what a probe sends at its end would end that of the parent
    }
}

bool Probe::is_inherited() const { return process_ != ::getpid(); }

py::list Probe::columns() const {
    py::list all;
    for (const ProbeColumn& column : probe_->columns()) {
        all.append(
            py::make_tuple(column.name, std::string(1, row(column.type).letter), column.unit));
    }
    return all;
}

py::list Probe::next(int timeout_ms) {
    if (is_inherited()) {
        throw Problem(
            "the probe belongs to the parent process; create one of its own in the child");
    }
    ProbeBatch batch;
    auto got = ProbeClient::Got::nothing;
    {
        const ReleasedGil release_gil;
        do {
            got = probe_->next(batch, timeout_ms);
        } while (got == ProbeClient::Got::layout || got == ProbeClient::Got::journal);
    }
    if (got == ProbeClient::Got::disconnected) {
        throw Problem("instance '" + client_->instance() + "' has ended");
    }
    py::list parts;
    if (got == ProbeClient::Got::nothing) return parts;
    for (const ProbeBatch::Part& part : batch.parts) {
        const ProbeGroup& group = probe_->groups().at(part.group);
        parts.append(py::make_tuple(
            group.thread, group.columns, part.rows, part.lost,
            py::bytes(batch.bytes.data() + part.offset, part.rows * (part.columns + 2) * 8)));
    }
    return parts;
}

}  // namespace hal::python
