// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fmt/core.h>
#include <map>

#include "base/types.hpp"
#include "cli/xml_escape.hpp"
#include "inspect/graph_dot.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

constexpr const char* type_colours[] = {"#b03030", "#2060a0", "#207040", "#507020",
                                        "#206868", "#6a5a10", "#703080"};  // in hal_type's order
constexpr const char* thread_colours[] = {"#cfe3ff", "#ffe2b8", "#d8f0c8", "#f3d0ee",
                                          "#fff3a8", "#d5d5f5", "#c8efe9", "#f7cfc8"};
constexpr const char* centre_colour = " bgcolor=\"#fff2a8\"";

std::string dot_text(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') {
            out += '\\';
        }
        out += c;
    }
    return out + '"';
}

/// Returns the part after the instance's name and dot; the whole name when it has another form.
std::string_view below(const std::string& name, const std::string& owner) {
    if (name.size() > owner.size() + 1 && name.starts_with(owner) && name[owner.size()] == '.') {
        return std::string_view(name).substr(owner.size() + 1);
    }
    return name;
}

class Drawing {
public:
    Drawing(const Model& model, const GraphView& view, const std::string& title)
        : model_(model), view_(view) {
        text_ = fmt::format(
            "digraph {} {{\n    graph [rankdir=LR, fontname=\"sans-serif\", ranksep=1.2, "
            "nodesep=0.3, newrank=true];\n"
            "    node [shape=plain, fontname=\"sans-serif\", fontsize=10];\n    edge "
            "[fontname=\"sans-serif\", fontsize=9, "
            "arrowsize=0.6];\n",
            dot_text(title));
        for (const auto& thread : model.threads) {
            colours_.emplace(thread.get(),
                             thread_colours[colours_.size() % std::size(thread_colours)]);
        }
        legend();
        for (const auto& [name, instances] : view.clusters()) {
            cluster(name, instances);
        }
        for (const Signal* item : view.signals()) {
            signal(*item);
        }
        text_ += "}\n";
    }
    std::string text() && { return std::move(text_); }

private:
    /// Returns the position in the thread, from 1; 0 for none.
    static std::size_t place(const LoadedFunction& function) {
        if (!function.thread || function.init) return 0;
        const auto& all = function.thread->functions;
        const auto at = std::find(all.begin(), all.end(), &function);
        return at == all.end() ? 0 : static_cast<std::size_t>(at - all.begin()) + 1;
    }

    void legend() {
        if (model_.threads.empty()) return;
        text_ +=
            "    threads [label=<<table border=\"0\" cellborder=\"1\" cellspacing=\"0\" "
            "color=\"#808080\">";
        for (const auto& thread : model_.threads) {
            text_ += fmt::format("<tr><td bgcolor=\"{}\">{}, {}</td></tr>",
                                 colours_.at(thread.get()), xml_escape(thread->name),
                                 format_duration(static_cast<double>(thread->options.period_ns)));
        }
        text_ +=
            "<tr><td>dashed, z⁻¹: one cycle old<br/>dotted: from another "
            "thread</td></tr></table>>];\n";
    }

    void cluster(const std::string& name, const std::vector<const Instance*>& instances) {
        if (!name.empty()) {
            text_ += fmt::format(
                "    subgraph {} {{\n    graph [label={}, labeljust=l, style=\"filled,rounded\", "
                "color=\"#b0b0b0\", "
                "fillcolor=\"#f6f6f6\"];\n    node [style=filled, fillcolor=white];\n",
                dot_text("cluster " + name), dot_text(name));
        }
        for (const Instance* item : instances) {
            instance(*item);
        }
        if (!name.empty()) {
            text_ += "    }\n";
        }
    }

    void instance(const Instance& item) {
        const std::string node = fmt::format("i{}", ids_.size());
        ids_.emplace(&item, node);
        std::vector<const Pin*> left, right;
        std::size_t unlinked = 0;
        for (const auto& pin : item.pins) {
            if (pin->dir == HAL_DIR_PARAM) continue;
            if (!pin->signal && !view_.all_pins() && !view_.centre(*pin)) {
                ++unlinked;
                continue;
            }
            (pin->dir == HAL_DIR_OUT ? right : left).push_back(pin.get());
        }
        text_ += fmt::format(
            "    {} [label=<<table border=\"0\" cellborder=\"1\" cellspacing=\"0\" "
            "color=\"#808080\">"
            "<tr><td colspan=\"2\"{}><b>{}</b>{}</td></tr>",
            node, view_.centre(item) ? centre_colour : "", xml_escape(item.name),
            item.component->name == item.name ? "" : " (" + xml_escape(item.component->name) + ")");
        for (const LoadedFunction* function : item.functions) {
            const std::size_t order = place(*function);
            std::string where = "in no thread";
            if (order != 0) {
                where = fmt::format("{}. in {}", order, xml_escape(function->thread->name));
            } else if (function->init) {
                where = fmt::format("once in {}", xml_escape(function->thread->name));
            }
            text_ += fmt::format("<tr><td colspan=\"2\" bgcolor=\"{}\">{}: {}</td></tr>",
                                 function->thread ? colours_.at(function->thread) : "#f4f4f4",
                                 xml_escape(below(function->name, item.name)), where);
        }
        for (std::size_t i = 0; i < std::max(left.size(), right.size()); ++i) {
            text_ += "<tr>";
            cell(item, left, i, "left");
            cell(item, right, i, "right");
            text_ += "</tr>";
        }
        if (unlinked > 0) {
            text_ +=
                fmt::format("<tr><td colspan=\"2\"><font color=\"#707070\">{}</font></td></tr>",
                            counted(unlinked, "unlinked pin"));
        }
        text_ += "</table>>];\n";
    }

    void cell(const Instance& item, const std::vector<const Pin*>& pins, std::size_t i,
              const char* align) {
        if (i >= pins.size()) {
            text_ += "<td></td>";
            return;
        }
        const Pin& pin = *pins[i];
        const std::string port = fmt::format("p{}", ids_.size());
        ids_.emplace(&pin, ids_.at(&item) + ":" + port);
        const std::string label = net_label(pin);
        text_ +=
            fmt::format("<td port=\"{}\" align=\"{}\"{}><font color=\"{}\">{}{}</font></td>", port,
                        align, view_.centre(pin) ? centre_colour : "",
                        pin.signal ? type_colours[static_cast<std::size_t>(pin.type)] : "#a0a0a0",
                        xml_escape(below(pin.name, item.name)),
                        label.empty() ? "" : "  <i>" + xml_escape(label) + "</i>");
    }

    /// Returns the text at a pin for what is not drawn as an edge: a signal with many readers, an
    /// end outside of the neighbourhood.
    std::string net_label(const Pin& pin) const {
        if (!pin.signal) return "";
        const Signal& signal = *pin.signal;
        const Pin* const source = source_of(signal);
        if (source == &pin) {
            const auto hidden =
                std::count_if(signal.pins.begin(), signal.pins.end(),
                              [&](const Pin* other) { return !view_.shows(*other); });
            if (is_hub(signal)) {
                return fmt::format("→ {} ({} readers)", signal.name, signal.pins.size() - 1);
            }
            return hidden > 0 ? fmt::format("→ {} +{}", signal.name, hidden) : "";
        }
        if (is_hub(signal)) {
            return fmt::format("← {}{}", signal.name, source ? age(*source, pin) : "");
        }
        return source && !view_.shows(*source)
                   ? fmt::format("← {}{}", source->name, age(*source, pin))
                   : "";
    }

    /// Returns what a net label has in place of the line's style.
    static std::string age(const Pin& from, const Pin& to) {
        const std::string_view line = style(from, to);
        if (line == "dashed") return " z⁻¹";
        if (line == "dotted") {
            return fmt::format(" from {}", thread_of(from)->name);
        }
        return "";
    }

    /// A pin of a thread or of a function's times is a small node of its own.
    std::string node_of(const Pin& pin) {
        if (const auto known = ids_.find(&pin); known != ids_.end()) return known->second;
        const std::string node = fmt::format("t{}", ids_.size());
        ids_.emplace(&pin, node);
        text_ += fmt::format("    {} [shape=box, height=0.2, margin=0.05, label={}];\n", node,
                             dot_text(pin.name));
        return node;
    }

    /// First and last place of the functions that may use the pin, in its thread.
    static std::pair<std::size_t, std::size_t> places(const Pin& pin) {
        std::size_t first = 0;
        std::size_t last = 0;
        const auto count = [&](const LoadedFunction& function) {
            const std::size_t at = place(function);
            if (at == 0) return;
            first = first == 0 ? at : std::min(first, at);
            last = std::max(last, at);
        };
        if (pin.function) {
            count(*pin.function);
        } else if (pin.instance) {
            for (const LoadedFunction* function : pin.instance->functions) {
                count(*function);
            }
        }
        return {first, last};
    }

    static const char* style(const Pin& from, const Pin& to) {
        const Thread* const writer = thread_of(from);
        const Thread* const reader = thread_of(to);
        if (!writer || !reader) return "solid";
        if (writer != reader) return "dotted";
        return places(to).first <= places(from).second ? "dashed" : "solid";
    }

    void edge(const std::string& from, const std::string& to, const Signal& signal,
              const char* style, bool labelled, bool both) {
        // A value that is one cycle old runs against the order of execution: it does not count for
        // the ranks.
        text_ += fmt::format("    {} -> {} [color=\"{}\", style={}, tooltip={}", from, to,
                             type_colours[static_cast<std::size_t>(signal.type)], style,
                             dot_text(signal.name));
        if (labelled) {
            text_ += ", label=" + dot_text(signal.name);
        }
        if (both) {
            text_ += ", dir=both";
        }
        if (std::string_view(style) == "dashed") {
            text_ += ", headlabel=\"z⁻¹\", constraint=false";
        }
        text_ += "];\n";
    }

    /// A signal without a source, or without readers, is a node of its own.
    std::string node_of(const Signal& item) {
        const std::string node = fmt::format("s{}", ids_.size());
        ids_.emplace(&item, node);
        text_ += fmt::format(
            "    {} [shape=ellipse, style=dashed, height=0.2, margin=0.03, label={}];\n", node,
            dot_text(item.name));
        return node;
    }

    void signal(const Signal& item) {
        if (is_hub(item)) {
            return;  // net labels
        }
        const Pin* const source = source_of(item);
        if (!source) {
            const std::string node = node_of(item);
            for (const Pin* pin : item.pins) {
                if (view_.shows(*pin)) {
                    edge(node, node_of(*pin), item, "solid", false, false);
                }
            }
            return;
        }
        if (!view_.shows(*source)) return;
        const std::string from =
            node_of(*source) + (source->dir == HAL_DIR_OUT && source->instance ? ":e" : "");
        if (item.pins.size() == 1) {
            edge(from, node_of(item), item, "solid", false, false);
        }
        bool first = true;
        for (const Pin* pin : item.pins) {
            if (pin == source || !view_.shows(*pin)) continue;
            edge(from, node_of(*pin) + (pin->instance ? ":w" : ""), item, style(*source, *pin),
                 first, source->dir == HAL_DIR_IO && pin->dir == HAL_DIR_IO);
            first = false;
        }
    }

    const Model& model_;
    const GraphView& view_;
    std::string text_;
    // of instances, pins and signals, as the drawing names them
    std::map<const void*, std::string> ids_;
    std::map<const Thread*, const char*> colours_;
};

}  // namespace

std::string as_dot(const Model& model, const GraphView& view, const std::string& title) {
    return Drawing(model, view, title).text();
}

}  // namespace hal::tools
