// SPDX-License-Identifier: MIT
#include "cells/simulated_links.hpp"

#include <algorithm>

#include "base/types.hpp"

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
    : nodes_(std::move(nodes)), topics_(topics), sent_(topics.size()) {
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
    const Session& reader = *nodes_[partner.reader].session;
    const bool runs = reader.threads().running();
    if (!runs) {
        forget(partner, writes);
    }
    bool online = runs;
    bool shows_age = false;
    double age_ms = runs ? 0.0 : std::numeric_limits<double>::infinity();
    for (Reception& reception : partner.receptions) {
        const auto& values = sent_[static_cast<std::size_t>(reception.topic - topics_.data())];
        if (runs && values) {
            receive(partner, reception, *values, writes);
        }
        check_deadline(partner, reception, writes);
        online = online && reception.valid;
        shows_age = shows_age || is_due(*reception.topic, step_ns);
        const bool has_values = reception.received_ns != never;
        age_ms = std::max(age_ms, has_values
                                      ? static_cast<double>(now_ns_ - reception.received_ns) * 1e-6
                                      : std::numeric_limits<double>::infinity());
    }
    const bool changes = online != partner.online;
    if (changes) {
        partner.online = online;
        write(partner, "online", hal_value{.raw = online ? 1U : 0U}, writes);
    }
    if ((changes || shows_age || !runs) && age_ms != partner.age_ms) {
        partner.age_ms = age_ms;
        write(partner, "age-ms", hal_value{.real = age_ms}, writes);
    }
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

/// The reader is stopped: what it received is invalid, without a fault.
void SimulatedLinks::forget(Partner& partner, Writes& writes) {
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
