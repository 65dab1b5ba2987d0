// SPDX-License-Identifier: MIT
#include "endpoint.hpp"

#include <time.h>

#include <algorithm>
#include <cstring>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include "participant_impl.hpp"

namespace hal::dds::engine {
namespace {

using eprosima::fastrtps::types::ReturnCode_t;

std::int64_t now(clockid_t clock) noexcept {
    timespec t{};
    clock_gettime(clock, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

eprosima::fastrtps::Duration_t duration(std::int64_t ns) {
    return {static_cast<std::int32_t>(ns / 1'000'000'000),
            static_cast<std::uint32_t>(ns % 1'000'000'000)};
}

const char* policy_name(fd::QosPolicyId_t id) {
    switch (id) {
    case fd::RELIABILITY_QOS_POLICY_ID:
        return "reliability (offered best effort, requested reliable)";
    case fd::DEADLINE_QOS_POLICY_ID:
        return "deadline (the offered interval is longer than the requested one)";
    case fd::DURABILITY_QOS_POLICY_ID:
        return "durability (offered volatile, requested transient-local)";
    case fd::LIVELINESS_QOS_POLICY_ID:
        return "liveliness (the offered lease is longer than the requested one)";
    case fd::LATENCYBUDGET_QOS_POLICY_ID: return "latency budget";
    case fd::OWNERSHIP_QOS_POLICY_ID: return "ownership";
    case fd::DATAREPRESENTATION_QOS_POLICY_ID:
        return "data representation (this side supports XCDR1)";
    case fd::PARTITION_QOS_POLICY_ID: return "partition";
    default: return "another policy";
    }
}

template <class Qos>
void common(Qos& qos, const Quality& q) {
    qos.reliability().kind =
        q.reliable ? fd::RELIABLE_RELIABILITY_QOS : fd::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind =
        q.last_value ? fd::TRANSIENT_LOCAL_DURABILITY_QOS : fd::VOLATILE_DURABILITY_QOS;
    qos.history().kind = fd::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = std::clamp(q.depth, 1, 100'000);
    auto& limits = qos.resource_limits();
    limits.max_instances = 1;
    limits.max_samples = limits.max_samples_per_instance = std::max(qos.history().depth, 100);
    limits.allocated_samples = std::min(qos.history().depth, 100);
    if (q.deadline_ns > 0) {
        qos.deadline().period = duration(q.deadline_ns);
    }
    if (q.latency_budget_ns > 0) {
        qos.latency_budget().duration = duration(q.latency_budget_ns);
    }
    if (q.lease_ns > 0) {
        qos.liveliness().lease_duration = duration(q.lease_ns);
    }
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.data_sharing().off();  // the writer would overwrite unread samples
}

}  // namespace

bool WriterImpl::write(std::span<const std::uint8_t> bytes, std::int64_t source_ns) noexcept {
    if (writer_ == nullptr) return false;
    Bytes sample{bytes, {}};
    try {
        if (source_ns == 0) return writer_->write(&sample);
        const eprosima::fastrtps::Time_t at(static_cast<std::int32_t>(source_ns / 1'000'000'000),
                                            static_cast<std::uint32_t>(source_ns % 1'000'000'000));
        return writer_->write_w_timestamp(&sample, fd::HANDLE_NIL, at) == ReturnCode_t::RETCODE_OK;
    } catch (...) {
        return false;
    }
}

bool WriterImpl::wait_for_acknowledgments(std::int64_t timeout_ns) noexcept {
    return writer_ != nullptr &&
           writer_->wait_for_acknowledgments(duration(timeout_ns)) == ReturnCode_t::RETCODE_OK;
}

void WriterImpl::on_offered_incompatible_qos(fd::DataWriter*,
                                             const fd::OfferedIncompatibleQosStatus& s) {
    gate->event(Event::wrong_quality, static_cast<int>(s.total_count),
                policy_name(s.last_policy_id));
}

void ReaderImpl::on_data_available(fd::DataReader* reader) {
    gate->with([&](Listener& listener) {
        fd::SampleInfo info;
        while (reader->take_next_sample(&sample_, &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) continue;
            Sample s{sample_.in,
                     info.source_timestamp.to_ns(),
                     now(CLOCK_REALTIME),
                     now(CLOCK_MONOTONIC),
                     0,
                     {}};
            const auto& id = info.sample_identity;
            s.sequence = id.sequence_number().to64long();
            std::memcpy(s.writer.data(), id.writer_guid().guidPrefix.value, 12);
            std::memcpy(s.writer.data() + 12, id.writer_guid().entityId.value, 4);
            listener.on_sample(s);
        }
    });
}

void ReaderImpl::on_requested_incompatible_qos(fd::DataReader*,
                                               const fd::RequestedIncompatibleQosStatus& s) {
    gate->event(Event::wrong_quality, static_cast<int>(s.total_count),
                policy_name(s.last_policy_id));
}

WriterImpl::WriterImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType& t, const Quality& q,
                       Listener* l)
    : Endpoint(std::move(owner), t, q, l) {
    owner_->join(*this, true);
}

WriterImpl::~WriterImpl() { owner_->leave(*this); }

bool WriterImpl::make(fd::Topic* to) {
    fd::DataWriterQos qos = fd::DATAWRITER_QOS_DEFAULT;
    if (!owner_->settings().profile.empty()) {
        owner_->publisher->get_datawriter_qos_from_profile(topic.name, qos);
    }
    common(qos, quality);
    if (quality.lease_ns > 0) {
        qos.liveliness().announcement_period =
            duration(std::max<std::int64_t>(quality.lease_ns / 3, 1'000'000));
    }
    // longest delay until a lost sample is requested again
    qos.reliable_writer_qos().times.heartbeatPeriod = duration(100'000'000);
    writer_ = owner_->publisher->create_datawriter(to, qos, this);
    return writer_ != nullptr;
}

void WriterImpl::unmake() noexcept {
    if (writer_ == nullptr) return;
    owner_->publisher->delete_datawriter(writer_);
    writer_ = nullptr;
    count_matched(0, -1);
}

ReaderImpl::ReaderImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType& t, const Quality& q,
                       Listener* l)
    : Endpoint(std::move(owner), t, q, l) {
    sample_.in.reserve(t.max);
    owner_->join(*this, false);
}

ReaderImpl::~ReaderImpl() { owner_->leave(*this); }

bool ReaderImpl::make(fd::Topic* from) {
    fd::DataReaderQos qos = fd::DATAREADER_QOS_DEFAULT;
    if (!owner_->settings().profile.empty()) {
        owner_->subscriber->get_datareader_qos_from_profile(topic.name, qos);
    }
    common(qos, quality);
    reader_ = owner_->subscriber->create_datareader(from, qos, this);
    return reader_ != nullptr;
}

void ReaderImpl::unmake() noexcept {
    if (reader_ == nullptr) return;
    owner_->subscriber->delete_datareader(reader_);
    reader_ = nullptr;
    count_matched(0, -1);
}

}  // namespace hal::dds::engine
