// SPDX-License-Identifier: MIT
#include "control/client.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <utility>

#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "text/characters.hpp"
#include "text/diagnostic.hpp"

namespace hal {

using Json = nlohmann::json;

struct Client::State {
    int fd = -1;
    int cancel = -1;  ///< readable: the user wants no more of what is waited for
    bool cancelled = false;
    std::string instance, version;
    std::int64_t pid = 0;
    std::uint64_t next_id = 1;
    std::string in;
    std::size_t taken = 0;
    std::map<std::uint64_t, Json> replies;  ///< received before a caller waits for them
    struct Event {
        Json message;
        std::string payload = {};
    };
    std::deque<Event> events;
    std::size_t payload_left = 0;  ///< bytes still to come of the newest event
    std::function<void(std::string_view)> notice;
    static constexpr std::size_t max_payload = std::size_t{256} << 20;
    InstanceWitness witness;
    std::string reason;       ///< that the other side gave for closing the connection

    ~State() { lose(); }

    /// Returns the object that a machine sends first, without an id; null when none comes within
    /// 5 s.
    Json read_hello();

    void lose() {
        if (fd < 0) return;
        close(fd);
        fd = -1;
    }

    /// Sorts one line from the other side into replies and events.
    void take(std::string_view line) {
        Json message = Json::parse(line.begin(), line.end(), nullptr, false);
        if (!message.is_object()) return lose();
        if (const auto event = message.find("event"); event != message.end()) {
            if (*event == "closed") {
                reason = message.value("reason", "");
            }
            if (*event != "notice") {
                if (const auto bytes = message.find("bytes");
                    bytes != message.end() && bytes->is_number_unsigned()) {
                    payload_left = bytes->get<std::size_t>();
                }
                if (payload_left > max_payload) return lose();
                return events.push_back({std::move(message)});
            }
            if (notice) {
                notice(message.value("text", ""));
            }
            return;
        }
        const auto id = message.find("id");
        if (id != message.end() && id->is_number_unsigned()) {
            const auto number = id->get<std::uint64_t>();
            replies.emplace(number, std::move(message));
        }
    }

    /// Moves raw bytes that have come to the newest event.
    bool receive_payload() {
        if (payload_left == 0) return false;
        const std::size_t part = std::min(payload_left, in.size() - taken);
        events.back().payload.append(in, taken, part);
        taken += part;
        payload_left -= part;
        return true;
    }

    /// Reads what has come and takes the complete lines.
    void read_lines() {
        std::array<char, 65536> part;
        const ssize_t got = recv(fd, part.data(), part.size(), MSG_DONTWAIT);
        if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return lose();
        if (got < 0) return;
        const std::size_t searched = in.size();
        in.append(part.data(), static_cast<std::size_t>(got));
        std::size_t from = receive_payload() ? taken : searched;
        for (std::size_t end; payload_left == 0 && (end = in.find('\n', from)) != std::string::npos;
             from = taken) {
            const std::size_t begin = taken;
            taken = end + 1;
            take(std::string_view(in).substr(begin, end - begin));
            if (fd < 0) return;
            receive_payload();
        }
        in.erase(0, taken);
        taken = 0;
    }

    /// The first time asks the other side to end the command; it may be one that does not listen.
    void on_cancel() {
        drain_cancel();
        if (std::exchange(cancelled, true)) return lose();
        write_all("{\"cancel\":true}\n");
    }
    void drain_cancel() const {
        std::array<char, 4096> news;
        while (cancel >= 0 && read(cancel, news.data(), news.size()) > 0) {
        }
    }

    /// Waits until something can be read (or written, when asked). False after the time-out.
    bool wait_for(short what, int timeout_ms) {
        pollfd ready[] = {{fd, what, 0}, {cancel, POLLIN, 0}};
        const int count = poll(ready, 2, timeout_ms);
        if (count < 0 && errno != EINTR) {
            lose();
        }
        if (count > 0 && ready[0].revents & (POLLIN | POLLHUP | POLLERR)) {
            read_lines();
        }
        if (count > 0 && (ready[1].revents & POLLIN)) {
            on_cancel();
        }
        return count != 0;
    }

    /// Reads while it writes: a long sequence of requests must not block because replies fill the
    /// other direction.
    void write_all(std::string_view text) {
        while (!text.empty() && fd >= 0) {
            const ssize_t gone = ::send(fd, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
            if (gone > 0) {
                text.remove_prefix(static_cast<std::size_t>(gone));
            } else if (gone < 0 && errno == EAGAIN) {
                wait_for(POLLIN | POLLOUT, -1);
            } else if (gone < 0 && errno != EINTR) {
                lose();
            }
        }
    }

    Json lost() const {
        return {{"ok", false},
                {"error", "the connection to instance '" + instance + "' is lost" +
                              (reason.empty() ? "" : ": " + reason)}};
    }
};

Client::Client() : state_(new State) {}
Client::~Client() = default;

namespace {

/// Returns why no connection to the instance was made. `error`: of connect().
std::string reason_of(int error, std::string_view instance) {
    const std::string name = "instance '" + std::string(instance) + "' ";
    const std::string group = group_without_user(instance);
    if (!group.empty()) {
        return name + "is shared with the group '" + group +
               "', which you are not in; type: sudo adduser $USER " + group + ", then log in again";
    }
    if (error == EACCES || error == EPERM) return name + "belongs to another user";
    const auto running = running_instances();
    return "no " + name + "is running; " +
           (running.empty() ? "start one with `hal run FILE.hal`"
                            : "running: " + listed(running) + " (choose with --name)");
}

}  // namespace

Json Client::State::read_hello() {
    using namespace std::chrono;
    const auto deadline = steady_clock::now() + 5s;
    while (fd >= 0 && in.find('\n') == std::string::npos) {
        const auto left = ceil<milliseconds>(deadline - steady_clock::now());
        pollfd ready{fd, POLLIN, 0};
        const int readable = left > 0ms ? poll(&ready, 1, static_cast<int>(left.count())) : 0;
        if (readable == 0) return nullptr;
        if (readable < 0) continue;  // interrupted
        std::array<char, 512> part;
        const ssize_t got = recv(fd, part.data(), part.size(), 0);
        if (got > 0) {
            in.append(part.data(), static_cast<std::size_t>(got));
        } else if (got == 0 || errno != EINTR) {
            lose();
        }
    }
    const auto end = in.find('\n');
    if (end == std::string::npos) return nullptr;
    const auto last = in.begin() + static_cast<std::ptrdiff_t>(end);
    Json hello = Json::parse(in.begin(), last, nullptr, false);
    in.erase(0, end + 1);
    return hello;
}

std::unique_ptr<Client> Client::connect(std::string_view instance, std::string& problem) {
    std::unique_ptr<Client> client(new Client);
    State& s = *client->state_;
    s.instance = instance;
    const std::string path = found_socket(instance);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (!good_instance_name(instance) || path.size() >= sizeof address.sun_path) {
        problem = "'" + s.instance + "' is not a valid instance name";
        return nullptr;
    }
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    s.fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (s.fd < 0 ||
        ::connect(s.fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        problem = reason_of(errno, instance);
        return nullptr;
    }
    const Json hello = s.read_hello();
    if (!hello.is_object()) {
        problem = "instance '" + s.instance + "' does not answer";
        return nullptr;
    }
    if (hello.value("halcyon", 0) != 1) {
        problem = "instance '" + s.instance + "' uses another version of the protocol";
        return nullptr;
    }
    s.version = hello.value("version", "");
    s.pid = hello.value("pid", std::int64_t{0});
    s.witness.watch(instance, s.pid);
    return client;
}

const std::string& Client::instance() const { return state_->instance; }
const std::string& Client::version() const { return state_->version; }
std::int64_t Client::pid() const { return state_->pid; }
bool Client::connected() const { return state_->fd >= 0; }
bool Client::look() {
    if (state_->fd >= 0) {
        state_->wait_for(POLLIN, 0);
    }
    return connected();
}
const std::string& Client::closed_because() const { return state_->reason; }
InstanceEnd Client::instance_end() const { return state_->witness.end(); }
void Client::on_notice(std::function<void(std::string_view)> take) {
    state_->notice = std::move(take);
}
void Client::close_in_child() { state_->lose(); }
int Client::fd() const { return state_->fd; }
void Client::cancel_on(int descriptor) { state_->cancel = descriptor; }

std::uint64_t Client::send(Json body) {
    const std::uint64_t id = state_->next_id++;
    body["id"] = id;
    state_->write_all(body.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
    return id;
}

Json Client::wait(std::uint64_t id) {
    State& s = *state_;
    while (true) {
        if (const auto at = s.replies.find(id); at != s.replies.end()) {
            Json reply = std::move(at->second);
            s.replies.erase(at);
            return reply;
        }
        if (s.fd < 0) return s.lost();
        s.wait_for(POLLIN, -1);
    }
}

Json Client::request(Json body) {
    state_->cancelled = false;
    return wait(send(std::move(body)));
}

bool Client::next_event(Json& event, int timeout_ms) {
    std::string payload;
    return next_event(event, payload, timeout_ms);
}

bool Client::next_event(Json& event, std::string& payload, int timeout_ms) {
    State& s = *state_;
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
    while (s.events.empty() || (s.events.size() == 1 && s.payload_left > 0)) {
        if (s.fd < 0) return false;
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
                              end - std::chrono::steady_clock::now())
                              .count();
        if (timeout_ms >= 0 && left < 0) return false;
        s.wait_for(POLLIN, timeout_ms < 0 ? -1 : static_cast<int>(left));
    }
    event = std::move(s.events.front().message);
    payload = std::move(s.events.front().payload);
    s.events.pop_front();
    return true;
}

namespace {

Client::Answer answer_of(const Json& reply) {
    Client::Answer answer;
    if (!reply.value("ok", false)) {
        answer.err = reply.value("error", "no answer") + "\n";
        return answer;
    }
    answer.executed = true;
    answer.status = reply.value("status", 0);
    answer.out = reply.value("out", "");
    answer.err = reply.value("err", "");
    answer.quit = reply.value("quit", false);
    answer.collecting = reply.value("collecting", false);
    return answer;
}

/// The variables a text names, with what they are here.
Json environment_for(std::string_view text) {
    Json variables = Json::object();
    for (std::size_t at = 0; (at = text.find('$', at)) != text.npos;) {
        ++at;
        if (at < text.size() && text[at] == '(') {
            ++at;
        }
        const std::size_t end = end_of_run(text, at, is_name_character);
        const std::string name(text.substr(at, end - at));
        at = end;
        if (const char* const value = std::getenv(name.c_str())) {
            variables[name] = value;
        }
    }
    return variables;
}

}  // namespace

bool Client::set_options(const Options& o) {
    Json options{{"keep_going", o.keep_going}, {"echo", o.echo},
                 {"script", o.script},         {"json", o.json},
                 {"color", o.color},           {"notes", o.notes},
                 {"level", o.level},           {"directory", o.directory}};
    if (!o.ini.empty()) {
        options["ini"] = o.ini;
    }
    return request({{"options", std::move(options)}}).value("ok", false);
}

Client::Answer Client::run(std::string_view line, std::string_view name, std::uint32_t number) {
    return answer_of(
        request({{"run", line}, {"name", name}, {"line", number}, {"env", environment_for(line)}}));
}

Client::Answer Client::run(const std::vector<std::string>& words, std::string_view name) {
    return answer_of(request({{"run", words}, {"name", name}}));
}

Client::Answer Client::run_text(std::string_view name, std::string_view text) {
    return answer_of(request({{"script", text}, {"name", name}, {"env", environment_for(text)}}));
}

Client::Answer Client::stop() { return answer_of(request({{"stop", true}})); }

Completion Client::complete(std::string_view line, std::size_t cursor) {
    const Json reply = request({{"complete", line}, {"cursor", cursor}});
    Completion completion;
    completion.begin = reply.value("begin", std::size_t{0});
    for (const Json& candidate : reply.value("candidates", Json::array())) {
        completion.candidates.push_back({candidate.value("text", ""), candidate.value("hint", "")});
    }
    return completion;
}

}  // namespace hal
