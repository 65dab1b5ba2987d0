// SPDX-License-Identifier: MIT
#include "lsp/outline.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "base/types.hpp"
#include "commands/listing.hpp"
#include "lsp/protocol.hpp"

namespace hal::tools {

using protocol::Json;

namespace {

/// SymbolKind of Language Server Protocol 3.17.
enum Kind { property = 7, function_symbol = 12, variable = 13, object = 19, event = 24 };

Json symbol(const TextDocument& document, const Occurrence& at, const std::string& name,
            const std::string& detail, Kind kind) {
    const Json range = protocol::to_json(document.range(at.begin, at.end));
    return {{"name", name},   {"detail", detail},        {"kind", kind},
            {"range", range}, {"selectionRange", range}, {"children", Json::array()}};
}

class Outline {
public:
    Outline(const NetlistIndex& index, const TextDocument& document)
        : index_(index), document_(document) {}

    Json of(const std::vector<Occurrence>& mentions) {
        for (const Occurrence& one : mentions) {
            if (one.kind == NameKind::instance && one.defines) {
                instance(one, one.name);
            }
        }
        for (const Occurrence& one : mentions) {
            add(one);
        }
        Json all = Json::array();
        for (Json& one : symbols_) {
            all.push_back(std::move(one));
        }
        return all;
    }

private:
    void add(const Occurrence& one) {
        const bool of_instance = !one.instance.empty();
        if (one.kind == NameKind::pin && of_instance) {
            const Pin* const pin = index_.find_pin(one.name);
            const std::string detail =
                pin ? std::string(name(pin->type)) + " " + direction_text(*pin) : "";
            child(instance(one, one.instance), one, detail, property);
        } else if (one.kind == NameKind::function && of_instance) {
            const LoadedFunction* const function = index_.find_function(one.name);
            const Thread* const thread = function ? function->thread : nullptr;
            child(instance(one, one.instance), one, thread ? thread->name : "", function_symbol);
        } else if (one.kind == NameKind::signal && one.defines) {
            top(one, "signal " + one.name, one.name, "signal", variable);
        } else if (one.kind == NameKind::thread && one.defines) {
            top(one, "thread " + one.name, one.name, "thread", event);
        }
    }

    /// Returns the index of the symbol of an instance, which may be made in another file.
    std::size_t instance(const Occurrence& at, const std::string& name) {
        const Instance* const found = index_.find_instance(name);
        const std::string component = found ? found->component->name : "";
        return top(at, "instance " + name, name, component, object);
    }

    std::size_t top(const Occurrence& at, const std::string& key, const std::string& name,
                    const std::string& detail, Kind kind) {
        const auto [found, fresh] = by_key_.try_emplace(key, symbols_.size());
        if (fresh) {
            symbols_.push_back(symbol(document_, at, name, detail, kind));
        }
        return found->second;
    }

    void child(std::size_t parent, const Occurrence& at, const std::string& detail, Kind kind) {
        if (!children_.insert(at.name).second) return;
        symbols_[parent]["children"].push_back(symbol(document_, at, at.name, detail, kind));
    }

    const NetlistIndex& index_;
    const TextDocument& document_;
    std::vector<Json> symbols_;
    std::map<std::string, std::size_t> by_key_;
    std::set<std::string> children_;
};

}  // namespace

Json outline(const NetlistIndex& index, const TextDocument& document, const std::string& path) {
    return Outline(index, document).of(index.in_text(path));
}

}  // namespace hal::tools
