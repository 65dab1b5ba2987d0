// SPDX-License-Identifier: MIT
// The texts that an editor has open, in place of the files on the disk, for everything in this
// process that reads a file: netlists, INI files, and the plugins' own configurations.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>

namespace hal::tools {

/// One per process, because plugins find it by a symbol of the program (hal/read_file.hpp). [setup]
class EditorTexts {
public:
    static EditorTexts& instance();
    EditorTexts(const EditorTexts&) = delete;

    /// Sets the text of a file by its canonical path.
    void set(const std::string& path, std::string text);
    /// From now on the file has what is on the disk.
    void erase(const std::string& path);
    /// Returns the text of a file, nullptr when no editor has it open.
    const std::string* find(const std::string& path) const;

    /// Replaces texts while it exists.
    class Override {
    public:
        explicit Override(std::map<std::string, std::string> texts);
        ~Override();
        Override(const Override&) = delete;

    private:
        std::map<std::string, std::shared_ptr<const std::string>> before_;
    };

    /// Collects the canonical paths of all files that are read while it exists. One at a time.
    class Recorder {
    public:
        Recorder() { instance().recorded_ = &paths; }
        ~Recorder() { instance().recorded_ = nullptr; }
        Recorder(const Recorder&) = delete;
        std::set<std::string> paths;
    };

    /// Returns the text for a file that is about to be read, by any path.
    const std::string* read(const char* path);

private:
    EditorTexts() = default;

    std::map<std::string, std::shared_ptr<const std::string>> texts_;
    std::set<std::string>* recorded_ = nullptr;
};

}  // namespace hal::tools
