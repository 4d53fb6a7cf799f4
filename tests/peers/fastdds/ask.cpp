// A client of a ROS 2 service on Fast DDS, as `rmw_fastrtps` makes one: a request carries the identity of
// the reader that waits for the response, and a response the identity of the request.
// `README.md` above says what it does.

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

#include "set_bool.cxx"
#include "set_boolPubSubTypes.cxx"

using namespace eprosima::fastdds::dds;
using namespace std::chrono_literals;
using eprosima::fastrtps::rtps::WriteParams;
using std_srvs::srv::dds_::SetBool_Request_;
using std_srvs::srv::dds_::SetBool_Request_PubSubType;
using std_srvs::srv::dds_::SetBool_Response_;
using std_srvs::srv::dds_::SetBool_Response_PubSubType;

namespace {

// The test gives up sooner.
constexpr auto patience = 60s;
constexpr auto look_period = 5ms;

[[noreturn]] void fail(const std::string& what) {
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
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = VOLATILE_DURABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return qos;
}

class Client {
public:
    Client(DomainParticipant* participant, Topic* requests, Topic* responses) {
        Publisher* publisher = made(participant->create_publisher(PUBLISHER_QOS_DEFAULT), "a publisher");
        Subscriber* subscriber = made(participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT), "a subscriber");
        reader = made(
            subscriber->create_datareader(responses, of_a_service(DATAREADER_QOS_DEFAULT)), "a reader");
        writer = made(
            publisher->create_datawriter(requests, of_a_service(DATAWRITER_QOS_DEFAULT)), "a writer");
    }

    bool has_matched() const {
        PublicationMatchedStatus publication;
        SubscriptionMatchedStatus subscription;
        writer->get_publication_matched_status(publication);
        reader->get_subscription_matched_status(subscription);
        return publication.current_count > 0 && subscription.current_count > 0;
    }

    void ask(bool data) {
        SetBool_Request_ request;
        request.data(data);
        WriteParams params;
        params.related_sample_identity().writer_guid() = reader->guid();
        if (!writer->write(&request, params)) fail("could not ask");
        asked = params.sample_identity().sequence_number();
    }

    // Whether the response to what was asked last has come.
    bool take(SetBool_Response_& response) {
        SampleInfo info;
        while (reader->take_next_sample(&response, &info) == ReturnCode_t::RETCODE_OK) {
            const auto& request = info.related_sample_identity;
            bool ours = request.writer_guid() == reader->guid() || request.writer_guid() == writer->guid();
            if (info.valid_data && ours && request.sequence_number() == asked) return true;
        }
        return false;
    }

private:
    DataReader* reader;
    DataWriter* writer;
    eprosima::fastrtps::rtps::SequenceNumber_t asked;
};

}  // namespace

int main(int argc, char** argv) {
    if (argc != 4) fail("usage: ask DOMAIN SERVICE TIMES");
    const std::string service = argv[2];
    DomainParticipant* participant = made(
        DomainParticipantFactory::get_instance()->create_participant(
            std::stoi(argv[1]), PARTICIPANT_QOS_DEFAULT),
        "the participant");
    TypeSupport request_type(new SetBool_Request_PubSubType());
    TypeSupport response_type(new SetBool_Response_PubSubType());
    participant->register_type(request_type);
    participant->register_type(response_type);
    Topic* requests = made(
        participant->create_topic("rq" + service + "Request", request_type.get_type_name(), TOPIC_QOS_DEFAULT),
        "the requests' topic");
    Topic* responses = made(
        participant->create_topic("rr" + service + "Reply", response_type.get_type_name(), TOPIC_QOS_DEFAULT),
        "the responses' topic");

    Client clients[] = {{participant, requests, responses}, {participant, requests, responses}};
    const auto until = std::chrono::steady_clock::now() + patience;
    const auto wait = [&] {
        if (std::chrono::steady_clock::now() > until) fail("waited in vain");
        std::this_thread::sleep_for(look_period);
    };
    for (const Client& client : clients)
        while (!client.has_matched()) wait();
    for (int time = 0; time < std::stoi(argv[3]); ++time) {
        // Both before the first answer, so that each must tell its own.
        for (int number : {0, 1}) clients[number].ask(number == 1);
        for (int number : {0, 1}) {
            SetBool_Response_ response;
            while (!clients[number].take(response)) wait();
            std::cout << "answer " << number << " " << (response.success() ? "true" : "false")
                      << " " << response.message() << std::endl;
        }
    }
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
}
