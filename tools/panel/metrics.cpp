// SPDX-License-Identifier: MIT
#include "panel/metrics.hpp"

#include <array>
#include <fmt/format.h>
#include <functional>
#include <libwebsockets.h>
#include <nlohmann/json.hpp>

#include "panel/clock.hpp"
#include "panel/http.hpp"
#include "paths.hpp"

namespace hal::tools {

using Json = nlohmann::json;

namespace {

constexpr std::string_view type = "text/plain; version=0.0.4; charset=utf-8";
constexpr std::int64_t timeout_ms = 3000;
constexpr std::array edges_ns{1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6, 2e6, 5e6, 1e7};

std::string label(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == '\\' || c == '"') {
            out += '\\';
        }
        if (c == '\n') {
            out += "\\n";
        } else {
            out += c;
        }
    }
    return out;
}

void family(std::string& to, std::string_view name, std::string_view kind, std::string_view help) {
    to += fmt::format("# HELP halcyon_{0} {2}\n# TYPE halcyon_{0} {1}\n", name, kind, help);
}

/// One sample per thread.
void per_thread(std::string& to, const Json& threads, std::string_view name, std::string_view kind,
                std::string_view help, const char* member, double factor = 1) {
    family(to, name, kind, help);
    for (const Json& thread : threads) {
        if (thread.contains(member) && thread[member].is_number()) {
            to +=
                fmt::format("halcyon_{}{{thread=\"{}\"}} {}\n", name,
                            label(thread.value("name", "")), thread[member].get<double>() * factor);
        }
    }
}

/// Pairs of lower edge (ns) and count as cumulative buckets. A fine bucket counts below the first
/// edge that is not less than its upper end.
void histogram(std::string& to, const Json& histograms, std::string_view name,
               std::string_view help, const char* member) {
    family(to, name, "histogram", help);
    for (const auto& [thread, both] : histograms.items()) {
        std::array<std::uint64_t, edges_ns.size() + 1> counts{};
        double sum_ns = 0;
        std::uint64_t total = 0;
        const Json pairs = both.value(member, Json::array());
        for (std::size_t i = 0; i + 1 < pairs.size(); i += 2) {
            const auto edge = pairs[i].get<double>();
            const auto count = pairs[i + 1].get<std::uint64_t>();
            const double end = edge < 8 ? edge + 1 : edge * 1.125;
            const double middle = (edge + end) / 2;
            std::size_t bucket = 0;
            while (bucket < edges_ns.size() && edges_ns[bucket] < middle) {
                ++bucket;
            }
            counts[bucket] += count;
            sum_ns += middle * static_cast<double>(count);
            total += count;
        }
        std::uint64_t below = 0;
        for (std::size_t i = 0; i < edges_ns.size(); ++i) {
            to += fmt::format("halcyon_{}_bucket{{thread=\"{}\",le=\"{}\"}} {}\n", name,
                              label(thread), edges_ns[i] / 1e9, below += counts[i]);
        }
        to += fmt::format(
            "halcyon_{0}_bucket{{thread=\"{1}\",le=\"+Inf\"}} "
            "{2}\nhalcyon_{0}_sum{{thread=\"{1}\"}} "
            "{3}\nhalcyon_{0}_count{{thread=\"{1}\"}} {2}\n",
            name, label(thread), total, sum_ns / 1e9);
    }
}

}  // namespace

std::string metrics_text(const Json& reply, bool up) {
    std::string text;
    family(text, "build_info", "gauge", "version of the panel server");
    text += fmt::format("halcyon_build_info{{version=\"{}\"}} 1\n", paths::version);
    family(text, "up", "gauge", "1 while the machine answers");
    text += fmt::format("halcyon_up {}\n", up ? 1 : 0);
    if (!up) return text;
    const Json threads = reply.value("objects", Json::array());
    const Json histograms = reply.value("histograms", Json::object());
    per_thread(text, threads, "thread_period_seconds", "gauge", "nominal period", "period_ns",
               1e-9);
    per_thread(text, threads, "thread_cycles_total", "counter", "finished cycles", "cycles");
    per_thread(text, threads, "thread_missed_cycles_total", "counter", "missed periods", "missed");
    per_thread(text, threads, "thread_overruns_total", "counter",
               "cycles that ended after the next deadline", "overruns");
    per_thread(text, threads, "thread_page_faults_total", "counter", "page faults in cycles",
               "page_faults");
    histogram(text, histograms, "thread_wakeup_latency_seconds", "wake-up latency of the cycles",
              "wakeup");
    histogram(text, histograms, "thread_execution_seconds", "execution time of the cycles", "busy");
    return text;
}

int Metrics::ask(lws* wsi, HttpAnswer& answer) {
    link_.retry();
    waiting_[next_] = {wsi, &answer, now_ms()};
    if (link_.up()) {
        request(next_);
    }
    ++next_;
    return 0;
}

void Metrics::request(std::uint64_t id) {
    link_.send(fmt::format(R"({{"id":{},"describe":"thread","histograms":true}})", id));
}

void Metrics::forget(lws* wsi) {
    std::erase_if(waiting_, [&](const auto& one) { return one.second.wsi == wsi; });
}

void Metrics::tick(std::int64_t now) {
    for (auto at = waiting_.begin(); at != waiting_.end();) {
        const Waiting one = at->second;
        const bool late = now - one.since_ms > (link_.retry() ? timeout_ms : 0);
        if (!late) {
            ++at;
            continue;
        }
        at = waiting_.erase(at);
        answer_text(one.wsi, 200, type, metrics_text(Json::object(), false), *one.answer);
    }
}

void Metrics::machine_up(std::string_view) {
    for (const auto& [id, one] : waiting_) {
        request(id);
    }
}

void Metrics::machine_down() {}

void Metrics::machine_line(std::string_view line, std::string_view) {
    const Json reply = Json::parse(line, nullptr, false);
    if (!reply.is_object() || !reply.contains("id") || !reply["id"].is_number_unsigned()) return;
    const auto at = waiting_.find(reply["id"].get<std::uint64_t>());
    if (at == waiting_.end()) return;
    const Waiting one = at->second;
    waiting_.erase(at);
    answer_text(one.wsi, 200, type, metrics_text(reply, true), *one.answer);
}

}  // namespace hal::tools
