// SPDX-License-Identifier: MIT
// `hal top`: all instances, their threads and faults; of this machine through their control
// sockets, of others through DDS where it is installed.
#include "inspect/top.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <fmt/core.h>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <unistd.h>

#include "cli/output.hpp"
#include "cli/screen.hpp"
#include "control/client.hpp"
#include "inspect/live_top.hpp"
#include "inspect/seen_instance.hpp"
#include "paths.hpp"
#include "text/glyphs.hpp"

namespace hal::tools {

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto status_period = std::chrono::milliseconds(500);
constexpr double silent_after_s = 2;
constexpr double gone_after_s = 30;
// a publisher that floods the topic does not fill the memory
constexpr std::size_t max_instances = 1000;

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> words;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find(' '), text.size());
        if (end > 0) {
            words.push_back(text.substr(0, end));
        }
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return words;
}

template <class T>
T number(std::string_view text) {
    T value = 0;
    std::from_chars(text.begin(), text.end(), value);
    return value;
}

/// Removes control characters: data from the network must not control the terminal.
std::string clean(std::string_view text) { return printable(text.substr(0, 300)); }

/// The statuses received over DDS.
class Network {
public:
    ~Network() {
        if (ear_ != nullptr) {
            close_(ear_);
        }
    }
    bool absent() const { return absent_; }
    /// Returns false and sets `problem` to the reason.
    bool open(const std::string& settings, std::string& problem) {
        // Beside the program, as it was built; else where the loader looks.
        // (Under the address sanitizer that does not know whose path counts.)
        std::error_code unknown;
        const auto programs =
            std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path();
        void* library = nullptr;
        for (const auto& folder :
             {programs / "../lib", programs / paths::libraries_from_programs}) {
            if (library == nullptr) {
                library = ::dlopen((folder / "libhalcyon_dds.so").c_str(), RTLD_NOW | RTLD_LOCAL);
            }
        }
        if (library == nullptr) {
            library = ::dlopen("libhalcyon_dds.so", RTLD_NOW | RTLD_LOCAL);
        }
        if (library == nullptr) {
            absent_ = true;
            problem =
                "cannot load libhalcyon_dds.so; with Halcyon's Debian packages, type: sudo apt "
                "install halcyon-dds; in the source tree: sudo apt install libfastrtps-dev && "
                "./hal build";
            return false;
        }
        using Open =
            void* (*)(const char*, void (*)(void*, const char*, std::size_t), void*, char*);
        const auto open = reinterpret_cast<Open>(::dlsym(library, "halcyon_status_open"));
        close_ = reinterpret_cast<void (*)(void*)>(::dlsym(library, "halcyon_status_close"));
        if (open == nullptr || close_ == nullptr) {
            problem = "libhalcyon_dds.so is of another version; build or install Halcyon again";
            return false;
        }
        char why[256] = "";
        ear_ = open(settings.c_str(), heard, this, why);
        problem = why;
        return ear_ != nullptr;
    }
    std::vector<SeenInstance> all() {
        const std::lock_guard lock(mutex_);
        std::vector<SeenInstance> list;
        std::erase_if(seen_, [](const Seen& one) {
            return std::chrono::duration<double>(Clock::now() - one.when).count() > gone_after_s;
        });
        for (const Seen& one : seen_) {
            list.push_back(one.what);
            list.back().silent_s = std::chrono::duration<double>(Clock::now() - one.when).count();
        }
        return list;
    }

private:
    struct Seen {
        SeenInstance what;
        Clock::time_point when;
    };
    static void heard(void* user, const char* text, std::size_t length) {
        Network& self = *static_cast<Network*>(user);
        SeenInstance seen;
        if (!read_status({text, length}, seen)) return;
        const std::lock_guard lock(self.mutex_);
        const auto known = std::find_if(self.seen_.begin(), self.seen_.end(),
                                        [&](const Seen& one) { return one.what.same(seen); });
        if (known != self.seen_.end()) {
            *known = {std::move(seen), Clock::now()};
        } else if (self.seen_.size() < max_instances) {
            self.seen_.push_back({std::move(seen), Clock::now()});
        }
    }

    std::mutex mutex_;
    std::vector<Seen> seen_;
    bool absent_ = false;  ///< DDS is not installed
    void* ear_ = nullptr;
    void (*close_)(void*) = nullptr;
};

std::vector<SeenInstance> local_instances() {
    std::vector<SeenInstance> all;
    for (const std::string& name : running_instances()) {
        std::string problem;
        const auto client = Client::connect(name, problem);
        SeenInstance seen;
        if (client && read_status(client->run("status instance").out, seen)) {
            all.push_back(std::move(seen));
        }
    }
    return all;
}

std::vector<SeenInstance> everybody(Network* network) {
    std::vector<SeenInstance> all =
        network != nullptr ? network->all() : std::vector<SeenInstance>{};
    for (SeenInstance& local : local_instances()) {
        const auto known = std::find_if(all.begin(), all.end(),
                                        [&](const SeenInstance& one) { return one.same(local); });
        if (known == all.end()) {
            all.push_back(std::move(local));
            continue;
        }
        local.cell = known->cell;
        local.node = known->node;
        *known = std::move(local);
    }
    std::sort(all.begin(), all.end(), [](const SeenInstance& a, const SeenInstance& b) {
        return std::tie(a.cell, a.node, a.host, a.instance, a.pid) <
               std::tie(b.cell, b.node, b.host, b.instance, b.pid);
    });
    return all;
}

}  // namespace

bool read_status(std::string_view text, SeenInstance& seen) {
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        const std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        const std::size_t blank = std::min(line.find(' '), line.size());
        const std::string_view key = line.substr(0, blank);

        const std::string_view value = line.substr(std::min(blank + 1, line.size()));
        if (key == "instance") {
            seen.instance = clean(value);
        } else if (key == "host") {
            seen.host = clean(value);
        } else if (key == "pid") {
            seen.pid = number<std::int64_t>(value);
        } else if (key == "running") {
            seen.running = value == "1";
        } else if (key == "cell") {
            seen.cell = clean(value);
        } else if (key == "node") {
            seen.node = clean(value);
        } else if (key == "faults") {
            seen.faults = number<std::uint64_t>(value);
        } else if (key == "fault") {
            seen.fault = clean(value);
        } else if (key == "thread" && seen.threads.size() < 100) {
            if (const auto words = words_of(value); words.size() >= 5) {
                seen.threads.push_back({clean(words[0]), number<std::int64_t>(words[1]),
                                        number<std::uint64_t>(words[2]),
                                        number<std::uint64_t>(words[3]), words[4] == "1"});
            }
        }
    }
    return !seen.instance.empty();
}

std::string top_json(const std::vector<SeenInstance>& all) {
    nlohmann::json list = nlohmann::json::array();
    for (const SeenInstance& one : all) {
        nlohmann::json threads = nlohmann::json::array();
        for (const SeenThread& thread : one.threads) {
            threads.push_back({{"name", thread.name},
                               {"period_ns", thread.period_ns},
                               {"cycles", thread.cycles},
                               {"missed", thread.missed},
                               {"faulted", thread.faulted}});
        }
        list.push_back({{"instance", one.instance},
                        {"host", one.host},
                        {"pid", one.pid},
                        {"cell", one.cell},
                        {"node", one.node},
                        {"running", one.running},
                        {"silent_s", one.silent_s},
                        {"threads", threads},
                        {"faults", one.faults},
                        {"fault", one.fault}});
    }
    return list.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

int run_top(const TopOptions& options) {
    std::string settings = options.dds, problem;
    if (const char* const usual = std::getenv("HALCYON_DDS");
        settings.empty() && usual != nullptr) {
        settings = usual;
    }
    if (options.dds.starts_with("--")) {
        return fail(options, fmt::format("--dds takes settings KEY=VALUE before {}; without any, "
                                         "leave out --dds",
                                         options.dds));
    }
    const bool live = has_screen() && !options.json && !options.once;
    std::optional<StopRequest> stop;
    if (live) {
        stop.emplace();  // before the threads of DDS
    }
    Network network;
    const bool there = network.open(settings, problem);
    if (!there && (!network.absent() || !options.dds.empty())) return fail(options, problem);
    Network* const over = there ? &network : nullptr;
    // every instance has published its status by then
    if (there && !live) {
        std::this_thread::sleep_for(3 * status_period);
    }
    if (!live) {
        const std::vector<SeenInstance> seen = everybody(over);
        const std::string text = options.json ? top_json(seen) : top_table(seen);
        return exit_code(print(text));
    }
    const std::optional<std::chrono::nanoseconds> duration =
        options.for_ns >= 0 ? std::optional(std::chrono::nanoseconds(options.for_ns))
                            : std::nullopt;
    return exit_code(LiveTop([over] { return everybody(over); }).run(*stop, duration));
}

}  // namespace hal::tools
