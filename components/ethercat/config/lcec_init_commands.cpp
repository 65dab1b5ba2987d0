// SPDX-License-Identifier: MIT
#include "ethercat/config/lcec_init_commands.hpp"

#include <algorithm>
#include <optional>

#include "ethercat/esi/esi_xml.hpp"

namespace hal::ethercat::config {

namespace {

using esi::Xml;
using master::StartupWrite;

class InitFile {
public:
    InitFile(std::string_view text, const InitProblem& report) : text_(text), report_(report) {}

    std::vector<StartupWrite> read() {
        pugi::xml_document document;
        const auto result = document.load_buffer(text_.data(), text_.size());
        if (!result) {
            const auto at = std::min(
                static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0)), text_.size());
            report_(true,
                    1 + static_cast<std::uint32_t>(std::count(
                            text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at), '\n')),
                    "invalid XML: " + std::string(result.description()),
                    "the file begins with <EtherCATMailbox>");
            return {};
        }
        const Xml root = document.document_element();
        if (std::string_view(root.name()) != "EtherCATMailbox") {
            error(root,
                  "the root element is '" + std::string(root.name()) + "', not EtherCATMailbox",
                  "export the start-up commands of the slave in TwinCAT");
            return {};
        }
        for (const bool soe : {false, true}) {
            for (const Xml list : root.child(soe ? "SoE" : "CoE").children("InitCmds")) {
                for (const Xml command : list.children("InitCmd")) {
                    take(command, soe);
                }
            }
        }
        if (!failed_ && in_preop_.empty() && late_.empty()) {
            error(root, "the file writes nothing",
                  "it has <CoE><InitCmds><InitCmd> or <SoE><InitCmds><InitCmd>");
        }
        std::stable_sort(in_preop_.begin(), in_preop_.end(),
                         [](const auto& a, const auto& b) { return a.first < b.first; });
        for (auto& [transition, write] : in_preop_) {
            early_.push_back(std::move(write));
        }
        early_.insert(early_.end(), late_.begin(), late_.end());
        return std::move(early_);
    }

private:
    void error(const Xml& at, std::string sentence, std::string help) {
        failed_ = true;
        report_(true, esi::span_of(at, text_).line, std::move(sentence), std::move(help));
    }
    std::optional<std::int64_t> number(const Xml& command, const char* name, std::int64_t max,
                                       std::int64_t otherwise) {
        const Xml child = command.child(name);
        if (!child) {
            if (otherwise >= 0) return otherwise;
            error(command, "missing <" + std::string(name) + "> in <InitCmd>",
                  "write the number in decimal, or as #x6040");
            return {};
        }
        const auto value = esi::number(trimmed(child.child_value()));
        if (value && *value >= 0 && *value <= max) return value;
        error(
            child,
            "invalid " + std::string(name) + " '" + std::string(trimmed(child.child_value())) + "'",
            "write a number of 0.." + std::to_string(max) + " in decimal, or as #x6040");
        return {};
    }
    static bool yes(std::string_view text) { return same_word(text, "true") || text == "1"; }

    /// How an initial command of a protocol is written.
    struct Names {
        const char* operation;  ///< client command of CoE, operation code of SoE
        std::int64_t write;     ///< the operation that writes
        const char* index;
        const char* sub;
        std::int64_t max_sub;
    };
    static constexpr Names coe_names{"Ccs", 1, "Index", "SubIndex", 0xff};
    static constexpr Names soe_names{"OpCode", 3, "IDN", "DriveNo", 7};

    /// Reads an <InitCmd> that writes an object, as a write at the transition that it names. Other
    /// commands are left out.
    void take(const Xml& command, bool soe) {
        if (yes(trimmed(command.child_value("Disabled")))) return;
        const Names& names = soe ? soe_names : coe_names;
        const auto operation = number(command, names.operation, 255, names.write);
        const auto index = number(command, names.index, 0xffff, -1);
        const auto sub = number(command, names.sub, names.max_sub, 0);
        if (!operation || !index || !sub || *operation != names.write) return;
        const auto data = esi::hex_bytes(command.child_value("Data"));
        if (!data || data->empty()) {
            return error(
                command, std::string(data ? "missing" : "invalid") + " <Data> in <InitCmd>",
                "write hexadecimal bytes in the order of the wire, as in <Data>e803</Data>");
        }
        StartupWrite w;
        w.protocol = soe ? StartupWrite::Protocol::soe : StartupWrite::Protocol::coe;
        w.index = static_cast<std::uint16_t>(*index);
        w.sub = static_cast<std::uint8_t>(*sub);

        w.data = *data;
        w.complete = !soe && yes(command.attribute("CompleteAccess").value());
        if (!command.child("Transition")) {
            error(command, "missing <Transition> in <InitCmd>",
                  "write <Transition>PS</Transition>");
        }
        for (const Xml t : command.children("Transition")) {
            const std::string_view name = trimmed(t.child_value());
            w.before = name == "SO" ? State::op : State::safeop;
            if (name == "IP" || name == "PS") {
                in_preop_.emplace_back(name == "PS", w);
            } else if (name == "SO") {
                late_.push_back(w);
            } else {
                report_(false, esi::span_of(t, text_).line,
                        "a command at transition '" + std::string(name) + "' is left out",
                        "only IP, PS and SO are executed");
            }
        }
    }

    std::string_view text_;
    const InitProblem& report_;
    std::vector<std::pair<bool, StartupWrite>> in_preop_;  // PS: true
    std::vector<StartupWrite> early_, late_;
    bool failed_ = false;
};

}  // namespace

std::vector<StartupWrite> read_init_commands(std::string_view xml, const InitProblem& report) {
    return InitFile(xml, report).read();
}

}  // namespace hal::ethercat::config
