// SPDX-License-Identifier: MIT
#include "cli/editor.hpp"

#include <algorithm>
#include <cerrno>
#include <clocale>
#include <cstdlib>
#include <cwchar>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <utility>
#include <vector>

#ifdef HALCYON_LIBEDIT
#include <histedit.h>
#endif

#include "base/poll_all.hpp"
#include "cli/history_file.hpp"
#include "cli/output.hpp"

namespace hal::tools {

bool wait_readable(int descriptor, int stop, const std::function<void()>& meanwhile) {
    pollfd both[2] = {{descriptor, POLLIN, 0}, {stop, POLLIN, 0}};
    const timespec turn{0, 10'000'000};
    for (;;) {
        if (meanwhile) {
            meanwhile();
        }
        both[0].revents = 0;
        both[1].revents = 0;
        if (poll_all(both, meanwhile ? &turn : nullptr) < 0 && errno != EINTR) return false;
        if (both[1].revents != 0) return false;
        if (both[0].revents != 0) return true;
    }
}

bool LineReader::read(std::string& line) {
    for (std::size_t searched = begin_;;) {
        if (const auto end = waiting_.find('\n', searched); end != std::string::npos) {
            line.assign(waiting_, begin_, end - begin_);
            begin_ = end + 1;
            return true;
        }
        waiting_.erase(0, std::exchange(begin_, 0));
        searched = waiting_.size();
        if (ended_) {
            line = std::exchange(waiting_, {});
            return !line.empty();
        }
        char block[65536];
        if (!wait_readable(descriptor_, stop_, meanwhile_)) return false;
        const ssize_t n = ::read(descriptor_, block, sizeof block);
        if (n > 0) {
            waiting_.append(block, static_cast<std::size_t>(n));
        } else if (n == 0 || errno != EINTR) {
            ended_ = true;
            error_ = n < 0 ? errno : 0;
        }
    }
}

std::string common_prefix(const std::vector<Candidate>& candidates) {
    if (candidates.empty()) {
        return {};
    }
    std::string prefix = candidates.front().text;
    for (const Candidate& candidate : candidates) {
        const auto [end, other] = std::mismatch(prefix.begin(), prefix.end(),
                                                candidate.text.begin(), candidate.text.end());
        prefix.erase(end, prefix.end());
    }
    return prefix;
}

std::string candidate_table(const std::vector<Candidate>& candidates, std::size_t columns) {
    constexpr std::size_t max = 200;
    std::size_t name_width = 0;
    std::size_t hint_width = 0;
    const std::size_t shown = std::min(candidates.size(), max);
    for (std::size_t i = 0; i < shown; ++i) {
        name_width = std::max(name_width, candidates[i].text.size());
        hint_width = std::max(hint_width, candidates[i].hint.size());
    }
    const std::size_t cell = name_width + (hint_width != 0 ? hint_width + 2 : 0) + 3;
    const std::size_t across = std::max<std::size_t>(1, columns / cell);

    const std::size_t rows = (shown + across - 1) / across;
    std::string text;
    for (std::size_t r = 0; r < rows; ++r) {
        std::string line;
        for (std::size_t i = r; i < shown; i += rows) {
            line.resize(std::max(line.size(), i / rows * cell), ' ');
            line += candidates[i].text;
            if (!candidates[i].hint.empty()) {
                line += std::string(name_width - candidates[i].text.size() + 2, ' ') +
                        candidates[i].hint;
            }
        }
        text += line + "\n";
    }
    if (shown < candidates.size()) {
        text += "… and " + std::to_string(candidates.size() - shown) + " more\n";
    }
    return text;
}

#ifdef HALCYON_LIBEDIT

struct Editor::State {
    Completer complete;
    int stop;
    std::function<void()> meanwhile;
    LineReader plain;
    EditLine* line = nullptr;
    History* history = nullptr;
    HistoryFile file;
    std::string prompt, last;
    bool stopped = false;
    bool interrupted = false;

    State(Completer c, int s, const std::function<void()>& m)
        : complete(std::move(c)), stop(s), meanwhile(m), plain(STDIN_FILENO, s, m) {}

    static State& of(EditLine* line) {
        void* self = nullptr;
        el_get(line, EL_CLIENTDATA, &self);
        return *static_cast<State*>(self);
    }
    static char* show_prompt(EditLine* line) { return of(line).prompt.data(); }

    static int next_character(EditLine* line, wchar_t* to) {
        State& self = of(line);
        std::mbstate_t partial{};
        for (;;) {
            if (!wait_readable(STDIN_FILENO, self.stop, self.meanwhile)) {
                self.stopped = true;
                return 0;
            }
            char byte = 0;
            if (::read(STDIN_FILENO, &byte, 1) <= 0) return 0;
            const std::size_t used = std::mbrtowc(to, &byte, 1, &partial);
            // more bytes of this character follow
            if (used == static_cast<std::size_t>(-2)) continue;
            if (used == static_cast<std::size_t>(-1)) {
                partial = {};
                continue;  // not a character: dropped
            }
            return 1;
        }
    }

    static unsigned char on_interrupt(EditLine* line, int) {
        of(line).interrupted = true;
        return CC_EOF;
    }

    static unsigned char on_tab(EditLine* line, int) {
        State& self = of(line);
        const LineInfo* now = el_line(line);
        const std::string_view text(now->buffer,
                                    static_cast<std::size_t>(now->lastchar - now->buffer));
        const auto cursor = static_cast<std::size_t>(now->cursor - now->buffer);
        const Completion found = self.complete(text, cursor);
        if (found.candidates.empty() || found.begin > cursor) return CC_REFRESH_BEEP;
        const std::string typed(text.substr(found.begin, cursor - found.begin));
        std::string word = common_prefix(found.candidates);
        const bool unique = found.candidates.size() == 1;
        if (unique) {
            word += ' ';
        }
        if (word.size() > typed.size() || unique) {
            el_deletestr(line, static_cast<int>(typed.size()));
            el_insertstr(line, word.c_str());
            return CC_REFRESH;
        }
        winsize size{};
        const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col != 0;
        print("\r\n" + candidate_table(found.candidates, known ? size.ws_col : 80));
        return CC_REDISPLAY;
    }

    void open() {
        std::setlocale(LC_CTYPE, "");
        line = el_init("hal", stdin, stdout, stderr);
        if (!line) return;
        history = history_init();
        HistEvent event{};
        ::history(history, &event, H_SETSIZE, static_cast<int>(HistoryFile::max));
        ::history(history, &event, H_SETUNIQUE, 1);
        for (const std::string& old : file.load()) {
            ::history(history, &event, H_ENTER, old.c_str());
            last = old;
        }
        el_set(line, EL_CLIENTDATA, this);
        el_set(line, EL_EDITOR, "emacs");
        el_set(line, EL_HIST, ::history, history);
        el_set(line, EL_PROMPT, &show_prompt);
        el_set(line, EL_GETCFN, &next_character);
        // el_set would leak copies of the texts
        el_wset(line, EL_ADDFN, L"hal-complete", L"complete a name", &on_tab);
        el_wset(line, EL_ADDFN, L"hal-interrupt", L"drop the line", &on_interrupt);
        el_set(line, EL_BIND, "^I", "hal-complete", nullptr);
        el_set(line, EL_BIND, "^R", "em-inc-search-prev", nullptr);
        el_set(line, EL_BIND, "^C", "hal-interrupt", nullptr);
        el_set(line, EL_SETTY, "-d", "-isig", nullptr);  // ^C is a key while a line is edited
    }
};

Editor::Editor(Completer complete, int stop, const std::function<void()>& meanwhile)
    : state_(std::make_unique<State>(std::move(complete), stop, meanwhile)) {
    const char* term = std::getenv("TERM");
    if (::isatty(STDIN_FILENO) && ::isatty(STDOUT_FILENO) && term &&
        std::string_view(term) != "dumb") {
        state_->open();
    }
}

Editor::~Editor() {
    if (state_->line) {
        el_end(state_->line);
    }
    if (state_->history) {
        history_end(state_->history);
    }
}

bool Editor::read(const std::string& prompt, std::string& line) {
    State& s = *state_;
    if (!s.line) {
        if (::isatty(STDIN_FILENO)) {
            print(prompt);
        }
        return s.plain.read(line);
    }
    s.prompt = prompt;
    s.interrupted = false;
    int length = 0;
    el_set(s.line, EL_PREP_TERM,
           1);  // before the prompt shows: a ^C in between would end the program
    const char* text = el_gets(s.line, &length);
    if (s.interrupted) {
        print("^C\n");
        el_reset(s.line);
        line.clear();
        return true;
    }
    if (s.stopped || !text || length <= 0) {
        print("\n");
        return false;
    }
    line.assign(text, static_cast<std::size_t>(length));
    while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) {
        line.pop_back();
    }
    if (line.find_first_not_of(" \t") != std::string::npos && line != s.last) {
        HistEvent event{};
        ::history(s.history, &event, H_ENTER, line.c_str());
        s.file.append(line);
        s.last = line;
    }
    return true;
}

#else

struct Editor::State {
    LineReader plain;
};

Editor::Editor(Completer, int stop, const std::function<void()>& meanwhile)
    : state_(std::make_unique<State>(State{LineReader(STDIN_FILENO, stop, meanwhile)})) {}
Editor::~Editor() = default;

bool Editor::read(const std::string& prompt, std::string& line) {
    if (::isatty(STDIN_FILENO)) {
        print(prompt);
    }
    return state_->plain.read(line);
}

#endif

}  // namespace hal::tools
