// SPDX-License-Identifier: MIT
// A participant on Fast DDS 2.9: its topics, its endpoints, the other participants. Included by the
// engine only.
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <functional>
#include <map>
#include <stdexcept>

#include "dds/status_text.hpp"
#include "endpoint.hpp"
#include "ordinary_thread.hpp"
#include "settings.hpp"

namespace hal::dds::engine {

namespace rtps = eprosima::fastrtps::rtps;

/// A type with a name and no fields.
class BytesType : public fd::TopicDataType {
public:
    BytesType(const std::string& name, std::size_t max) {
        setName(name.c_str());
        m_typeSize = static_cast<std::uint32_t>(max);
        m_isGetKeyDefined = false;
        // Cyclone DDS rejects endpoints that announce these parameters as 2.9 does
        auto_fill_type_object(false);
        auto_fill_type_information(false);
    }
    void grow(std::size_t max) {
        m_typeSize = std::max(m_typeSize, static_cast<std::uint32_t>(max));
    }

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
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
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
        std::vector<Known> all;
        all.reserve(known_.size());
        for (const auto& [prefix, k] : known_) {
            all.push_back(k);
        }
        return all;
    }
    const Settings& settings() const noexcept override { return settings_; }

    /// Creates a writer or reader, and reports participants that use its topic with another type to
    /// it from now on. [setup]
    void join(Endpoint& e, bool writes) {
        const std::lock_guard lock(setup_);
        if (participant_ == nullptr) {
            throw std::runtime_error("DDS is not announced again yet; see the message of Fast DDS");
        }
        fd::Topic* const topic = acquire(e.topic);
        bool made = false;
        try {
            OrdinaryThread::run([&] { made = e.make(topic); });
            if (!made) {
                throw std::runtime_error(std::string("Fast DDS created no ") + e.kind() + " for '" +
                                         e.topic.name + "'; see its message");
            }
            endpoints_.push_back(&e);
        } catch (...) {
            e.unmake();
            release(e.topic.name);
            throw;
        }
        const std::lock_guard of_remote(mutex_);
        watched_.push_back({e.topic.name, e.topic.type, writes, e.gate});
        for (const auto& [guid, r] : remote_) {
            compare(watched_.back(), r);
        }
    }
    /// Deletes a writer or reader. Its listener is not called after this returns. [setup]
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
    /// Re-creates everything under a new identity. Returns false when that failed: then nothing
    /// exists until it is repeated. [the DDS thread]
    bool renew() noexcept {
        const std::lock_guard lock(setup_);
        try {
            unmake();
            make();
            for (auto& [name, t] : topics_) {
                t.topic = topic_of(name, t.type);
            }
            OrdinaryThread::run([this] {
                for (Endpoint* e : endpoints_) {
                    if (!e->make(topics_.at(e->topic.name).topic)) {
                        throw std::runtime_error("no " + std::string(e->kind()) + " for '" +
                                                 e->topic.name + "'");
                    }
                }
            });
            failure_reported_ = false;
            return true;
        } catch (const std::exception& why) {
            if (!failure_reported_) {
                std::fprintf(stderr,
                             "dds: cannot announce this process again: %s; retrying every "
                             "second\n",
                             why.what());
            }
            failure_reported_ = true;
            unmake();
            return false;
        }
    }

    fd::Publisher* publisher = nullptr;
    fd::Subscriber* subscriber = nullptr;

private:
    struct Watched {
        std::string topic, type;
        bool writes;
        std::shared_ptr<ListenerGate> gate;
    };
    struct Remote {
        std::string topic, type;
        bool writes;
    };
    struct Used {
        fd::Topic* topic = nullptr;
        std::string type;
        int users = 0;
    };

    void make() {
        // set by `hal check --deterministic`, see links_inside in drivers/link/address.hpp
        if (std::getenv("HALCYON_LINKS_INSIDE") != nullptr) {
            throw std::runtime_error("DDS leads to other programs, which a check must not operate");
        }
        OrdinaryThread::run([this] {
            const fd::DomainParticipantQos qos = participant_qos(settings_);
            participant_ = fd::DomainParticipantFactory::get_instance()->create_participant(
                static_cast<std::uint32_t>(settings_.domain), qos, this, fd::StatusMask::none());
            if (participant_ == nullptr) {
                throw std::runtime_error(settings_.security.empty()
                                             ? "Fast DDS created no participant; see its message"
                                             : "Fast DDS rejected the files in " +
                                                   settings_.security + "; see its message");
            }
            publisher = participant_->create_publisher(fd::PUBLISHER_QOS_DEFAULT);
            subscriber = participant_->create_subscriber(fd::SUBSCRIBER_QOS_DEFAULT);
        });
    }
    void unmake() noexcept {
        if (participant_ == nullptr) return;
        for (Endpoint* e : endpoints_) {
            e->unmake();
        }
        participant_->set_listener(nullptr);
        participant_->delete_contained_entities();
        fd::DomainParticipantFactory::get_instance()->delete_participant(participant_);
        participant_ = nullptr;
        for (auto& [name, t] : topics_) {
            t.topic = nullptr;
        }
        const std::lock_guard lock(mutex_);
        remote_.clear();
        known_.clear();
    }
    fd::Topic* topic_of(const std::string& name, const std::string& type) {
        types_.at(type).register_type(participant_, type);
        fd::Topic* const topic = participant_->create_topic(name, type, fd::TOPIC_QOS_DEFAULT);
        if (topic == nullptr) {
            throw std::runtime_error("Fast DDS created no topic '" + name + "'; see its message");
        }
        return topic;
    }
    /// Returns the topic of this name and type; release() returns it. Both are called with `setup_`
    /// locked.
    fd::Topic* acquire(const TopicType& t) {
        auto& type = types_[t.type];
        if (type.empty()) {
            type.reset(new BytesType(t.type, t.max));
        }
        static_cast<BytesType*>(type.get())->grow(t.max);
        if (const auto known = topics_.find(t.name);
            known != topics_.end() && known->second.type != t.type) {
            throw std::runtime_error("topic '" + t.name +
                                     "' is already in use in this process with type " +
                                     known->second.type + ", not " + t.type +
                                     "; give both the same fields, or another topic=");
        }
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
        if (participant_ != nullptr) {
            participant_->delete_topic(at->second.topic);
        }
        topics_.erase(at);
    }
    static void compare(const Watched& ours, const Remote& theirs) {
        if (ours.topic != theirs.topic || ours.writes == theirs.writes ||
            ours.type == theirs.type) {
            return;
        }
        ours.gate->event(Event::wrong_type, 0,
                         "topic '" + ours.topic + "' has type " + ours.type + " here and " +
                             shown(theirs.type) + " at another " +
                             (theirs.writes ? "publisher" : "subscriber") +
                             "; no data is exchanged with it");
    }
    template <class Data>
    void endpoint(bool gone, bool writes, const Data& data) {
        const std::lock_guard lock(mutex_);
        if (gone) {
            remote_.erase(data.guid());
            return;
        }
        const Remote r{data.topicName().to_string(), data.typeName().to_string(), writes};
        if (remote_.size() < 10'000 && remote_.emplace(data.guid(), r).second) {
            for (const Watched& w : watched_) {
                compare(w, r);
            }
        }
    }
    void on_publisher_discovery(fd::DomainParticipant*, rtps::WriterDiscoveryInfo&& i) override {
        endpoint(i.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER, true, i.info);
    }
    void on_subscriber_discovery(fd::DomainParticipant*, rtps::ReaderDiscoveryInfo&& i) override {
        endpoint(i.status == rtps::ReaderDiscoveryInfo::REMOVED_READER, false, i.info);
    }
    void on_participant_discovery(fd::DomainParticipant*,
                                  rtps::ParticipantDiscoveryInfo&& i) override {
        const std::lock_guard lock(mutex_);
        const auto& prefix = i.info.m_guid.guidPrefix;
        if (i.status == rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
            i.status == rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT) {
            known_.erase(prefix);
            return;
        }
        Known k{i.info.m_participantName.to_string(), {}, {}};
        for (const rtps::octet o : i.info.m_userData) {
            k.user_data += static_cast<char>(o);
        }
        std::copy(std::begin(prefix.value), std::end(prefix.value), k.prefix.begin());
        known_[prefix] = std::move(k);
    }

    const Settings settings_;
    // guards the next three; never locked while Fast DDS is called
    mutable std::mutex mutex_;
    std::vector<Watched> watched_;
    std::map<rtps::GUID_t, Remote> remote_;
    std::map<rtps::GuidPrefix_t, Known> known_;
    // guards what follows; never locked in callbacks
    std::mutex setup_;
    fd::DomainParticipant* participant_ = nullptr;
    std::map<std::string, fd::TypeSupport> types_;
    std::map<std::string, Used> topics_;
    std::vector<Endpoint*> endpoints_;
    bool failure_reported_ = false;
};

}  // namespace hal::dds::engine
