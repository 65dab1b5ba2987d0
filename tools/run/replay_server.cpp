// SPDX-License-Identifier: MIT
#include "run/replay_server.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <iterator>
#include <poll.h>
#include <sstream>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

#include "commands/json_text.hpp"
#include "commands/table.hpp"
#include "paths.hpp"

namespace hal::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t max_clients = 64;
constexpr auto scan_slice = std::chrono::milliseconds(200);  // requests that wait come between
constexpr auto goto_time = std::chrono::milliseconds(300);  // then a newer one interrupts it
constexpr std::int64_t max_around_ms = 60'000;

/// Returns why a command or verb is rejected. `edit`: what executes the journal with another value; ""
/// when nothing does.
std::string not_possible(std::string_view what, const std::string& edit) {
    std::string text = fmt::format("'{}' is not possible: this is a moment of the past", what);
    if (edit.empty()) return text;
    return text + fmt::format(
                      ". To execute the journal with another value, type: hal replay --exact FILE "
                      "--edit '{}' --at CYCLE",
                      edit);
}

std::vector<std::string> split(const std::string& line) {
    std::istringstream in(line.substr(0, line.find('#')));
    std::vector<std::string> words;
    for (std::string word; in >> word;) {
        words.push_back(word);
    }
    return words;
}

std::string joined(const std::vector<std::string>& words) {
    std::string line;
    for (const std::string& word : words) {
        line += (line.empty() ? "" : " ") + word;
    }
    return line;
}

/// Returns the strings of an array; none when it is not such an array.
std::vector<std::string> strings_of(const Json& array) {
    std::vector<std::string> strings;
    if (!array.is_array()) return strings;
    for (const Json& one : array) {
        if (!one.is_string()) return {};
        strings.push_back(one.get<std::string>());
    }
    return strings;
}

/// Returns the id of a request as it is repeated in the reply.
std::string id_text(const Json& request) {
    const auto id = request.find("id");
    const bool is_good = id != request.end() && (id->is_number() || id->is_string());
    return is_good ? json_text(*id) : "null";
}

/// Returns which member of a request is a verb that changes a machine, or needs one that runs.
std::string_view live_verb(const Json& request) {
    for (const std::string_view verb : {"set", "script", "component", "exchange", "exit", "port",
                                        "stream", "probe", "unprobe", "trace"}) {
        if (request.contains(verb)) return verb;
    }
    return "";
}

}  // namespace

ReplayServer::ReplayServer(JournalFile& file, MomentLink& moment)
    : moment_(moment), commands_(file), timeline_(file) {
    Work scan;
    scan.job = Job::scan;
    scan.errand.kind = Errand::Kind::run;
    waiting_.push_back(std::move(scan));
}

bool ReplayServer::open(const std::string& name, Diagnostics& diagnostics) {
    name_ = name;
    return endpoint_.open(name, "", diagnostics);
}

void ReplayServer::begin_with(const std::vector<std::string>& words) {
    Work work;
    if (parse_move(words, work).empty()) {
        first_moves_.push_back(std::move(work));
    }
}

bool ReplayServer::serve(const std::vector<int>& ends) {
    constexpr int check_every_ms = 100;
    std::vector<pollfd> events;
    while (!ends_ && !moment_.ended()) {
        start_next();
        interrupt_older();
        events.assign({{endpoint_.fd(), POLLIN, 0}, {moment_.fd(), POLLIN, 0}});
        for (const int end : ends) {
            events.push_back({end, POLLIN, 0});
        }
        const std::size_t first = events.size();
        for (const auto& [number, client] : clients_) {
            const short output = client->has_output() ? POLLOUT : 0;
            events.push_back({client->fd(), static_cast<short>(POLLIN | output), 0});
        }
        if (::poll(events.data(), events.size(), check_every_ms) < 0) continue;
        for (std::size_t i = 2; i < first; ++i) {
            if (events[i].revents != 0) return true;
        }
        std::size_t at = first;
        for (const auto& [number, client] : clients_) {
            const short happened = events[at++].revents;
            if ((happened & POLLOUT) != 0) {
                client->write();
            }
            if ((happened & ~POLLOUT) != 0) {
                read(*client);
            }
        }
        remove_ended();
        if (events[0].revents != 0) {
            accept();
        }
        while (const auto packet = moment_.receive(0)) {
            receive(*packet);
        }
    }
    return !moment_.ended();
}

// --- clients ---

void ReplayServer::accept() {
    const int fd = ::accept4(endpoint_.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) return;
    if (clients_.size() >= max_clients) {
        ::close(fd);
        return;
    }
    ++numbers_;
    auto& client = clients_[numbers_];
    client = std::make_unique<ReplayClient>(fd, numbers_);
    client->send(json_text({{"halcyon", 1},
                            {"name", name_},
                            {"version", paths::version},
                            {"pid", ::getpid()},
                            {"files", {timeline_.file_name()}},
                            {"replay", timeline_.file_name()}}) +
                 "\n");
}

void ReplayServer::read(ReplayClient& client) {
    const bool goes_on = client.read();
    for (std::string line; client.next_line(line);) {
        handle(client, line);
    }
    if (!goes_on) {
        client.end();
    }
}

void ReplayServer::remove_ended() {
    std::erase_if(clients_, [](const auto& entry) { return entry.second->ended(); });
    std::erase_if(waiting_, [this](const Work& work) {
        return work.client != 0 && !clients_.contains(work.client);
    });
}

ReplayClient* ReplayServer::client(std::uint64_t number) {
    const auto at = clients_.find(number);
    return at == clients_.end() ? nullptr : at->second.get();
}

/// `members`: behind "ok":true, each with a comma before it.
void ReplayServer::reply(std::uint64_t number, const std::string& id, const std::string& members) {
    if (ReplayClient* const to = client(number)) {
        to->send(fmt::format("{{\"id\":{},\"ok\":true{}}}\n", id, members));
    }
}

void ReplayServer::reject(std::uint64_t number, const std::string& id, const std::string& problem) {
    ReplayClient* const to = client(number);
    if (!to) return;
    std::string line = fmt::format("{{\"id\":{},\"ok\":false,\"error\":", id);
    json_quote(line, problem);
    to->send(line + "}\n");
}

/// Answers a command with its exit status and what it prints.
void ReplayServer::reply_command(const Work& work, bool good, const std::string& text) {
    std::string members = fmt::format(",\"status\":{},\"out\":", good ? 0 : 1);
    json_quote(members, good ? text : "");
    json_quote(members += ",\"err\":", good ? "" : text);
    reply(work.client, work.id, members);
}

void ReplayServer::broadcast(const char* event, const Json& about) {
    Json all{{"event", event}};
    all.update(about);
    const std::string line = json_text(all) + "\n";
    for (const auto& [number, client] : clients_) {
        if (client->follows) {
            client->send(line);
        }
    }
}

// --- requests ---

void ReplayServer::handle(ReplayClient& client, const std::string& line) {
    Work work;
    work.client = client.number();
    const Json request = Json::parse(line, nullptr, false);
    if (!request.is_object()) {
        return reject(work.client, work.id, "a request is one JSON object on one line");
    }
    work.id = id_text(request);
    if (const std::string_view verb = live_verb(request); !verb.empty()) {
        return reject(work.client, work.id,
                      not_possible(verb, verb == "set" ? "setp NAME VALUE" : ""));
    }
    if (request.contains("run")) return handle_run(client, request, std::move(work));
    if (request.contains("around")) return read_rows(request, std::move(work));
    if (request.contains("moment")) return follow(client, work);
    if (request.contains("options")) return set_options(client, request, work);
    if (request.contains("subscribe")) return subscribe(client, request, work);
    if (request.contains("unsubscribe")) return unsubscribe(client, request, work);
    if (request.contains("journal")) return reply(work.client, work.id, "");
    if (request.contains("cancel")) {
        pause();
        return reply(work.client, work.id, "");
    }
    if (request.contains("stop")) {
        ends_ = true;
        return reply(work.client, work.id, "");
    }
    for (const char* const verb : {"read", "list", "describe", "complete"}) {
        if (!request.contains(verb)) continue;
        work.job = Job::request;
        work.errand.kind = Errand::Kind::request;
        work.request = line;
        return add(std::move(work));
    }
    reject(work.client, work.id,
           "missing verb; a replayed machine has: run, options, read, subscribe, unsubscribe, "
           "list, describe, complete, moment, around, journal, cancel, stop");
}

/// A command that only reads is executed as words: nothing in them is substituted.
void ReplayServer::handle_run(ReplayClient& client, const Json& request, Work work) {
    const Json& run = request["run"];
    const std::vector<std::string> words =
        run.is_string() ? split(run.get<std::string>()) : strings_of(run);
    if (words.empty()) {
        return reject(work.client, work.id, "run requires a command: a line, or its words");
    }
    if (is_move(words[0])) return move(words, std::move(work));
    const CommandRow* const row = find_command(words[0]);
    if (!row) return reply_command(work, false, fmt::format("unknown command '{}'\n", words[0]));
    if (!row->only_reads()) {
        const bool has_edit = words[0] == "setp" || words[0] == "sets";
        return reply_command(work, false,
                             not_possible(words[0], has_edit ? joined(words) : "") + "\n");
    }
    Json forwarded{{"run", words}};
    if (const auto id = request.find("id"); id != request.end()) {
        forwarded["id"] = *id;
    }
    work.job = Job::request;
    work.errand.kind = Errand::Kind::request;
    work.errand.json = client.json;
    work.request = json_text(forwarded);
    add(std::move(work));
}

/// The client gets events from now on.
void ReplayServer::follow(ReplayClient& client, const Work& work) {
    client.follows = true;
    reply(work.client, work.id,
          ",\"timeline\":" + json_text(timeline_.json()) + ",\"moment\":" + json_text(shown_));
}

void ReplayServer::set_options(ReplayClient& client, const Json& request, const Work& work) {
    const Json& options = request["options"];
    if (!options.is_object()) return reject(work.client, work.id, "options must be an object");
    const auto json = options.find("json");
    if (json != options.end() && !json->is_boolean()) {
        return reject(work.client, work.id, "json must be true or false");
    }
    client.json = json == options.end() ? client.json : json->get<bool>();
    reply(work.client, work.id, "");
}

void ReplayServer::subscribe(ReplayClient& client, const Json& request, const Work& work) {
    constexpr std::size_t max_subscriptions = 64;
    ReplayClient::Subscription subscription;
    subscription.names = strings_of(request["subscribe"]);
    if (subscription.names.empty()) {
        return reject(work.client, work.id, "subscribe must be an array of names");
    }
    if (client.subscriptions.size() >= max_subscriptions) {
        return reject(work.client, work.id,
                      fmt::format("a client has at most {} subscriptions", max_subscriptions));
    }
    const auto changes = request.find("changes");
    subscription.changes_only = changes != request.end() && *changes == true;
    const std::uint64_t number = ++client.numbers;
    client.subscriptions.emplace(number, std::move(subscription));
    reply(work.client, work.id, fmt::format(",\"subscription\":{}", number));
    publish(client, number);
}

void ReplayServer::unsubscribe(ReplayClient& client, const Json& request, const Work& work) {
    const Json& number = request["unsubscribe"];
    const bool is_known =
        number.is_number_unsigned() && client.subscriptions.erase(number.get<std::uint64_t>()) > 0;
    if (!is_known) return reject(work.client, work.id, "unknown subscription");
    reply(work.client, work.id, "");
}

void ReplayServer::read_rows(const Json& request, Work work) {
    const std::string names = joined(strings_of(request["around"]));
    const auto milliseconds = [&request](const char* member) {
        const auto given = request.find(member);
        if (given == request.end() || !given->is_number_integer()) return std::int64_t{500};
        return std::clamp(given->get<std::int64_t>(), std::int64_t{0}, max_around_ms);
    };
    if (names.empty()) return reject(work.client, work.id, "around must be an array of names");
    if (!store(work.errand.text, names)) {
        return reject(work.client, work.id, "the names are too long together; ask for fewer");
    }
    work.job = Job::rows;
    work.errand.kind = Errand::Kind::samples;
    work.errand.before_ns = milliseconds("before_ms") * 1'000'000;
    work.errand.after_ns = milliseconds("after_ms") * 1'000'000;
    add(std::move(work));
}

bool ReplayServer::is_move(std::string_view command) {
    return ReplayCommands::is_known(command) || command == "fault" || command == "pause";
}

void ReplayServer::move(const std::vector<std::string>& words, Work work) {
    if (words[0] == "pause") {
        pause();
        return reply_command(work, true, "");
    }
    if (const std::string problem = parse_move(words, work); !problem.empty()) {
        return reply_command(work, false, problem + "\n");
    }
    work.job = Job::move;
    if (work.is_goto()) {
        replace_gotos();
    }
    add(std::move(work));
}

/// Parses a command, also those that only a time line has. Returns why it is invalid; "" when it is
/// valid.
std::string ReplayServer::parse_move(const std::vector<std::string>& words, Work& work) {
    if (words[0] != "fault") return commands_.parse(words, work.errand);
    const bool is_next = words.size() == 2 && words[1] == "next";
    if (!is_next && (words.size() != 2 || words[1] != "previous")) {
        return "fault: write: fault next, or: fault previous; faults of the past cannot be "
               "acknowledged";
    }
    work.fault = is_next ? Fault::next : Fault::previous;
    work.errand.kind = Errand::Kind::run_to_fault;
    return "";
}

/// Sets the errand of a move to a fault, seen from the present moment. Returns why there is no such
/// fault; "" for other work, too.
std::string ReplayServer::find_fault(Work& work) const {
    if (work.fault == Fault::none) return "";
    const bool is_next = work.fault == Fault::next;
    const std::uint64_t here = cycles_of(shown_);
    const std::uint64_t found =
        is_next ? timeline_.fault_after(here) : timeline_.fault_before(here);
    if (found != 0) {
        work.errand.kind = Errand::Kind::seek;
        work.errand.count = found;
        return "";
    }
    if (!is_next) return "no earlier fault";
    return knows_end_ && timeline_.has_all_faults() ? "no later fault" : "";
}

// --- work ---

void ReplayServer::add(Work work) { waiting_.push_back(std::move(work)); }

/// The user moves: the machine does not go to the end of the journal by itself.
void ReplayServer::end_scan() {
    scans_ = false;
    std::erase_if(waiting_, [](const Work& work) { return work.job == Job::scan; });
    first_moves_.clear();
}

/// Answers what a newer goto makes useless: gotos behind which no other move waits.
void ReplayServer::replace_gotos() {
    const auto is_other = [](const Work& work) { return work.moves() && !work.is_goto(); };
    const auto last = std::ranges::find_if(waiting_.rbegin(), waiting_.rend(), is_other);
    const auto begin = last.base();
    for (auto work = begin; work != waiting_.end(); ++work) {
        if (work->is_goto()) {
            reply_command(*work, false, "replaced by a newer goto\n");
        }
    }
    const auto is_useless = [](const Work& work) {
        return work.is_goto() || work.job == Job::publish;
    };
    waiting_.erase(std::remove_if(begin, waiting_.end(), is_useless), waiting_.end());
}

/// Interrupts an errand that what waits need not wait for.
void ReplayServer::interrupt_older() {
    if (!is_busy_ || is_interrupted_ || waiting_.empty()) return;
    const auto move = std::ranges::find_if(waiting_, &Work::moves);
    const bool has_move = move != waiting_.end();
    const auto passed = std::chrono::steady_clock::now() - begun_;
    bool is_older = false;
    switch (current_.job) {
    case Job::scan: is_older = has_move || passed > scan_slice; break;
    case Job::rows: is_older = has_move; break;
    case Job::move:
        is_older = has_move && (current_.is_search() ||
                                (current_.is_goto() && move->is_goto() && passed > goto_time));
        break;
    default: break;
    }
    if (is_older) {
        interrupt();
    }
}

void ReplayServer::interrupt() {
    is_interrupted_ = true;
    moment_.interrupt(true);
}

/// Ends a move where it is.
void ReplayServer::pause() {
    end_scan();
    if (is_busy_ && (current_.job == Job::scan || current_.job == Job::move)) {
        interrupt();
    }
}

void ReplayServer::publish_all() {
    for (const auto& [number, client] : clients_) {
        for (const auto& [subscription, about] : client->subscriptions) {
            publish(*client, subscription);
        }
    }
}

void ReplayServer::publish(const ReplayClient& client, std::uint64_t subscription) {
    const auto is_same = [&](const Work& work) {
        return work.job == Job::publish && work.client == client.number() &&
               work.subscription == subscription;
    };
    if (std::ranges::any_of(waiting_, is_same)) return;
    Work work;
    work.job = Job::publish;
    work.client = client.number();
    work.subscription = subscription;
    work.errand.kind = Errand::Kind::request;
    work.request = json_text({{"read", client.subscriptions.at(subscription).names}});
    add(std::move(work));
}

void ReplayServer::start_next() {
    if (is_busy_ || waiting_.empty()) return;
    if (const std::string problem = find_fault(waiting_.front()); !problem.empty()) {
        reply_command(waiting_.front(), false, problem + "\n");
        waiting_.pop_front();
        return start_next();
    }
    const bool is_elsewhere = cycles_of(now_) != cycles_of(shown_);
    const Work& next = waiting_.front();
    if (is_elsewhere && !next.is_absolute() && next.job != Job::scan) {
        Work back;
        back.job = Job::restore;
        back.errand.kind = Errand::Kind::seek;
        back.errand.count = cycles_of(shown_);
        return start(std::move(back));
    }
    Work work = std::move(waiting_.front());
    waiting_.pop_front();
    start(std::move(work));
}

void ReplayServer::start(Work work) {
    current_ = std::move(work);
    if (current_.moves()) {
        end_scan();
    }
    is_busy_ = true;
    is_interrupted_ = false;
    text_.clear();
    data_.clear();
    begun_ = std::chrono::steady_clock::now();
    current_.errand.marks = true;
    current_.errand.frontier = frontier_;
    if (current_.errand.kind == Errand::Kind::request) {
        current_.errand.count = current_.request.size();
    }
    moment_.interrupt(false);
    moment_.send(current_.errand, current_.request);
}

void ReplayServer::receive(const MomentLink::Received& packet) {
    switch (packet.kind) {
    case Packet::text: text_ += packet.text; break;
    case Packet::data: data_ += packet.text; break;
    case Packet::mark:
        if (timeline_.add(packet.text)) {
            broadcast("mark", Json::parse(packet.text));
        }
        break;
    case Packet::now: note_position(Json::parse(packet.text)); break;
    case Packet::end: finish(packet.text == "0"); break;
    }
}

void ReplayServer::note_position(Json now) {
    now_ = std::move(now);
    frontier_ = std::max(frontier_, now_.value("frontier", std::uint64_t{0}));
    knows_end_ = knows_end_ || now_.value("ended", false);
    const bool is_move = current_.job == Job::move || current_.job == Job::scan;
    if (is_move && now_.value("moving", false)) {
        broadcast("moment", now_);
    }
}

void ReplayServer::finish(bool good) {
    is_busy_ = false;
    switch (current_.job) {
    case Job::scan: finish_scan(); break;
    case Job::move: finish_move(good); break;
    case Job::rows: finish_rows(good); break;
    case Job::publish: finish_publish(); break;
    case Job::request:
        if (ReplayClient* const to = client(current_.client)) {
            to->send(data_);
        }
        break;
    case Job::restore: finish_restore(); break;
    }
}

/// Clients see the machine where the process is.
void ReplayServer::show() {
    const std::chrono::duration<double, std::milli> took =
        std::chrono::steady_clock::now() - begun_;
    shown_ = now_;
    shown_["took_ms"] = took.count();
    shown_["condition"] = commands_.condition();
    shown_["left_out"] = timeline_.left_out();
    broadcast("moment", shown_);
    publish_all();
}

void ReplayServer::finish_scan() {
    show();
    if (is_interrupted_ && scans_) {
        waiting_.push_back(std::move(current_));
        return;
    }
    std::ranges::move(first_moves_, std::back_inserter(waiting_));
    first_moves_.clear();
}

void ReplayServer::finish_move(bool good) {
    show();
    reply_command(current_, good, text_);
}

/// What a machine opens again may end its execution at another cycle: then clients see it there.
void ReplayServer::finish_restore() {
    if (cycles_of(now_) != cycles_of(shown_)) {
        show();
    }
}

void ReplayServer::finish_rows(bool good) {
    ReplayClient* const to = client(current_.client);
    if (!to) return;
    if (is_interrupted_) {
        return reject(current_.client, current_.id, "interrupted by a move");
    }
    if (!good && data_.find('\n') == std::string::npos) {
        const std::string& problem = data_.empty() ? text_ : data_;
        return reject(current_.client, current_.id, problem.substr(0, problem.find('\n')));
    }
    const std::size_t first = data_.find('\n');
    const std::size_t second = data_.find('\n', first + 1);
    const std::string probe = fmt::format("\"probe\":\"around:{}\"", ++to->numbers);
    const std::string layout = data_.substr(1, first - 2);
    const std::string event = data_.substr(first + 2, second - first - 2);
    reply(current_.client, current_.id,
          fmt::format(",{},{},\"unix_ns\":{},\"moment_ns\":{}", probe, layout,
                      timeline_.begin_unix_ns(), shown_.value("time_ns", std::int64_t{0})));
    to->send(fmt::format("{{\"event\":\"samples\",{},{}\n", probe, event));
    to->send(std::string_view(data_).substr(second + 1));
}

void ReplayServer::finish_publish() {
    ReplayClient* const to = client(current_.client);
    if (!to) return;
    const auto at = to->subscriptions.find(current_.subscription);
    if (at == to->subscriptions.end()) return;
    const Json reply = Json::parse(data_, nullptr, false);
    if (!reply.is_object() || !reply.contains("values")) return;
    ReplayClient::Subscription& subscription = at->second;
    std::string values = json_text(reply["values"]);
    if (subscription.changes_only && values == subscription.last) return;
    subscription.last = std::move(values);
    to->send(fmt::format(
        "{{\"event\":\"values\",\"subscription\":{},\"time_ns\":{},\"values\":{}}}\n",
        current_.subscription, now_.value("time_ns", std::int64_t{0}), subscription.last));
}

}  // namespace hal::tools
