// SPDX-License-Identifier: MIT
// The control socket of a replayed machine: the protocol of a running one, for what reads it, and
// the commands that move it through its cycles.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "control/endpoint.hpp"
#include "run/errand.hpp"
#include "run/moment_link.hpp"
#include "run/replay_client.hpp"
#include "run/replay_command.hpp"
#include "run/replay_timeline.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

/// One errand is under way at a time; requests wait in their order. A newer `goto` replaces those
/// that wait. [setup]
class ReplayServer {
public:
    /// All outlive it. Before the journal is executed.
    ReplayServer(JournalFile& file, MomentLink& moment);
    ReplayServer(const ReplayServer&) = delete;

    /// Creates the socket of an instance of this name. Returns false after adding the reason.
    bool open(const std::string& name, Diagnostics& diagnostics);
    /// Queues a first move, the words of a command: after the execution of the whole journal, unless
    /// a client moves before its end.
    void begin_with(const std::vector<std::string>& words);
    /// Serves until one of the descriptors is readable, or a client has asked for the end. Returns
    /// false when the executing process has ended.
    bool serve(const std::vector<int>& ends);
    /// Returns true when a client has asked for the end.
    bool ended() const { return ends_; }

private:
    using Json = nlohmann::ordered_json;
    enum class Job : std::uint8_t {
        scan,  ///< the first execution, for marks and keyframes; goes on after an interruption
        move,  ///< a command of ReplayCommands
        request,  ///< a request that the executing process answers
        rows,  ///< traces around the moment
        publish,  ///< the values of a subscription
        restore,  ///< back to the moment, after an errand that was interrupted
    };
    /// Which fault a move goes to: a seek, or an execution, of what is known when it starts.
    enum class Fault : std::uint8_t { none, next, previous };
    struct Work {
        Job job = Job::move;
        Errand errand = {};
        std::uint64_t client = 0;  // 0: none
        std::string id = "null";  // of the request, as JSON
        std::string request = {};
        std::uint64_t subscription = 0;
        Fault fault = Fault::none;

        /// The machine may be at another cycle afterwards; `where` and `break` leave it.
        bool moves() const {
            const bool stays =
                errand.kind == Errand::Kind::where || errand.kind == Errand::Kind::check;
            return job == Job::move && !stays;
        }
        bool is_goto() const { return job == Job::move && errand.kind == Errand::Kind::position; }
        /// It ends at a cycle that does not depend on the present one.
        bool is_absolute() const { return is_goto() || errand.kind == Errand::Kind::seek; }
        /// It may execute all of the journal.
        bool is_search() const {
            const bool is_run =
                errand.kind == Errand::Kind::run || errand.kind == Errand::Kind::run_to_fault;
            return is_run || errand.kind == Errand::Kind::back;
        }
    };

    // clients
    void accept();
    void read(ReplayClient& client);
    void remove_ended();
    ReplayClient* client(std::uint64_t number);
    void reply(std::uint64_t client, const std::string& id, const std::string& members);
    void reject(std::uint64_t client, const std::string& id, const std::string& problem);
    void reply_command(const Work& work, bool good, const std::string& text);
    void broadcast(const char* event, const Json& about);

    // requests
    void handle(ReplayClient& client, const std::string& line);
    void handle_run(ReplayClient& client, const Json& request, Work work);
    void follow(ReplayClient& client, const Work& work);
    void set_options(ReplayClient& client, const Json& request, const Work& work);
    void subscribe(ReplayClient& client, const Json& request, const Work& work);
    void unsubscribe(ReplayClient& client, const Json& request, const Work& work);
    void read_rows(const Json& request, Work work);
    static bool is_move(std::string_view command);
    void move(const std::vector<std::string>& words, Work work);
    std::string parse_move(const std::vector<std::string>& words, Work& work);
    std::string find_fault(Work& work) const;

    // work
    void add(Work work);
    void end_scan();
    void replace_gotos();
    void interrupt_older();
    void interrupt();
    void pause();
    void publish_all();
    void publish(const ReplayClient& client, std::uint64_t subscription);
    void start_next();
    void start(Work work);
    void receive(const MomentLink::Received& packet);
    void note_position(Json now);
    void finish(bool good);
    void show();
    void finish_scan();
    void finish_move(bool good);
    void finish_restore();
    void finish_rows(bool good);
    void finish_publish();
    static std::uint64_t cycles_of(const Json& position) {
        return position.value("cycles", std::uint64_t{0});
    }

    MomentLink& moment_;
    ReplayCommands commands_;
    ReplayTimeline timeline_;
    Endpoint endpoint_;
    std::string name_;
    std::map<std::uint64_t, std::unique_ptr<ReplayClient>> clients_;
    std::uint64_t numbers_ = 0;
    std::deque<Work> waiting_;
    std::deque<Work> first_moves_;  // of begin_with(), behind the scan
    bool is_busy_ = false;
    bool scans_ = true;
    bool ends_ = false;
    bool is_interrupted_ = false;
    Work current_;
    std::chrono::steady_clock::time_point begun_{};  // of current_
    std::string text_;  // what the errand has printed
    std::string data_;  // its answer
    Json now_ = Json::object();  // where the process is
    Json shown_ = Json::object();  // where clients see the machine
    std::uint64_t frontier_ = 0;  // cycles of which all marks are known
    bool knows_end_ = false;
};

}  // namespace hal::tools
