// Two clients of a `std_srvs/srv/SetBool` service on Fast DDS. `README.md` above says what they do.

#include "client.hpp"
#include "set_bool.cxx"
#include "set_boolPubSubTypes.cxx"

using std_srvs::srv::dds_::SetBool_Request_;
using std_srvs::srv::dds_::SetBool_Request_PubSubType;
using std_srvs::srv::dds_::SetBool_Response_;
using std_srvs::srv::dds_::SetBool_Response_PubSubType;

int main(int argc, char** argv) {
    if (argc != 4) fail("usage: ask DOMAIN SERVICE TIMES");
    auto* participant = participant_in(argv[1]);
    const Service service(participant, argv[2],
        eprosima::fastdds::dds::TypeSupport(new SetBool_Request_PubSubType()),
        eprosima::fastdds::dds::TypeSupport(new SetBool_Response_PubSubType()));

    using SetBoolClient = Client<SetBool_Request_, SetBool_Response_>;
    SetBoolClient clients[] = {SetBoolClient(service), SetBoolClient(service)};
    for (const auto& client : clients)
        wait_until("the service", [&] { return client.has_matched(); });
    for (int time = 0; time < std::stoi(argv[3]); ++time) {
        // Both before the first answer, so that each must tell its own.
        for (int number : {0, 1}) {
            SetBool_Request_ request;
            request.data(number == 1);
            clients[number].ask(request);
        }
        for (int number : {0, 1}) {
            SetBool_Response_ response;
            wait_until("an answer", [&] { return clients[number].take(response); });
            std::cout << "answer " << number << " " << (response.success() ? "true" : "false")
                      << " " << response.message() << std::endl;
        }
    }
    participant->delete_contained_entities();
    eprosima::fastdds::dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
}
