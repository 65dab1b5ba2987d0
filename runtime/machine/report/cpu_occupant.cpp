// SPDX-License-Identifier: MIT
#include "machine/report/cpu_occupant.hpp"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <sched.h>
#include <sstream>
#include <unistd.h>
#include <vector>

#include "hal/read_file.hpp"
#include "text/folder_entries.hpp"

namespace hal {
namespace {

namespace fs = std::filesystem;

/// The fields of /proc/PID/task/TID/stat that are needed; numbers as in proc(5).
struct TaskStat {
    static constexpr std::size_t processor = 39;
    static constexpr std::size_t priority = 40;
    static constexpr std::size_t policy = 41;
    static constexpr std::size_t first_behind_name = 3;
    std::string name;
    std::vector<std::string> fields;  // from field 3, the state

    const std::string& field(std::size_t number) const {
        return fields[number - first_behind_name];
    }
};

bool read_stat(const fs::path& path, TaskStat& stat) {
    constexpr std::size_t max = 4096;
    std::string text;
    if (!read_regular_file(path.string(), max, text)) return false;
    const auto begin = text.find('(');
    const auto end = text.rfind(')');
    if (begin == std::string::npos || end == std::string::npos) return false;
    stat.name = text.substr(begin + 1, end - begin - 1);
    std::istringstream rest(text.substr(end + 1));
    stat.fields.assign(std::istream_iterator<std::string>(rest), {});
    return stat.fields.size() > TaskStat::policy - TaskStat::first_behind_name;
}

bool occupies(const TaskStat& stat, int cpu) {
    const int policy = std::atoi(stat.field(TaskStat::policy).c_str());
    const bool is_real_time =
        policy == SCHED_FIFO || policy == SCHED_RR || policy == SCHED_DEADLINE;
    return is_real_time && stat.field(3) == "R" &&
           std::atoi(stat.field(TaskStat::processor).c_str()) == cpu;
}

std::string description(const std::string& pid, const TaskStat& stat) {
    const int policy = std::atoi(stat.field(TaskStat::policy).c_str());
    const std::string who = "process " + pid + " (" + stat.name + ", ";
    if (policy == SCHED_DEADLINE) return who + "SCHED_DEADLINE)";
    return who + (policy == SCHED_FIFO ? "SCHED_FIFO " : "SCHED_RR ") +
           stat.field(TaskStat::priority) + ")";
}

bool is_number(const std::string& name) {
    return !name.empty() && name.find_first_not_of("0123456789") == std::string::npos;
}

}  // namespace

std::string cpu_occupant(int cpu) {
    const std::string own = std::to_string(::getpid());
    for (const fs::path& process : folder_entries("/proc")) {
        const std::string pid = process.filename().string();
        if (!is_number(pid) || pid == own) continue;
        for (const fs::path& task : folder_entries(process / "task")) {
            TaskStat stat;
            if (read_stat(task / "stat", stat) && occupies(stat, cpu)) {
                return description(pid, stat);
            }
        }
    }
    return "";
}

std::string starvation_help(int cpu) {
    const std::string pin = "cpu=N of newthread binds the thread to another CPU";
    if (cpu < 0) return "end what keeps the host busy, or grant a real-time priority: hal doctor";
    const std::string occupant = cpu_occupant(cpu);
    const std::string who = occupant.empty() ? "another process of higher priority" : occupant;
    return who + " uses CPU " + std::to_string(cpu) +
           ": move it to another CPU (taskset -cp), or " + pin;
}

}  // namespace hal
