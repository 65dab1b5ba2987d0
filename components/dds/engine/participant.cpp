// SPDX-License-Identifier: MIT
// Participants, writers and readers on Fast DDS 2.9. A sample is bytes here: the types have names and no fields.
#include "participant.hpp"

#include <time.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
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

#include "dds/engine.hpp"
#include "dds/words.hpp"
#include "ordinary_thread.hpp"
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

/// What writers and readers have in common: their participant makes them, and again when it is made again itself.
class Endpoint {
public:
    Endpoint(std::shared_ptr<ParticipantImpl> owner, const TopicType& t, const Quality& q, Listener* l)
        : topic(t), quality(q), gate(std::make_shared<Gate>(l)), owner_(std::move(owner)) {}
    Endpoint(const Endpoint&) = delete;

    virtual const char* kind() const noexcept = 0;  ///< "writer", "reader"
    virtual bool        make(fd::Topic*) = 0;  ///< false: Fast DDS refused
    virtual void        unmake() noexcept = 0;  ///< also when it is not made

    const TopicType             topic;
    const Quality               quality;
    const std::shared_ptr<Gate> gate;

protected:
    ~Endpoint() = default;
    void count_matched(int count, int change) {
        matched_.store(count, std::memory_order_relaxed);
        gate->event(change > 0 ? Event::matched : Event::unmatched, count);
    }
    std::shared_ptr<ParticipantImpl> owner_;
    std::atomic<int>                 matched_{0};
};

class WriterImpl final : public Writer, private Endpoint, private fd::DataWriterListener {
public:
    WriterImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType&, const Quality&, Listener*);
    ~WriterImpl() override;
    bool write(std::span<const std::uint8_t> bytes, std::int64_t source_ns) noexcept override {
        if (writer_ == nullptr) return false;
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
        return writer_ != nullptr && writer_->wait_for_acknowledgments(duration(timeout_ns)) == ReturnCode_t::RETCODE_OK;
    }

private:
    const char* kind() const noexcept override { return "writer"; }
    bool        make(fd::Topic*) override;
    void        unmake() noexcept override;
    void        on_publication_matched(fd::DataWriter*, const fd::PublicationMatchedStatus& s) override {
        count_matched(s.current_count, s.current_count_change);
    }
    void on_offered_deadline_missed(fd::DataWriter*, const fd::OfferedDeadlineMissedStatus& s) override {
        gate->event(Event::deadline_missed, static_cast<int>(s.total_count));
    }
    void on_offered_incompatible_qos(fd::DataWriter*, const fd::OfferedIncompatibleQosStatus& s) override {
        gate->event(Event::wrong_quality, static_cast<int>(s.total_count), policy_name(s.last_policy_id));
    }
    fd::DataWriter* writer_ = nullptr;  // of the thread that writes; the DDS thread, which is that one, makes it anew
};

class ReaderImpl final : public Reader, private Endpoint, private fd::DataReaderListener {
public:
    ReaderImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType&, const Quality&, Listener*);
    ~ReaderImpl() override;
    int matched() const noexcept override { return matched_.load(std::memory_order_relaxed); }

private:
    const char* kind() const noexcept override { return "reader"; }
    bool        make(fd::Topic*) override;
    void        unmake() noexcept override;
    void        on_data_available(fd::DataReader* reader) override {
        gate->with([&](Listener& listener) {
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
        count_matched(s.current_count, s.current_count_change);
    }
    void on_requested_deadline_missed(fd::DataReader*, const fd::RequestedDeadlineMissedStatus& s) override {
        gate->event(Event::deadline_missed, static_cast<int>(s.total_count));
    }
    void on_requested_incompatible_qos(fd::DataReader*, const fd::RequestedIncompatibleQosStatus& s) override {
        gate->event(Event::wrong_quality, static_cast<int>(s.total_count), policy_name(s.last_policy_id));
    }
    void on_liveliness_changed(fd::DataReader*, const fd::LivelinessChangedStatus& s) override {
        gate->event(s.alive_count_change > 0 ? Event::alive : Event::not_alive, s.alive_count);
    }
    Bytes           sample_;  // under the gate's lock
    fd::DataReader* reader_ = nullptr;
};

class ParticipantImpl final : public Participant,
                              public std::enable_shared_from_this<ParticipantImpl>,
                              private fd::DomainParticipantListener {
public:
    explicit ParticipantImpl(const Settings& s) : settings_(s) { make(); }
    ~ParticipantImpl() override { unmake(); }
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

    /// Makes a writer or reader, and from now on tells it when somebody has its topic with another type. [setup]
    void join(Endpoint& e, bool writes) {
        const std::lock_guard lock(setup_);
        if (participant_ == nullptr) throw std::runtime_error("DDS could not begin anew so far; its own message says why");
        fd::Topic* const topic = acquire(e.topic);
        bool             made = false;
        try {
            OrdinaryThread::run([&] { made = e.make(topic); });
            if (!made)
                throw std::runtime_error(std::string("Fast DDS made no ") + e.kind() + " of '" + e.topic.name +
                                         "'; its own message says why");
            endpoints_.push_back(&e);
        } catch (...) {
            e.unmake();
            release(e.topic.name);
            throw;
        }
        const std::lock_guard of_remote(mutex_);
        watched_.push_back({e.topic.name, e.topic.type, writes, e.gate});
        for (const auto& [guid, r] : remote_) compare(watched_.back(), r);
    }
    /// Its listener is not called any more when this returns. [setup]
    void leave(Endpoint& e) {
        {
            const std::lock_guard lock(mutex_);
            std::erase_if(watched_, [&e](const Watched& w) { return w.gate == e.gate; });
        }
        e.gate->close();
        const std::lock_guard lock(setup_);
        e.unmake();
        std::erase(endpoints_, &e);
        release(e.topic.name);
    }
    /// All of it under a new identity. False: it did not go, and nothing is there; to be tried again. [the DDS thread]
    bool renew() noexcept {
        const std::lock_guard lock(setup_);
        try {
            unmake();
            make();
            for (auto& [name, t] : topics_) t.topic = topic_of(name, t.type);
            OrdinaryThread::run([this] {
                for (Endpoint* e : endpoints_)
                    if (!e->make(topics_.at(e->topic.name).topic))
                        throw std::runtime_error("no " + std::string(e->kind()) + " of '" + e->topic.name + "'");
            });
            complained_ = false;
            return true;
        } catch (const std::exception& why) {
            if (!complained_)
                std::fputs((std::string("dds: it cannot begin anew: ") + why.what() + "; it is tried again every second\n").c_str(),
                           stderr);
            complained_ = true;
            unmake();
            return false;
        }
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
    struct Used {
        fd::Topic*  topic = nullptr;
        std::string type;
        int         users = 0;
    };

    void make() {
        OrdinaryThread::run([this] {
            const fd::DomainParticipantQos qos = participant_qos(settings_);
            participant_ = fd::DomainParticipantFactory::get_instance()->create_participant(static_cast<std::uint32_t>(settings_.domain),
                                                                                            qos, this, fd::StatusMask::none());
            if (participant_ == nullptr)
                throw std::runtime_error(settings_.security.empty()
                                             ? "Fast DDS made no participant; its own message says why"
                                             : "Fast DDS refuses the files in " + settings_.security + "; its own message says which");
            publisher = participant_->create_publisher(fd::PUBLISHER_QOS_DEFAULT);
            subscriber = participant_->create_subscriber(fd::SUBSCRIBER_QOS_DEFAULT);
        });
    }
    void unmake() noexcept {
        if (participant_ == nullptr) return;
        for (Endpoint* e : endpoints_) e->unmake();
        participant_->set_listener(nullptr);
        participant_->delete_contained_entities();
        fd::DomainParticipantFactory::get_instance()->delete_participant(participant_);
        participant_ = nullptr;
        for (auto& [name, t] : topics_) t.topic = nullptr;
        const std::lock_guard lock(mutex_);
        remote_.clear();
        known_.clear();
    }
    fd::Topic* topic_of(const std::string& name, const std::string& type) {
        types_.at(type).register_type(participant_, type);
        fd::Topic* const topic = participant_->create_topic(name, type, fd::TOPIC_QOS_DEFAULT);
        if (topic == nullptr) throw std::runtime_error("Fast DDS made no topic '" + name + "'; its own message says why");
        return topic;
    }
    /// The topic, of this type; told apart by name. Give it back with release(). Both with `setup_`.
    fd::Topic* acquire(const TopicType& t) {
        auto& type = types_[t.type];
        if (type.empty()) type.reset(new BytesType(t.type, t.largest));
        static_cast<BytesType*>(type.get())->grow(t.largest);
        if (const auto known = topics_.find(t.name); known != topics_.end() && known->second.type != t.type)
            throw std::runtime_error("topic '" + t.name + "' has the type " + known->second.type + " in this process already, and here " +
                                     t.type + "; give both the same fields, or another topic=");
        Used& used = topics_[t.name];
        if (used.users == 0) {
            used.type = t.type;
            try {
                used.topic = topic_of(t.name, t.type);
            } catch (...) {
                topics_.erase(t.name);
                throw;
            }
        }
        ++used.users;
        return used.topic;
    }
    void release(const std::string& name) {
        const auto at = topics_.find(name);
        if (at == topics_.end() || --at->second.users > 0) return;
        if (participant_ != nullptr) participant_->delete_topic(at->second.topic);
        topics_.erase(at);
    }
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

    const Settings                         settings_;
    mutable std::mutex                     mutex_;  // of these; nothing of Fast DDS is called under it
    std::vector<Watched>                   watched_;
    std::map<rtps::GUID_t, Remote>         remote_;
    std::map<rtps::GuidPrefix_t, Known>    known_;
    std::mutex                             setup_;  // of these; not taken by callbacks
    fd::DomainParticipant*                 participant_ = nullptr;
    std::map<std::string, fd::TypeSupport> types_;
    std::map<std::string, Used>            topics_;
    std::vector<Endpoint*>                 endpoints_;
    bool                                   complained_ = false;
};

WriterImpl::WriterImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType& t, const Quality& q, Listener* l)
    : Endpoint(std::move(owner), t, q, l) {
    owner_->join(*this, true);
}

WriterImpl::~WriterImpl() { owner_->leave(*this); }

bool WriterImpl::make(fd::Topic* to) {
    fd::DataWriterQos qos = fd::DATAWRITER_QOS_DEFAULT;
    if (!owner_->settings().profile.empty()) owner_->publisher->get_datawriter_qos_from_profile(topic.name, qos);
    common(qos, quality);
    if (quality.lease_ns > 0) qos.liveliness().announcement_period = duration(std::max<std::int64_t>(quality.lease_ns / 3, 1'000'000));
    qos.reliable_writer_qos().times.heartbeatPeriod = duration(100'000'000);  // a lost sample is asked for at most so much later
    writer_ = owner_->publisher->create_datawriter(to, qos, this);
    return writer_ != nullptr;
}

void WriterImpl::unmake() noexcept {
    if (writer_ == nullptr) return;
    owner_->publisher->delete_datawriter(writer_);
    writer_ = nullptr;
    count_matched(0, -1);
}

ReaderImpl::ReaderImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType& t, const Quality& q, Listener* l)
    : Endpoint(std::move(owner), t, q, l) {
    sample_.in.reserve(t.largest);
    owner_->join(*this, false);
}

ReaderImpl::~ReaderImpl() { owner_->leave(*this); }

bool ReaderImpl::make(fd::Topic* from) {
    fd::DataReaderQos qos = fd::DATAREADER_QOS_DEFAULT;
    if (!owner_->settings().profile.empty()) owner_->subscriber->get_datareader_qos_from_profile(topic.name, qos);
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

/// All that are open. Never destroyed, see pump.cpp.
struct Participants {
    std::mutex                                  mutex;
    std::vector<std::weak_ptr<ParticipantImpl>> all;
};
Participants& participants() {
    static Participants& one = *new Participants;
    return one;
}

}  // namespace

std::shared_ptr<Participant> open(const Settings& s) {
    Participants&         known = participants();
    const std::lock_guard lock(known.mutex);
    prepare_library();
    std::erase_if(known.all, [](const auto& w) { return w.expired(); });
    const auto same = [&s](const Settings& x) {
        Settings wanted = s;
        wanted.name = x.name;
        return wanted == x;
    };
    for (const auto& w : known.all)
        if (auto p = w.lock(); p && same(p->settings())) return p;
    auto p = std::make_shared<ParticipantImpl>(s);
    known.all.push_back(p);
    return p;
}

bool announce_anew() noexcept {
    std::vector<std::shared_ptr<ParticipantImpl>> all;  // destroyed without the lock
    {
        const std::lock_guard lock(participants().mutex);
        for (const auto& w : participants().all)
            if (auto p = w.lock()) all.push_back(std::move(p));
    }
    bool good = true;
    for (const auto& p : all) good = p->renew() && good;
    return good;
}

}  // namespace hal::dds
