// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fmt/core.h>
#include <map>

#include "inspect/graph_dot.hpp"
#include "base/types.hpp"
#include "cli/xml_escape.hpp"

namespace hal::tools {

namespace {

constexpr const char* type_colours[] = {"#b03030", "#2060a0", "#207040", "#507020",
                                        "#206868", "#6a5a10", "#703080"};  // in hal_type's order
constexpr const char* thread_colours[] = {"#cfe3ff", "#ffe2b8", "#d8f0c8", "#f3d0ee", "#fff3a8", "#d5d5f5", "#c8efe9", "#f7cfc8"};

std::string quoted(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        out += c;
    }
    return out + '"';
}

/// Returns the part after the instance's name and dot; the whole name when it has another form.
std::string_view below(const std::string& name, const std::string& owner) {
    if (name.size() > owner.size() + 1 && name.starts_with(owner) && name[owner.size()] == '.')
        return std::string_view(name).substr(owner.size() + 1);
    return name;
}

class Drawing {
public:
    Drawing(const Model& model, const std::string& title) : model_(model) {
        text_ = fmt::format(
            "digraph {} {{\n    graph [rankdir=LR, fontname=\"sans-serif\", ranksep=1.2, nodesep=0.3];\n"
            "    node [shape=plain, fontname=\"sans-serif\", fontsize=10];\n    edge [fontname=\"sans-serif\", fontsize=9, "
            "arrowsize=0.6];\n",
            quoted(title));
        for (const auto& thread : model.threads)
            colours_.emplace(thread.get(), thread_colours[colours_.size() % std::size(thread_colours)]);
        legend();
        for (const auto& component : model.components)
            for (const auto& item : component->instances) instance(*item);
        for (const Signal* item : model.sorted_signals()) signal(*item);
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
        text_ += "    threads [label=<<table border=\"0\" cellborder=\"1\" cellspacing=\"0\" color=\"#808080\">";
        for (const auto& thread : model_.threads)
            text_ += fmt::format("<tr><td bgcolor=\"{}\">{}, {}</td></tr>", colours_.at(thread.get()), xml_escape(thread->name),
                                 format_duration(static_cast<double>(thread->options.period_ns)));
        text_ += "<tr><td>dashed: one cycle old<br/>dotted: from another thread</td></tr></table>>];\n";
    }

    void instance(const Instance& item) {
        const std::string node = fmt::format("i{}", ids_.size());
        ids_.emplace(&item, node);
        std::vector<const Pin*> left, right;
        for (const auto& pin : item.pins) {
            if (pin->dir == HAL_DIR_PARAM) continue;
            (pin->dir == HAL_DIR_OUT ? right : left).push_back(pin.get());
        }
        text_ += fmt::format(
            "    {} [label=<<table border=\"0\" cellborder=\"1\" cellspacing=\"0\" color=\"#808080\">"
            "<tr><td colspan=\"2\"><b>{}</b>{}</td></tr>",
            node, xml_escape(item.name), item.component->name == item.name ? "" : " (" + xml_escape(item.component->name) + ")");
        for (const LoadedFunction* function : item.functions) {
            const std::size_t order = place(*function);
            const std::string where = order != 0       ? fmt::format("{}. in {}", order, xml_escape(function->thread->name))
                                      : function->init ? fmt::format("once in {}", xml_escape(function->thread->name))
                                                       : "in no thread";
            text_ +=
                fmt::format("<tr><td colspan=\"2\" bgcolor=\"{}\">{}: {}</td></tr>",
                            function->thread ? colours_.at(function->thread) : "#f4f4f4", xml_escape(below(function->name, item.name)), where);
        }
        for (std::size_t i = 0; i < std::max(left.size(), right.size()); ++i) {
            text_ += "<tr>";
            cell(item, left, i, "left");
            cell(item, right, i, "right");
            text_ += "</tr>";
        }
        text_ += "</table>>];\n";
    }

    void cell(const Instance& item, const std::vector<const Pin*>& pins, std::size_t i, const char* align) {
        if (i >= pins.size()) {
            text_ += "<td></td>";
            return;
        }
        const Pin& pin = *pins[i];
        const std::string port = fmt::format("p{}", ids_.size());
        ids_.emplace(&pin, ids_.at(&item) + ":" + port);
        text_ +=
            fmt::format("<td port=\"{}\" align=\"{}\"><font color=\"{}\">{}</font></td>", port, align,
                        pin.signal ? type_colours[static_cast<std::size_t>(pin.type)] : "#a0a0a0", xml_escape(below(pin.name, item.name)));
    }

    /// A pin of a thread or of a function's times is a small node of its own.
    std::string node_of(const Pin& pin) {
        if (const auto known = ids_.find(&pin); known != ids_.end()) return known->second;
        const std::string node = fmt::format("t{}", ids_.size());
        ids_.emplace(&pin, node);
        text_ += fmt::format("    {} [shape=box, height=0.2, margin=0.05, label={}];\n", node, quoted(pin.name));
        return node;
    }

    /// First and last place of the functions that may use the pin, in its thread.
    static std::pair<std::size_t, std::size_t> places(const Pin& pin) {
        std::size_t first = 0, last = 0;
        const auto count = [&](const LoadedFunction& function) {
            const std::size_t at = place(function);
            if (at == 0) return;
            first = first == 0 ? at : std::min(first, at);
            last = std::max(last, at);
        };
        if (pin.function) count(*pin.function);
        else if (pin.instance)
            for (const LoadedFunction* function : pin.instance->functions) count(*function);
        return {first, last};
    }

    static const char* style(const Pin& from, const Pin& to) {
        const Thread* const writer = thread_of(from);
        const Thread* const reader = thread_of(to);
        if (!writer || !reader) return "solid";
        if (writer != reader) return "dotted";
        return places(to).first <= places(from).second ? "dashed" : "solid";
    }

    void edge(const std::string& from, const std::string& to, const Signal& signal, const char* style, bool labelled, bool both) {
        text_ += fmt::format("    {} -> {} [color=\"{}\", style={}, tooltip={}{}{}];\n", from, to,
                             type_colours[static_cast<std::size_t>(signal.type)], style, quoted(signal.name),
                             labelled ? ", label=" + quoted(signal.name) : "", both ? ", dir=both" : "");
    }

    void signal(const Signal& item) {
        const Pin* source = item.writer;
        if (!source)
            for (const Pin* pin : item.pins)
                if (pin->dir == HAL_DIR_IO && !source) source = pin;
        bool first = true;
        if (!source) {
            const std::string node = fmt::format("s{}", ids_.size());
            ids_.emplace(&item, node);
            text_ += fmt::format("    {} [shape=ellipse, style=dashed, height=0.2, margin=0.03, label={}];\n", node, quoted(item.name));
            for (const Pin* pin : item.pins) edge(node, node_of(*pin), item, "solid", false, false);
            return;
        }
        const std::string from = node_of(*source) + (source->dir == HAL_DIR_OUT && source->instance ? ":e" : "");
        for (const Pin* pin : item.pins) {
            if (pin == source) continue;
            edge(from, node_of(*pin) + (pin->instance ? ":w" : ""), item, style(*source, *pin), first,
                 source->dir == HAL_DIR_IO && pin->dir == HAL_DIR_IO);
            first = false;
        }
        if (first) {  // nobody reads it: it is drawn all the same
            const std::string node = fmt::format("s{}", ids_.size());
            ids_.emplace(&item, node);
            text_ += fmt::format("    {} [shape=ellipse, style=dashed, height=0.2, margin=0.03, label={}];\n", node, quoted(item.name));
            edge(from, node, item, "solid", false, false);
        }
    }

    const Model& model_;
    std::string text_;
    std::map<const void*, std::string> ids_;  // of instances, pins and signals, as the drawing names them
    std::map<const Thread*, const char*> colours_;
};

}  // namespace

std::string as_dot(const Model& model, const std::string& title) { return Drawing(model, title).text(); }

}  // namespace hal::tools
