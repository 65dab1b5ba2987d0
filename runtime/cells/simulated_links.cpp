// SPDX-License-Identifier: MIT
#include "cells/simulated_links.hpp"

#include <algorithm>

#include "base/types.hpp"
#include "hal/age.hpp"

namespace hal {
namespace {

const NodeReader* reader_of(const NodeField& field, std::size_t node) {
    const auto at = std::find_if(field.readers.begin(), field.readers.end(),
                                 [node](const NodeReader& reader) { return reader.node == node; });
    return at == field.readers.end() ? nullptr : &*at;
}

/// Returns the name of the thread of `reader` that would subscribe to the topic; empty: it has
/// none.
std::string thread_of(const NodeTopic& topic, std::size_t reader, const Model& model) {
    std::vector<const Pin*> pins;
    for (const NodeField& field : topic.fields) {
        if (const NodeReader* const one = reader_of(field, reader)) {
            pins.insert(pins.end(), one->pins.begin(), one->pins.end());
        }
    }
    const Thread* const thread = thread_for(model, pins);
    return thread ? thread->name : "";
}

}  // namespace

SimulatedLinks::SimulatedLinks(std::vector<Node> nodes, const std::vector<NodeTopic>& topics)
    : nodes_(std::move(nodes)), topics_(topics), is_alive_(nodes_.size()), sent_(topics.size()) {
    for (const Node& node : nodes_) {
        had_threads_.push_back(!node.session->model().threads.empty());
    }
    for (std::size_t reader = 0; reader < nodes_.size(); ++reader) {
        for (std::size_t other = 0; other < nodes_.size(); ++other) {
            if (other == reader) continue;
            Partner& partner = partners_.emplace_back(Partner{reader, other});
            for (const NodeTopic& topic : topics_) {
                if (topic.from != other || !topic.read_by(reader)) continue;
                Reception& reception = partner.receptions.emplace_back();
                reception.topic = &topic;
                reception.thread = thread_of(topic, reader, nodes_[reader].session->model());
                reception.fault = "node '" + nodes_[other].name + "' sent no signals of thread '" +
                                  topic.thread + "' for {} s (deadline " +
                                  format_duration(static_cast<double>(topic.deadline_ns)) +
                                  "); they have their safe values; see: show pin node";
            }
        }
    }
}

void SimulatedLinks::update(std::int64_t now_ns, std::int64_t step_ns) {
    now_ns_ = now_ns;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        const auto lock = nodes_[i].session->lock();
        is_alive_[i] = !had_threads_[i] || !nodes_[i].session->model().threads.empty();
    }
    for (std::size_t i = 0; i < topics_.size(); ++i) {
        sent_[i] = is_due(topics_[i], step_ns) ? values_of(topics_[i]) : std::nullopt;
    }
    for (std::size_t reader = 0; reader < nodes_.size(); ++reader) {
        const auto lock = nodes_[reader].session->lock();
        Writes writes;
        for (Partner& partner : partners_) {
            if (partner.reader == reader) {
                update(partner, step_ns, writes);
            }
        }
        if (!writes.empty()) {
            nodes_[reader].session->values().write(writes);
        }
    }
}

std::optional<SimulatedLinks::Values> SimulatedLinks::values_of(const NodeTopic& topic) {
    Session& session = *nodes_[topic.from].session;
    const auto lock = session.lock();
    if (!session.threads().runs(topic.thread)) return std::nullopt;
    std::vector<std::string> names;
    for (const NodeField& field : topic.fields) {
        names.push_back(field.signal);
    }
    return session.values().read(names);
}

void SimulatedLinks::update(Partner& partner, std::int64_t step_ns, Writes& writes) {
    const bool runs =
        nodes_[partner.reader].session->threads().running() && is_alive_[partner.reader];
    if (!runs) {
        forget(partner, writes);
    } else if (is_alive_[partner.other]) {
        partner.seen_ns = now_ns_;
    }
    const bool all_valid = receive(partner, runs, writes);
    const bool online = runs && all_valid && is_online(partner);
    const double age = age_ms(partner);
    const bool changes = online != partner.online;
    if (changes) {
        partner.online = online;
        write(partner, "online", hal_value{.raw = online ? 1U : 0U}, writes);
    }
    const auto shows_age = [&](const Reception& reception) {
        return is_due(*reception.topic, step_ns);
    };
    const bool is_shown =
        changes || !runs || partner.receptions.empty() ||
        std::any_of(partner.receptions.begin(), partner.receptions.end(), shows_age);
    if (is_shown && age != partner.age_ms) {
        partner.age_ms = age;
        write(partner, "age-ms", hal_value{.real = age}, writes);
    }
}

bool SimulatedLinks::receive(Partner& partner, bool runs, Writes& writes) {
    bool all_valid = true;
    for (Reception& reception : partner.receptions) {
        const auto& values = sent_[static_cast<std::size_t>(reception.topic - topics_.data())];
        if (runs && values) {
            receive(partner, reception, *values, writes);
        }
        check_deadline(partner, reception, writes);
        all_valid = all_valid && reception.valid;
    }
    return all_valid;
}

bool SimulatedLinks::is_online(const Partner& partner) const {
    if (!partner.receptions.empty()) return true;  // by its values
    return partner.seen_ns != never &&
           now_ns_ - partner.seen_ns <= nodes_[partner.other].deadline_ns;
}

double SimulatedLinks::age_ms(const Partner& partner) const {
    const auto age_of = [this](std::int64_t since_ns) {
        return since_ns == never ? infinite_age : static_cast<double>(now_ns_ - since_ns) * 1e-6;
    };
    if (partner.receptions.empty()) return age_of(partner.seen_ns);
    double oldest = 0.0;
    for (const Reception& reception : partner.receptions) {
        oldest = std::max(oldest, age_of(reception.received_ns));
    }
    return oldest;
}

void SimulatedLinks::receive(const Partner& partner, Reception& reception, const Values& values,
                             Writes& writes) {
    for (std::size_t i = 0; i < values.size(); ++i) {
        const NodeField& field = reception.topic->fields[i];
        if (values[i] && reader_of(field, partner.reader)) {
            write(partner, field.signal, values[i]->value, writes);
        }
    }
    reception.received_ns = now_ns_;
    if (!reception.valid) {
        reception.valid = true;
        nodes_[partner.reader].session->threads().end_fault(reception.fault.c_str());
    }
}

void SimulatedLinks::check_deadline(const Partner& partner, Reception& reception, Writes& writes) {
    if (!reception.valid) return;
    const std::int64_t silence_ns = now_ns_ - reception.received_ns;
    if (silence_ns <= reception.topic->deadline_ns) return;
    make_safe(partner, reception, writes);
    nodes_[partner.reader].session->threads().begin_fault(reception.thread, reception.fault.c_str(),
                                                          static_cast<double>(silence_ns) * 1e-9);
}

void SimulatedLinks::make_safe(const Partner& partner, Reception& reception, Writes& writes) {
    reception.valid = false;
    for (const NodeField& field : reception.topic->fields) {
        if (const NodeReader* const reader = reader_of(field, partner.reader)) {
            write(partner, field.signal, reader->safe, writes);
        }
    }
}

/// The reader is stopped, or its threads are deleted: what it received is invalid, without a fault.
void SimulatedLinks::forget(Partner& partner, Writes& writes) {
    partner.seen_ns = never;
    for (Reception& reception : partner.receptions) {
        if (reception.received_ns == never) continue;
        make_safe(partner, reception, writes);
        reception.received_ns = never;
        nodes_[partner.reader].session->threads().end_fault(reception.fault.c_str());
    }
}

/// Adds a value for the pin `node.OTHER.NAME` of the reader, unless it was removed.
void SimulatedLinks::write(const Partner& partner, const std::string& name, hal_value value,
                           Writes& writes) {
    Session& session = *nodes_[partner.reader].session;
    if (Pin* const pin =
            session.model().find_pin("node." + nodes_[partner.other].name + "." + name)) {
        writes.emplace_back(pin, value);
    }
}

}  // namespace hal
