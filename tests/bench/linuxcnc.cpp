// SPDX-License-Identifier: MIT
// LinuxCNC gives its threads SCHED_FIFO only on a PREEMPT_RT kernel and with CAP_SYS_RESOURCE. To
// compare like with like on any machine it is started with LINUXCNC_FORCE_REALTIME and, where we
// are root without that capability (containers, some virtual machines), with permit_realtime.so
// before its libraries. As root it needs the name of an ordinary user who then gives the commands.
#include "linuxcnc.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sched.h>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <thread>
#include <unistd.h>

#include "machine.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

constexpr uid_t nobody = 65534;
constexpr std::array<key_t, 2> shared_memory{0x48414c32, 0x48484c34};  // "HAL2" and "HHL4"

bool as_root() { return geteuid() == 0; }

std::string version() {
    // "1:2.9.0~pre1+git…"
    const std::string text = run({{"dpkg-query", "-W", "-f", "${Version}", "linuxcnc-uspace"}}).out;
    const auto from = text.find(':') == std::string::npos ? 0 : text.find(':') + 1;
    return text.substr(from, text.find('.', text.find('.', from) + 1) - from);
}

bool is_running() {
    for (const auto& process : std::filesystem::directory_iterator("/proc")) {
        std::ifstream file(process.path() / "comm");
        std::string name;
        std::getline(file, name);
        if (name == "rtapi_app") return true;
    }
    return false;
}

/// Takes shared memory away that no process uses. False when one is in use.
bool clear_shared_memory() {
    bool unused = true;
    for (const key_t key : shared_memory) {
        shmid_ds about{};
        const int id = shmget(key, 0, 0);
        if (id < 0 || shmctl(id, IPC_STAT, &about) != 0) continue;
        if (about.shm_nattch != 0) {
            unused = false;
        } else {
            shmctl(id, IPC_RMID, nullptr);
        }
    }
    return unused;
}

std::string why_absent() {
    for (const char* program : {"rtapi_app", "halcmd"}) {
        if (find_program(program).empty()) return "LinuxCNC: not installed (linuxcnc-uspace)";
    }
    // In an IPC namespace of our own there is no other LinuxCNC, and nothing stays behind.
    static const bool alone = unshare(CLONE_NEWIPC) == 0;
    return alone || (!is_running() && clear_shared_memory()) ? "" : "LinuxCNC: in use, left alone";
}

}  // namespace

const std::string& LinuxCnc::absent() {
    static const std::string why = why_absent();
    return why;
}

const std::string& LinuxCnc::name() {
    static const std::string name = "LinuxCNC " + version();
    return name;
}

double LinuxCnc::ns_per_time_unit() {
    const std::string v = version();
    const int minor = std::atoi(v.c_str() + v.find('.') + 1);
    return minor >= 10 || tsc_per_ns() == 0.0 ? 1.0 : 1.0 / tsc_per_ns();
}

Start LinuxCnc::program(std::vector<std::string> words) const {
    Start start{std::move(words)};
    start.environment = {"HOME=" + home_.path(), "RTAPI_FIFO_PATH=" + home_.path() + "/.rtapi_fifo",
                         "LINUXCNC_FORCE_REALTIME=1"};
    if (as_root()) {
        start.user = nobody;
    }
    return start;
}

std::unique_ptr<LinuxCnc> LinuxCnc::start(const std::string& threads) {
    if (!absent().empty()) return nullptr;
    std::unique_ptr<LinuxCnc> peer(new LinuxCnc);
    Start master = peer->program({"rtapi_app", "load", "threads"});
    for (std::size_t at = 0; at < threads.size();) {
        const auto end = std::min(threads.find(' ', at), threads.size());
        master.arguments.push_back(threads.substr(at, end - at));
        at = end + 1;
    }
    master.everywhere = true;  // it takes the last CPU it may use
    if (as_root()) {
        master.user = static_cast<uid_t>(-1);
        master.environment.push_back("RTAPI_UID=" + std::to_string(nobody));
        master.environment.push_back(
            "LD_PRELOAD=" + std::filesystem::read_symlink("/proc/self/exe").parent_path().string() +
            "/permit_realtime.so");
    }
    peer->master_ = std::make_unique<Child>(master);
    for (const Stopwatch watch; watch.ms() < 5000;
         std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
        if (peer->command({"list", "thread"}).out.find_first_not_of(" \n") != std::string::npos) {
            return peer;
        }
    }
    return nullptr;
}

LinuxCnc::~LinuxCnc() {
    command({"stop"});
    command({"unload", "all"});
    for (const Stopwatch watch; master_ && master_->alive() && watch.ms() < 2000;
         std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
    }
    master_.reset();
    clear_shared_memory();
}

Finished LinuxCnc::command(const std::vector<std::string>& words) {
    std::vector<std::string> all{"halcmd"};
    all.insert(all.end(), words.begin(), words.end());
    return run(program(std::move(all)), 20'000);
}

Finished LinuxCnc::file(const std::string& text) {
    return run(program({"halcmd", "-f", home_.file("bench.hal", text)}), 120'000);
}

std::vector<double> LinuxCnc::sample(const std::string& pin, std::size_t count, int every_us) {
    Child halcmd(program({"halcmd", "-s", "-kf"}), true);
    std::vector<double> samples;
    while (samples.size() < count) {
        halcmd.write("getp " + pin + "\n");
        const auto line = halcmd.line();
        if (!line) break;
        samples.push_back(std::atof(line->c_str()));
        std::this_thread::sleep_for(std::chrono::microseconds(every_us));
    }
    return samples;
}

}  // namespace hal::bench
