// SPDX-License-Identifier: MIT
// Participants, writers and readers on Fast DDS 2.9. A sample is bytes here: the types have names and no fields.
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <functional>
#include <map>
#include <mutex>
#include <stdexcept>

#include "dds/words.hpp"
#include "settings.hpp"

namespace hal::dds {
namespace {

namespace fd = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

std::int64_t now(clockid_t clock) noexcept {
    timespec t{};
    clock_gettime(clock, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

eprosima::fastrtps::Duration_t duration(std::int64_t ns) {
    return {static_cast<std::int32_t>(ns / 1'000'000'000), static_cast<std::uint32_t>(ns % 1'000'000'000)};
}

/// What the library's threads get: an ordinary policy, and stacks that may be resident (mlockall makes them so).
class OrdinaryThread {
public:
    template <class F>
    static void run(F&& work) {
        pthread_attr_t attributes, before;
        pthread_attr_init(&attributes);
        pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
        pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
        const sched_param none{};
        pthread_attr_setschedparam(&attributes, &none);
        pthread_attr_setstacksize(&attributes, stack);
        pthread_getattr_default_np(&before);
        pthread_attr_t small = before;
        pthread_attr_setstacksize(&small, stack);
        pthread_setattr_default_np(&small);
        struct Call {
            F&                 work;
            std::exception_ptr error;
        } call{work, {}};
        pthread_t thread{};
        const int failed = pthread_create(&thread, &attributes, [](void* p) -> void* {
            auto& c = *static_cast<Call*>(p);
            setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), -10);  // inherited by the library's threads; where it is allowed
            try {
                c.work();
            } catch (...) { c.error = std::current_exception(); }
            return nullptr;
        }, &call);
        if (failed == 0) pthread_join(thread, nullptr);
        pthread_setattr_default_np(&before);
        pthread_attr_destroy(&before);
        pthread_attr_destroy(&attributes);
        if (failed != 0) throw std::runtime_error("no thread for DDS could be started");
        if (call.error) std::rethrow_exception(call.error);
    }

private:
    static constexpr std::size_t stack = std::size_t{512} * 1024;
};

/// A sample on its way in or out.
struct Bytes {
    std::span<const std::uint8_t> out;  // written: whose memory it is, the writer knows
    std::vector<std::uint8_t>     in;   // read
};

class BytesType : public fd::TopicDataType {
public:
    BytesType(const std::string& name, std::size_t largest) {
        setName(name.c_str());
        m_typeSize = static_cast<std::uint32_t>(largest);
        m_isGetKeyDefined = false;
        auto_fill_type_object(false);       // Cyclone DDS refuses endpoints that announce these parameters as 2.9 does
        auto_fill_type_information(false);
    }
    void grow(std::size_t largest) { m_typeSize = std::max(m_typeSize, static_cast<std::uint32_t>(largest)); }

    bool serialize(void* data, rtps::SerializedPayload_t* to) override {
        const std::span<const std::uint8_t> from = static_cast<Bytes*>(data)->out;
        if (from.size() > to->max_size) return false;
        std::memcpy(to->data, from.data(), from.size());
        to->length = static_cast<std::uint32_t>(from.size());
        to->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(rtps::SerializedPayload_t* from, void* data) override {
        static_cast<Bytes*>(data)->in.assign(from->data, from->data + from->length);
        return true;
    }
    std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<std::uint32_t>(static_cast<Bytes*>(data)->out.size()); };
    }
    void* createData() override { return new Bytes; }
    void  deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool  getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

const char* policy_name(fd::QosPolicyId_t id) {
    switch (id) {
    case fd::RELIABILITY_QOS_POLICY_ID: return "reliability (best effort is offered, reliable is asked for)";
    case fd::DEADLINE_QOS_POLICY_ID: return "deadline (samples are promised less often than they are asked for)";
    case fd::DURABILITY_QOS_POLICY_ID: return "durability (old samples are asked for and not kept)";
    case fd::LIVELINESS_QOS_POLICY_ID: return "liveliness (a shorter lease is asked for than is offered)";
    case fd::LATENCYBUDGET_QOS_POLICY_ID: return "latency budget";
    case fd::OWNERSHIP_QOS_POLICY_ID: return "ownership";
    case fd::DATAREPRESENTATION_QOS_POLICY_ID: return "data representation (XCDR1 is what is spoken here)";
    case fd::PARTITION_QOS_POLICY_ID: return "partition";
    default: return "another policy";
    }
}

/// Where the engine's calls of one writer or reader arrive, one at a time, until its owner is gone.
class Gate {
public:
    explicit Gate(Listener* listener) : listener_(listener) {}
    void close() {
        const std::lock_guard lock(mutex_);
        listener_ = nullptr;
    }
    void event(Event e, int count, const std::string& words = {}) {
        const std::lock_guard lock(mutex_);
        if (listener_ != nullptr) listener_->on_event(e, count, words);
    }
    template <class F>
    void with(F&& f) {
        const std::lock_guard lock(mutex_);
        if (listener_ != nullptr) f(*listener_);
    }

private:
    std::mutex mutex_;
    Listener*  listener_;
};

template <class Qos>
void common(Qos& qos, const Quality& q) {
    qos.reliability().kind = q.reliable ? fd::RELIABLE_RELIABILITY_QOS : fd::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = q.last_value ? fd::TRANSIENT_LOCAL_DURABILITY_QOS : fd::VOLATILE_DURABILITY_QOS;
    qos.history().kind = fd::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = std::clamp(q.depth, 1, 100'000);
    auto& limits = qos.resource_limits();
    limits.max_instances = 1;
    limits.max_samples = limits.max_samples_per_instance = std::max(qos.history().depth, 100);
    limits.allocated_samples = std::min(qos.history().depth, 100);
    if (q.deadline_ns > 0) qos.deadline().period = duration(q.deadline_ns);
    if (q.latency_budget_ns > 0) qos.latency_budget().duration = duration(q.latency_budget_ns);
    if (q.lease_ns > 0) qos.liveliness().lease_duration = duration(q.lease_ns);
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.data_sharing().off();  // the writer would overwrite samples that are not read yet
}

class ParticipantImpl;

class WriterImpl final : public Writer, private fd::DataWriterListener {
public:
    WriterImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType&, const Quality&, Listener*);
    ~WriterImpl() override;
    bool write(std::span<const std::uint8_t> bytes, std::int64_t source_ns) noexcept override {
        Bytes sample{bytes, {}};
        try {
            if (source_ns == 0) return writer_->write(&sample);
            const eprosima::fastrtps::Time_t at(static_cast<std::int32_t>(source_ns / 1'000'000'000),
                                                static_cast<std::uint32_t>(source_ns % 1'000'000'000));
            return writer_->write_w_timestamp(&sample, fd::HANDLE_NIL, at) == ReturnCode_t::RETCODE_OK;
        } catch (...) { return false; }
    }
    int  matched() const noexcept override { return matched_.load(std::memory_order_relaxed); }
    bool wait_for_acknowledgments(std::int64_t timeout_ns) noexcept override {
        return writer_->wait_for_acknowledgments(duration(timeout_ns)) == ReturnCode_t::RETCODE_OK;
    }

private:
    void on_publication_matched(fd::DataWriter*, const fd::PublicationMatchedStatus& s) override {
        matched_.store(s.current_count, std::memory_order_relaxed);
        gate_->event(s.current_count_change > 0 ? Event::matched : Event::unmatched, s.current_count);
    }
    void on_offered_deadline_missed(fd::DataWriter*, const fd::OfferedDeadlineMissedStatus& s) override {
        gate_->event(Event::deadline_missed, static_cast<int>(s.total_count));
    }
    void on_offered_incompatible_qos(fd::DataWriter*, const fd::OfferedIncompatibleQosStatus& s) override {
        gate_->event(Event::wrong_quality, static_cast<int>(s.total_count), policy_name(s.last_policy_id));
    }
    std::shared_ptr<ParticipantImpl> owner_;
    const std::string                topic_;
    std::shared_ptr<Gate>            gate_;
    std::atomic<int>                 matched_{0};
    fd::DataWriter*                  writer_ = nullptr;
};

class ReaderImpl final : public Reader, private fd::DataReaderListener {
public:
    ReaderImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType&, const Quality&, Listener*);
    ~ReaderImpl() override;
    int matched() const noexcept override { return matched_.load(std::memory_order_relaxed); }

private:
    void on_data_available(fd::DataReader* reader) override {
        gate_->with([&](Listener& listener) {
            fd::SampleInfo info;
            while (reader->take_next_sample(&sample_, &info) == ReturnCode_t::RETCODE_OK) {
                if (!info.valid_data) continue;
                Sample      s{sample_.in, info.source_timestamp.to_ns(), now(CLOCK_REALTIME), now(CLOCK_MONOTONIC), 0, {}};
                const auto& id = info.sample_identity;
                s.sequence = id.sequence_number().to64long();
                std::memcpy(s.writer.data(), id.writer_guid().guidPrefix.value, 12);
                std::memcpy(s.writer.data() + 12, id.writer_guid().entityId.value, 4);
                listener.on_sample(s);
            }
        });
    }
    void on_subscription_matched(fd::DataReader*, const fd::SubscriptionMatchedStatus& s) override {
        matched_.store(s.current_count, std::memory_order_relaxed);
        gate_->event(s.current_count_change > 0 ? Event::matched : Event::unmatched, s.current_count);
    }
    void on_requested_deadline_missed(fd::DataReader*, const fd::RequestedDeadlineMissedStatus& s) override {
        gate_->event(Event::deadline_missed, static_cast<int>(s.total_count));
    }
    void on_requested_incompatible_qos(fd::DataReader*, const fd::RequestedIncompatibleQosStatus& s) override {
        gate_->event(Event::wrong_quality, static_cast<int>(s.total_count), policy_name(s.last_policy_id));
    }
    void on_liveliness_changed(fd::DataReader*, const fd::LivelinessChangedStatus& s) override {
        gate_->event(s.alive_count_change > 0 ? Event::alive : Event::not_alive, s.alive_count);
    }
    std::shared_ptr<ParticipantImpl> owner_;
    const std::string                topic_;
    std::shared_ptr<Gate>            gate_;
    std::atomic<int>                 matched_{0};
    Bytes                            sample_;  // under the gate's lock
    fd::DataReader*                  reader_ = nullptr;
};

class ParticipantImpl final : public Participant,
                              public std::enable_shared_from_this<ParticipantImpl>,
                              private fd::DomainParticipantListener {
public:
    explicit ParticipantImpl(const Settings& s) : settings_(s) {
        OrdinaryThread::run([&] {
            const fd::DomainParticipantQos qos = participant_qos(s);
            fd::StatusMask                 none = fd::StatusMask::none();
            participant_ =
                fd::DomainParticipantFactory::get_instance()->create_participant(static_cast<std::uint32_t>(s.domain), qos, this, none);
            if (participant_ == nullptr)
                throw std::runtime_error(s.security.empty()
                                             ? "Fast DDS made no participant; its own message says why"
                                             : "Fast DDS refuses the files in " + s.security + "; its own message says which");
            publisher = participant_->create_publisher(fd::PUBLISHER_QOS_DEFAULT);
            subscriber = participant_->create_subscriber(fd::SUBSCRIBER_QOS_DEFAULT);
        });
    }
    ~ParticipantImpl() override {
        participant_->set_listener(nullptr);
        participant_->delete_contained_entities();
        fd::DomainParticipantFactory::get_instance()->delete_participant(participant_);
    }
    std::unique_ptr<Writer> writer(const TopicType& t, const Quality& q, Listener* l) override {
        return std::make_unique<WriterImpl>(shared_from_this(), t, q, l);
    }
    std::unique_ptr<Reader> reader(const TopicType& t, const Quality& q, Listener* l) override {
        return std::make_unique<ReaderImpl>(shared_from_this(), t, q, l);
    }
    std::vector<Known> known() const override {
        const std::lock_guard lock(mutex_);
        std::vector<Known>    all;
        all.reserve(known_.size());
        for (const auto& [prefix, k] : known_) all.push_back(k);
        return all;
    }
    const Settings& settings() const noexcept override { return settings_; }

    /// The topic, of this type; told apart by name. Give it back with release(). [setup]
    fd::Topic* acquire(const TopicType& t) {
        const std::lock_guard lock(setup_);
        auto&                 type = types_[t.type];
        if (type == nullptr) {
            type = new BytesType(t.type, t.largest);
            fd::TypeSupport(type).register_type(participant_, t.type);
        }
        type->grow(t.largest);
        auto& [topic, users] = topics_[t.name];
        if (topic == nullptr) topic = participant_->create_topic(t.name, t.type, fd::TOPIC_QOS_DEFAULT);
        if (topic == nullptr) throw std::runtime_error("Fast DDS made no topic '" + t.name + "'");
        if (topic->get_type_name() != t.type)
            throw std::runtime_error("topic '" + t.name + "' has the type " + topic->get_type_name() +
                                     " in this process already, and here " + t.type + "; give both the same fields, or another topic=");
        ++users;
        return topic;
    }
    void release(const std::string& name) {
        const std::lock_guard lock(setup_);
        const auto            at = topics_.find(name);
        if (at == topics_.end() || --at->second.second > 0) return;
        participant_->delete_topic(at->second.first);
        topics_.erase(at);
    }
    /// Told from now on when somebody has this topic with another type.
    void watch(const TopicType& t, bool writes, std::shared_ptr<Gate> gate) {
        const std::lock_guard lock(mutex_);
        watched_.push_back({t.name, t.type, writes, std::move(gate)});
        for (const auto& [guid, e] : remote_) compare(watched_.back(), e);
    }
    void forget(const std::shared_ptr<Gate>& gate) {
        const std::lock_guard lock(mutex_);
        std::erase_if(watched_, [&gate](const Watched& w) { return w.gate == gate; });
    }

    fd::Publisher*  publisher = nullptr;
    fd::Subscriber* subscriber = nullptr;

private:
    struct Watched {
        std::string           topic, type;
        bool                  writes;
        std::shared_ptr<Gate> gate;
    };
    struct Remote {
        std::string topic, type;
        bool        writes;
    };
    static void compare(const Watched& ours, const Remote& theirs) {
        if (ours.topic != theirs.topic || ours.writes == theirs.writes || ours.type == theirs.type) return;
        ours.gate->event(Event::wrong_type, 0,
                         "topic '" + ours.topic + "' has the type " + ours.type + " here and " + shown(theirs.type) + " at a " +
                             (theirs.writes ? "publisher" : "subscriber") + " elsewhere; nothing is exchanged with it");
    }
    template <class Data>
    void endpoint(bool gone, bool writes, const Data& data) {
        const std::lock_guard lock(mutex_);
        if (gone) {
            remote_.erase(data.guid());
            return;
        }
        const Remote r{data.topicName().to_string(), data.typeName().to_string(), writes};
        if (remote_.size() < 10'000 && remote_.emplace(data.guid(), r).second)
            for (const Watched& w : watched_) compare(w, r);
    }
    void on_publisher_discovery(fd::DomainParticipant*, rtps::WriterDiscoveryInfo&& i) override {
        endpoint(i.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER, true, i.info);
    }
    void on_subscriber_discovery(fd::DomainParticipant*, rtps::ReaderDiscoveryInfo&& i) override {
        endpoint(i.status == rtps::ReaderDiscoveryInfo::REMOVED_READER, false, i.info);
    }
    void on_participant_discovery(fd::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& i) override {
        const std::lock_guard lock(mutex_);
        const auto&           prefix = i.info.m_guid.guidPrefix;
        if (i.status == rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
            i.status == rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT) {
            known_.erase(prefix);
            return;
        }
        Known k{i.info.m_participantName.to_string(), {}, {}};
        for (const rtps::octet o : i.info.m_userData) k.user_data += static_cast<char>(o);
        std::copy(std::begin(prefix.value), std::end(prefix.value), k.prefix.begin());
        known_[prefix] = std::move(k);
    }

    const Settings                                    settings_;
    fd::DomainParticipant*                            participant_ = nullptr;
    mutable std::mutex                                mutex_;  // of these; nothing of Fast DDS is called under it
    std::vector<Watched>                              watched_;
    std::map<rtps::GUID_t, Remote>                    remote_;
    std::map<rtps::GuidPrefix_t, Known>               known_;
    std::mutex                                        setup_;  // of these; not taken by callbacks
    std::map<std::string, BytesType*>                 types_;  // owned by the participant
    std::map<std::string, std::pair<fd::Topic*, int>> topics_;
};

WriterImpl::WriterImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType& t, const Quality& q, Listener* l)
    : owner_(std::move(owner)), topic_(t.name), gate_(std::make_shared<Gate>(l)) {
    fd::Topic* topic = owner_->acquire(t);
    OrdinaryThread::run([&] {
        fd::DataWriterQos qos = fd::DATAWRITER_QOS_DEFAULT;
        if (!owner_->settings().profile.empty()) owner_->publisher->get_datawriter_qos_from_profile(t.name, qos);
        common(qos, q);
        if (q.lease_ns > 0) qos.liveliness().announcement_period = duration(std::max<std::int64_t>(q.lease_ns / 3, 1'000'000));
        qos.reliable_writer_qos().times.heartbeatPeriod = duration(100'000'000);  // a lost sample is asked for at most so much later
        writer_ = owner_->publisher->create_datawriter(topic, qos, this);
    });
    if (writer_ == nullptr) {
        owner_->release(topic_);
        throw std::runtime_error("Fast DDS made no writer of '" + t.name + "'; its own message says why");
    }
    owner_->watch(t, true, gate_);
}

WriterImpl::~WriterImpl() {
    owner_->forget(gate_);
    gate_->close();
    owner_->publisher->delete_datawriter(writer_);
    owner_->release(topic_);
}

ReaderImpl::ReaderImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType& t, const Quality& q, Listener* l)
    : owner_(std::move(owner)), topic_(t.name), gate_(std::make_shared<Gate>(l)) {
    fd::Topic* topic = owner_->acquire(t);
    sample_.in.reserve(t.largest);
    OrdinaryThread::run([&] {
        fd::DataReaderQos qos = fd::DATAREADER_QOS_DEFAULT;
        if (!owner_->settings().profile.empty()) owner_->subscriber->get_datareader_qos_from_profile(t.name, qos);
        common(qos, q);
        reader_ = owner_->subscriber->create_datareader(topic, qos, this);
    });
    if (reader_ == nullptr) {
        owner_->release(topic_);
        throw std::runtime_error("Fast DDS made no reader of '" + t.name + "'; its own message says why");
    }
    owner_->watch(t, false, gate_);
}

ReaderImpl::~ReaderImpl() {
    owner_->forget(gate_);
    gate_->close();
    owner_->subscriber->delete_datareader(reader_);
    owner_->release(topic_);
}

}  // namespace

std::shared_ptr<Participant> open(const Settings& s) {
    static std::mutex&                                  mutex = *new std::mutex;  // never destroyed, see pump.cpp
    static std::vector<std::weak_ptr<ParticipantImpl>>& all = *new std::vector<std::weak_ptr<ParticipantImpl>>;
    const std::lock_guard                               lock(mutex);
    prepare_library();
    std::erase_if(all, [](const auto& w) { return w.expired(); });
    const auto same = [&s](const Settings& x) {
        Settings wanted = s;
        wanted.name = x.name;
        return wanted == x;
    };
    for (const auto& w : all)
        if (auto p = w.lock(); p && same(p->settings())) return p;
    auto p = std::make_shared<ParticipantImpl>(s);
    all.push_back(p);
    return p;
}

}  // namespace hal::dds
