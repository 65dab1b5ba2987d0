// SPDX-License-Identifier: MIT
#include "lsp/editor_texts.hpp"

#include <utility>

#include "commands/files.hpp"
#include "hal/read_file.hpp"

namespace hal::tools {

EditorTexts& EditorTexts::instance() {
    static EditorTexts texts;
    return texts;
}

void EditorTexts::set(const std::string& path, std::string text) {
    texts_[path] = std::make_shared<const std::string>(std::move(text));
}

void EditorTexts::erase(const std::string& path) { texts_.erase(path); }

const std::string* EditorTexts::find(const std::string& path) const {
    const auto found = texts_.find(path);
    return found == texts_.end() ? nullptr : found->second.get();
}

const std::string* EditorTexts::read(const char* path) {
    if (std::string_view(path).starts_with("/proc/")) return nullptr;
    const std::string canonical = canonical_path(path);
    if (recorded_) {
        recorded_->insert(canonical);
    }
    return find(canonical);
}

EditorTexts::Override::Override(std::map<std::string, std::string> texts) {
    auto& all = instance().texts_;
    for (auto& [path, text] : texts) {
        const auto found = all.find(path);
        before_[path] = found == all.end() ? nullptr : found->second;
        all[path] = std::make_shared<const std::string>(std::move(text));
    }
}

EditorTexts::Override::~Override() {
    auto& all = instance().texts_;
    for (auto& [path, text] : before_) {
        if (text) {
            all[path] = std::move(text);
        } else {
            all.erase(path);
        }
    }
}

}  // namespace hal::tools

bool hal_editor_text(const char* path,
                     void (*take)(void* bytes, const char* text, std::size_t size), void* bytes) {
    const std::string* const text = hal::tools::EditorTexts::instance().read(path);
    if (!text) return false;
    take(bytes, text->data(), text->size());
    return true;
}
