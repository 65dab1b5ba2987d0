// SPDX-License-Identifier: MIT
// What the netlist tests share: a text in, commands as text out, diagnostics as they are printed.
#pragma once

#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "netlist/netlist.hpp"

namespace netlist_text {

/// "name arg arg" per line: what a parser or an expansion gave.
inline std::string joined(const std::vector<hal::Command>& commands, const char* between = " ") {
    std::string text;
    for (const hal::Command& command : commands) {
        text += command.name.text;
        for (const hal::Token& arg : command.args) {
            text += between + arg.text;
        }
        text += "\n";
    }
    return text;
}

/// One text called test.hal, with `A`, `B` and `LIST` in its environment.
class Netlist : public testing::Test {
protected:
    std::uint32_t add(std::string text) {
        return source_ = sources.add("test.hal", std::move(text));
    }

    std::vector<hal::Command> parse(std::string text) {
        return hal::parse(sources, add(std::move(text)), environment, found);
    }

    /// The commands of a text without fault, a line each, words in <>.
    std::string words(std::string text) {
        std::string out;
        for (const hal::Command& command : parse(std::move(text))) {
            out += "<" + command.name.text + ">";
            for (const hal::Token& arg : command.args) {
                out += " <" + arg.text + ">";
            }
            out += "\n";
        }
        EXPECT_EQ(render(found, sources), "");
        return out;
    }

    /// Returns the diagnostics of a text.
    std::string said(std::string text) {
        parse(std::move(text));
        return render(found, sources);
    }

    /// What the text stands for after expansion.
    std::string expanded(std::string text) {
        std::vector<hal::Command> all;
        for (const hal::Command& command : parse(std::move(text))) {
            for (hal::Command& one : hal::expand(command, found)) {
                all.push_back(std::move(one));
            }
        }
        return joined(all);
    }

    std::string in_source(hal::Span span) const { return std::string(sources.text(span)); }

    hal::Sources sources;
    hal::Diagnostics found;
    hal::Environment environment{
        .ini = nullptr, .variable = [](const std::string& name) -> std::optional<std::string> {
        if (name == "A") return "alpha";
        if (name == "B") return "two words";
        if (name == "EMPTY") return "";
        if (name == "QUOTED") return "\"one word\"";
        if (name == "HALF") return "\"half";
        if (name == "HASH") return "a#b";
        if (name == "LIST") {
            return "{x,y}";
        }
        if (name == "LONG") return std::string(1 << 20, 'l');
        return std::nullopt;
    }};

private:
    std::uint32_t source_ = 0;
};

/// A directory that goes when the test does.
class Folder {
public:
    Folder()
        : path_(std::filesystem::temp_directory_path() /
                ("halcyon-netlist-" + std::to_string(::getpid()))) {
        std::filesystem::create_directories(path_);
    }
    ~Folder() { std::filesystem::remove_all(path_); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(path_ / name, std::ios::binary) << text;
        return path_ / name;
    }
    std::string path(const std::string& name) const { return path_ / name; }

private:
    std::filesystem::path path_;
};

}  // namespace netlist_text
