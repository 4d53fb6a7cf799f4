// One call of a service on Fast DDS, made the moment discovery shows the service. The request comes and the response goes
// as the hexadecimal digits of its encoding, so that it is a client of any service. `README.md` above says what it does.

#include "client.hpp"

#include <cstring>
#include <functional>
#include <vector>

using Bytes = std::vector<unsigned char>;

namespace {

// A message that is encoded already, with its encapsulation header.
class Encoded : public eprosima::fastdds::dds::TopicDataType {
public:
    explicit Encoded(const std::string& name) {
        setName(name.c_str());
        m_isGetKeyDefined = false;
        // What is reserved at first; larger ones take what they need.
        m_typeSize = 1024;
    }

    bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
        const Bytes& bytes = *static_cast<Bytes*>(data);
        if (bytes.size() > payload->max_size) return false;
        std::memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = static_cast<uint32_t>(bytes.size());
        payload->encapsulation = CDR_LE;
        return true;
    }

    bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }

    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
    }

    void* createData() override { return new Bytes(); }

    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }

    bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

// The type's name on the wire: `package::srv::dds_::Name_Request_` of `package/srv/Name`.
std::string part_of(const std::string& service, const char* part) {
    const auto package = service.find('/'), name = service.rfind('/');
    if (package == name) fail("a type is named as package/srv/Name");
    return service.substr(0, package) + "::srv::dds_::" + service.substr(name + 1) + part;
}

Bytes bytes_of(const std::string& digits) {
    Bytes bytes;
    for (size_t at = 0; at + 1 < digits.size(); at += 2)
        bytes.push_back(static_cast<unsigned char>(std::stoi(digits.substr(at, 2), nullptr, 16)));
    return bytes;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 4) fail("usage: once DOMAIN SERVICE TYPE, and the request's digits on standard input");
    std::string digits;
    std::getline(std::cin, digits);
    auto* participant = participant_in(argv[1]);
    const Service service(participant, argv[2],
        eprosima::fastdds::dds::TypeSupport(new Encoded(part_of(argv[3], "_Request_"))),
        eprosima::fastdds::dds::TypeSupport(new Encoded(part_of(argv[3], "_Response_"))));
    Client<Bytes, Bytes> client(service);
    wait_until("the service", [&] { return client.has_matched(); });
    client.ask(bytes_of(digits));
    Bytes response;
    wait_until("the answer", [&] { return client.take(response); });
    std::string answer;
    for (unsigned char byte : response) {
        const char* hexadecimal = "0123456789abcdef";
        answer += {hexadecimal[byte >> 4], hexadecimal[byte & 15]};
    }
    std::cout << answer << std::endl;
    participant->delete_contained_entities();
    eprosima::fastdds::dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
}
