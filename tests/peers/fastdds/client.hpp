// A client of a ROS 2 service on Fast DDS, as `rmw_fastrtps` makes one: a request carries the identity of
// the reader that waits for the response, and a response the identity of the request.

#pragma once

#include <chrono>
#include <cstdint>
#include <iostream>
#include <string>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

// The test gives up sooner.
constexpr auto patience = std::chrono::seconds(180);
constexpr auto look_period = std::chrono::milliseconds(5);

[[noreturn]] inline void fail(const std::string& what) {
    std::cerr << "fastdds client: " << what << std::endl;
    std::_Exit(2);
}

template <typename Entity>
Entity* made(Entity* entity, const char* what) {
    if (entity == nullptr) fail(std::string("could not make ") + what);
    return entity;
}

template <typename Qos>
Qos of_a_service(Qos qos) {
    qos.reliability().kind = eprosima::fastdds::dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = eprosima::fastdds::dds::VOLATILE_DURABILITY_QOS;
    qos.history().kind = eprosima::fastdds::dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return qos;
}

// Looks again and again until it holds.
template <typename Holds>
void wait_until(const char* what, Holds holds) {
    const auto until = std::chrono::steady_clock::now() + patience;
    while (!holds()) {
        if (std::chrono::steady_clock::now() > until) fail(std::string("waited in vain for ") + what);
        std::this_thread::sleep_for(look_period);
    }
}

inline eprosima::fastdds::dds::DomainParticipant* participant_in(const char* domain) {
    using namespace eprosima::fastdds::dds;
    DomainParticipantFactory* factory = DomainParticipantFactory::get_instance();
    return made(
        factory->create_participant(std::stoi(domain), PARTICIPANT_QOS_DEFAULT), "the participant");
}

// The topics of a service.
struct Service {
    Service(eprosima::fastdds::dds::DomainParticipant* participant, const std::string& name,
            eprosima::fastdds::dds::TypeSupport request, eprosima::fastdds::dds::TypeSupport response)
        : participant(participant) {
        using eprosima::fastdds::dds::TOPIC_QOS_DEFAULT;
        participant->register_type(request);
        participant->register_type(response);
        requests = made(
            participant->create_topic("rq" + name + "Request", request.get_type_name(), TOPIC_QOS_DEFAULT),
            "the requests' topic");
        responses = made(
            participant->create_topic("rr" + name + "Reply", response.get_type_name(), TOPIC_QOS_DEFAULT),
            "the responses' topic");
    }

    eprosima::fastdds::dds::DomainParticipant* participant;
    eprosima::fastdds::dds::Topic* requests;
    eprosima::fastdds::dds::Topic* responses;
};

template <typename Request, typename Response>
class Client {
public:
    explicit Client(const Service& service) {
        using namespace eprosima::fastdds::dds;
        Publisher* publisher =
            made(service.participant->create_publisher(PUBLISHER_QOS_DEFAULT), "a publisher");
        Subscriber* subscriber =
            made(service.participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT), "a subscriber");
        reader = made(
            subscriber->create_datareader(service.responses, of_a_service(DATAREADER_QOS_DEFAULT)),
            "a reader");
        writer = made(
            publisher->create_datawriter(service.requests, of_a_service(DATAWRITER_QOS_DEFAULT)),
            "a writer");
    }

    bool has_matched() const {
        eprosima::fastdds::dds::PublicationMatchedStatus publication;
        eprosima::fastdds::dds::SubscriptionMatchedStatus subscription;
        writer->get_publication_matched_status(publication);
        reader->get_subscription_matched_status(subscription);
        return publication.current_count > 0 && subscription.current_count > 0;
    }

    void ask(Request request) {
        eprosima::fastrtps::rtps::WriteParams params;
        params.related_sample_identity().writer_guid() = reader->guid();
        if (!writer->write(&request, params)) fail("could not ask");
        asked = params.sample_identity().sequence_number();
    }

    // Whether the response to what was asked last has come.
    bool take(Response& response) {
        eprosima::fastdds::dds::SampleInfo info;
        while (reader->take_next_sample(&response, &info) ==
               eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
            const auto& request = info.related_sample_identity;
            bool ours = request.writer_guid() == reader->guid() || request.writer_guid() == writer->guid();
            if (info.valid_data && ours && request.sequence_number() == asked) return true;
        }
        return false;
    }

private:
    eprosima::fastdds::dds::DataReader* reader;
    eprosima::fastdds::dds::DataWriter* writer;
    eprosima::fastrtps::rtps::SequenceNumber_t asked;
};
