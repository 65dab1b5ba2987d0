// SPDX-License-Identifier: MIT
#include "cells/cell.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <unistd.h>

#include "hal/age.hpp"
#include "machine/processes/programs.hpp"
#include "text/characters.hpp"

namespace hal {
namespace {

constexpr const char* watch = NodePins::component;

SessionOptions of_node(SessionOptions options, const std::string& node) {
    options.name += "-" + node;
    return options;
}

ShellOptions of_node(ShellOptions options, const std::string& node) {
    options.node = node;
    return options;
}

}  // namespace

/// Common lines are read once per node: prints each of their diagnostics once.
class Cell::UniqueOutput final : public Output {
public:
    explicit UniqueOutput(Output& to) : to_(to) {}
    void out(std::string_view text) override { to_.out(text); }
    void err(std::string_view text) override {
        // diagnostics are paragraphs
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = std::min(text.find("\n\n", at), text.size());
            std::string_view paragraph = text.substr(at, end - at);
            while (paragraph.ends_with('\n')) {
                paragraph.remove_suffix(1);
            }
            at = end + 2;
            const std::size_t line = paragraph.find('\n');
            const bool whole = line != paragraph.npos;
            // "2 errors" of one node
            const bool count = !whole && !paragraph.empty() && is_digit(paragraph[0]);
            if (paragraph.empty() || count ||
                (whole && !printed_.insert(std::string(paragraph)).second)) {
                continue;
            }
            to_.err((whole && any_ ? "\n" : "") + std::string(paragraph) + "\n");
            any_ = any_ || whole;
        }
    }
    bool is_process() const override { return to_.is_process(); }

private:
    Output& to_;
    std::set<std::string> printed_;
    bool any_ = false;
};

Cell::Cell(std::string name, std::vector<NodeLine> nodes, const SessionOptions& session,
           const ShellOptions& shell)
    : name_(std::move(name)), nodes_(std::move(nodes)), options_(shell) {
    for (const NodeLine& node : nodes_) {
        Machine machine;
        machine.session = std::make_unique<Session>(of_node(session, node.name));
        machine.shell = std::make_unique<Shell>(*machine.session, of_node(shell, node.name));
        machines_.push_back(std::move(machine));
    }
}

Cell::~Cell() {
    for (Machine& machine : machines_) {
        const auto lock = machine.session->lock();
        machine.session->shut_down();
    }
}

std::size_t Cell::find(std::string_view node) const {
    return static_cast<std::size_t>(
        std::find_if(nodes_.begin(), nodes_.end(), [&](const NodeLine& n) {
        return n.name == node;
    }) - nodes_.begin());
}

bool Cell::load(const std::vector<std::string>& files, const std::string& ini, Output& output) {
    UniqueOutput once(output);
    bool good = true;
    for (std::size_t i = 0; i < size(); ++i) {
        Machine& machine = machines_[i];
        {
            const auto lock = machine.session->lock();
            Transaction transaction = machine.session->begin();
            machine.session->programs().model().add_component(transaction, watch, ::getpid(), {});
            for (const NodeLine& other : nodes_) {
                if (other.name == nodes_[i].name) continue;
                const std::string prefix = "node." + other.name;
                ProgramPin age{prefix + ".age-ms", HAL_TYPE_FLOAT, HAL_DIR_OUT};
                age.initial.real = infinite_age;
                for (const ProgramPin& pin :
                     {ProgramPin{prefix + ".online", HAL_TYPE_BIT, HAL_DIR_OUT},
                      ProgramPin{prefix + ".incompatible", HAL_TYPE_BIT, HAL_DIR_OUT}, age}) {
                    std::string problem;
                    machine.session->programs().model().add_pin(transaction, watch, pin, problem);
                }
            }
            Diagnostics none;
            transaction.commit(none);
        }
        if (!ini.empty() && machine.shell->read_ini(ini, once) != 0) return false;
        for (const std::string& file : files) {
            good = machine.shell->run_file(file, once) == 0 && good;
        }
    }
    return good && connect(once);
}

Span Cell::place(std::size_t node, Span span) {
    if (!span.known()) return span;
    const Sources::Source& text = machines_[node].session->sources.get(span.source);
    const auto [at, fresh] = known_texts_.try_emplace({text.name, text.first_line}, 0u);
    if (fresh) {
        at->second = texts_.add(text.name, text.text, text.first_line);
    }
    return {at->second, span.begin, span.end};
}

void Cell::report(Diagnostics& found, Output& output) const {
    if (!found.all().empty() && options_.level != Level::nothing) {
        if (options_.observer) {
            options_.observer->reported(found, texts_);
        }
        output.err(render(found, texts_, options_.color));
    }
}

bool Cell::connect(Output& output) {
    std::vector<NodePart> parts;
    for (std::size_t i = 0; i < size(); ++i) {
        parts.push_back({nodes_[i].name, &machines_[i].session->model(), nodes_[i].rate(),
                         nodes_[i].deadline(), [this, i](Span span) { return place(i, span); }});
    }
    Diagnostics found;
    topics_ = topics_between(parts, found);
    report(found, output);
    return !found.failed();
}

// --- on the virtual clock ------------------------------------------------------------------------

bool Cell::start(Output& output) {
    bool good = true;
    std::vector<std::vector<std::vector<std::string>>> links(size());
    for (const NodeTopic& topic : topics_) {
        for (const NodeField& field : topic.fields) {
            for (const NodeReader& reader : field.readers) {
                Machine& machine = machines_[reader.node];
                const auto lock = machine.session->lock();
                const std::string& from = nodes_[topic.from].name;
                std::string problem;
                ProgramPin pin{"node." + from + "." + field.signal, field.type, HAL_DIR_OUT};
                pin.initial = reader.safe;
                Transaction transaction = machine.session->begin();
                machine.session->programs().model().add_pin(transaction, watch, pin, problem);
                Diagnostics none;
                transaction.commit(none);
                links[reader.node].push_back({"net", field.signal, pin.name});
            }
        }
    }
    for (std::size_t i = 0; i < size(); ++i) {
        if (!links[i].empty()) {
            good = machines_[i].shell->execute(links[i], output,
                                               "<links of node " + nodes_[i].name + ">") == 0 &&
                   good;
        }
        machines_[i].shell->add_latencies(node_latencies(*this, i, true));
        const auto lock = machines_[i].session->lock();
        if (!machines_[i].session->threads().running() &&
            !machines_[i].session->model().threads.empty()) {
            machines_[i].session->threads().start();
        }
        for (const auto& thread : machines_[i].session->model().threads) {
            step_ns_ = std::gcd(step_ns_, thread->options.period_ns);
        }
    }
    if (step_ns_ == 0) {
        step_ns_ = 1'000'000;
    }
    std::vector<SimulatedLinks::Node> nodes;
    for (std::size_t i = 0; i < size(); ++i) {
        nodes.push_back({nodes_[i].name, machines_[i].session.get(), nodes_[i].deadline()});
    }
    links_.emplace(std::move(nodes), topics_);
    return good;
}

void Cell::advance(std::int64_t ns) {
    for (const std::int64_t until = now_ns_ + ns; now_ns_ < until;) {
        const std::int64_t step = std::min(step_ns_, until - now_ns_);
        for (std::size_t i = 0; i < size(); ++i) {
            if (isolated_ != SIZE_MAX && i != isolated_) continue;
            const auto lock = machines_[i].session->lock();
            machines_[i].session->threads().advance_ns(step);
        }
        now_ns_ += step;
        if (isolated_ == SIZE_MAX) {
            links_->update(now_ns_, step);
        }
    }
}

}  // namespace hal
