// SPDX-License-Identifier: MIT
// The control protocol: an input is what a client sends. Every line gets one reply of one line,
// which is JSON, and the machine is in order afterwards. What may wait or leave the process
// (programs, files) is not executed here.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "commands/shell.hpp"
#include "control/connection.hpp"
#include "machine/session.hpp"
#include "tests/fuzz/driver/require.hpp"

namespace {

using hal::fuzz::require;

bool leaves_the_process(std::string_view line) {
    for (const char* word : {"save", "usr", "source", "unlock", "advance", "\\u"}) {
        if (line.find(word) != line.npos) return true;
    }
    return false;
}

void check_reply(std::string_view reply, std::string_view line) {
    require(reply.ends_with('\n') && reply.find('\n') == reply.size() - 1, "a reply is one line",
            line);
    const auto json = nlohmann::json::parse(reply.begin(), reply.end(), nullptr, false);
    require(json.is_object() && json.contains("id") && json.contains("ok"),
            "a reply is an object with id and ok", line);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    setenv("PATH", "/nonexistent", 1);
    hal::SessionOptions options;
    options.check_only = true;
    hal::Session session(options);
    hal::Shell shell(session);
    hal::TextOutput output;
    shell.run_text(
        "start.hal",
        "newthread t 1000000\nnewsig level float\nnewsig flag bit\nalias param t.tmax longest\n",
        output);
    // no components: their number would be the fuzzer's choice
    session.locked = static_cast<unsigned>(hal::Lock::load);
    {
        hal::Connection connection(shell, 1);
        const std::string_view text(reinterpret_cast<const char*>(data), size);
        for (std::size_t at = 0; at < text.size();) {
            const auto end = std::min(text.find('\n', at), text.size());
            const std::string_view line = text.substr(at, end - at);
            at = end + 1;
            if (leaves_the_process(line)) continue;
            std::string reply;
            connection.cancels(line);
            if (connection.handle(line, reply) == hal::Connection::Handled::wants_thread) {
                require(reply.empty(), "what waits has no reply yet", line);
                // a word that waits could be put together from parts
                if (line.find("env") != line.npos) continue;
                connection.handle(line, reply, true);
            }
            check_reply(reply, line);
            require(!session.in_transaction(), "no transaction is left open", line);
        }
        std::string events;
        connection.publish(connection.next_due_ns(), false, events);
        std::string reply;
        connection.handle(R"({"id":"last","list":"comp"})", reply);
        require(reply.find("\"id\":\"last\",\"ok\":true") != reply.npos, "the connection goes on",
                text);
    }
    require(session.try_lock().owns_lock(), "nobody holds the machine", {});
    return 0;
}
