// A peer on Fast DDS for the tests: it decodes every message into the class that `fastddsgen` made of
// the definition, and encodes it again from that object. `README.md` above says what the modes do.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/core/condition/GuardCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

// What the generator wrote, in one translation unit: that builds in a third of the time.
#include "messages.cxx"
#include "messagesPubSubTypes.cxx"

using namespace eprosima::fastdds::dds;
using namespace std::chrono_literals;

namespace {

struct MessageType {
    std::string name;
    TypeSupport support;
};

// One line for each type, generated with the IDL.
const std::vector<MessageType>& types() {
    static const std::vector<MessageType> types = {
#define MESSAGE(package, name) \
    {#package "/msg/" #name, TypeSupport(new package::msg::dds_::name##_PubSubType())},
#include "messages.def"
#undef MESSAGE
    };
    return types;
}

// Samples that a volatile endpoint keeps; a latched one keeps the last.
constexpr int depth = 10;
// What the sockets are asked to buffer: at the kernel's default of 208 KiB a depth image is lost.
constexpr uint32_t socket_buffer_bytes = 32u << 20;
// Between two looks at who has matched.
constexpr auto look_period = 10ms;

[[noreturn]] void fail(const std::string& what) {
    std::cerr << "fastdds peer: " << what << std::endl;
    std::_Exit(2);
}

void tell(const std::string& line) { std::cout << line << std::endl; }

template <typename Entity>
Entity* made(Entity* entity, const std::string& what) {
    if (entity == nullptr) fail("could not make " + what);
    return entity;
}

struct Profile {
    bool reliable;
    bool latched;

    template <typename Qos>
    Qos over(Qos qos) const {
        qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
        qos.durability().kind = latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
        qos.history().kind = KEEP_LAST_HISTORY_QOS;
        qos.history().depth = latched ? 1 : depth;
        // Messages have no largest size; without this they are cut to the generator's guess.
        qos.endpoint().history_memory_policy =
            eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        return qos;
    }
};

Profile profile(const std::string& reliability, const std::string& durability) {
    return {reliability == "reliable", durability == "transient_local"};
}

class Peer {
public:
    explicit Peer(int domain) {
        DomainParticipantQos qos;
        qos.transport().listen_socket_buffer_size = socket_buffer_bytes;
        qos.transport().send_socket_buffer_size = socket_buffer_bytes;
        participant = made(
            DomainParticipantFactory::get_instance()->create_participant(domain, qos), "the participant");
        publisher = made(participant->create_publisher(PUBLISHER_QOS_DEFAULT), "the publisher");
        subscriber = made(participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT), "the subscriber");
        for (const MessageType& type : types()) participant->register_type(type.support);
    }

    ~Peer() {
        participant->delete_contained_entities();
        DomainParticipantFactory::get_instance()->delete_participant(participant);
    }

    DataWriter* writer(const std::string& ros_name, const TypeSupport& type, Profile profile) {
        return made(
            publisher->create_datawriter(
                topic(ros_name, type), profile.over(DATAWRITER_QOS_DEFAULT)),
            ros_name);
    }

    DataReader* reader(const std::string& ros_name, const TypeSupport& type, Profile profile) {
        return made(
            subscriber->create_datareader(
                topic(ros_name, type), profile.over(DATAREADER_QOS_DEFAULT)),
            ros_name);
    }

private:
    Topic* topic(const std::string& ros_name, const TypeSupport& type) {
        return made(
            participant->create_topic("rt" + ros_name, type.get_type_name(), TOPIC_QOS_DEFAULT),
            ros_name);
    }

    DomainParticipant* participant;
    Publisher* publisher;
    Subscriber* subscriber;
};

// The test closes standard input to end the peer, and so does a test that dies. A line before that
// says go.
class StandardInput {
public:
    StandardInput() {
        std::thread([this] {
            std::string line;
            while (std::getline(std::cin, line)) go = true;
            ended = true;
            end.set_trigger_value(true);
        }).detach();
    }

    std::atomic<bool> go{false};
    std::atomic<bool> ended{false};
    GuardCondition end;
};

StandardInput& standard_input() {
    static auto* input = new StandardInput();  // Its thread may outlive main.
    return *input;
}

bool has_readers(DataWriter* writer) {
    PublicationMatchedStatus status;
    return writer->get_publication_matched_status(status) == ReturnCode_t::RETCODE_OK &&
           status.current_count > 0;
}

bool has_writers(DataReader* reader) {
    SubscriptionMatchedStatus status;
    return reader->get_subscription_matched_status(status) == ReturnCode_t::RETCODE_OK &&
           status.current_count > 0;
}

// Every message on NAMESPACE/there/TYPE is written to NAMESPACE/back/TYPE.
void echo(Peer& peer, const std::string& ros_namespace, Profile profile) {
    struct Route {
        const MessageType* type;
        DataReader* reader;
        DataWriter* writer;
        void* sample;
        bool matched;
    };
    std::vector<Route> routes;
    WaitSet waitset;
    waitset.attach_condition(standard_input().end);
    for (const MessageType& type : types()) {
        DataReader* reader = peer.reader(ros_namespace + "/there/" + type.name, type.support, profile);
        DataWriter* writer = peer.writer(ros_namespace + "/back/" + type.name, type.support, profile);
        reader->get_statuscondition().set_enabled_statuses(StatusMask::data_available());
        waitset.attach_condition(reader->get_statuscondition());
        routes.push_back({&type, reader, writer, type.support->createData(), false});
    }
    tell("ready");
    while (!standard_input().ended) {
        ConditionSeq active;
        waitset.wait(active, eprosima::fastrtps::Duration_t(0, 10'000'000));
        for (Route& route : routes) {
            SampleInfo info;
            while (route.reader->take_next_sample(route.sample, &info) == ReturnCode_t::RETCODE_OK) {
                if (info.valid_data && !route.writer->write(route.sample))
                    std::cerr << route.type->name << ": not written" << std::endl;
            }
            if (!route.matched && has_writers(route.reader) && has_readers(route.writer)) {
                route.matched = true;
                tell("matched " + route.type->name);
            }
        }
    }
}

// Offers a topic, and sends a message of zeros on it ten times a second.
void offer(Peer& peer, const std::string& topic, const std::string& type_name, Profile profile) {
    for (const MessageType& type : types()) {
        if (type.name != type_name) continue;
        DataWriter* writer = peer.writer(topic, type.support, profile);
        void* sample = type.support->createData();
        tell("ready");
        while (!standard_input().ended) {
            writer->write(sample);
            std::this_thread::sleep_for(100ms);
        }
        return;
    }
    fail("no such type: " + type_name);
}

builtin_interfaces::msg::dds_::Time_ now() {
    const auto nanoseconds = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                 std::chrono::system_clock::now().time_since_epoch())
                                 .count();
    builtin_interfaces::msg::dds_::Time_ stamp;
    stamp.sec(static_cast<int32_t>(nanoseconds / 1'000'000'000));
    stamp.nanosec(static_cast<uint32_t>(nanoseconds % 1'000'000'000));
    return stamp;
}

sensor_msgs::msg::dds_::Image_ depth_image() {
    sensor_msgs::msg::dds_::Image_ image;
    image.header().frame_id("camera_depth_optical_frame");
    image.height(480);
    image.width(640);
    image.encoding("16UC1");
    image.step(640 * 2);
    std::vector<uint8_t> pixels(640 * 480 * 2);
    for (size_t at = 0; at < pixels.size(); at += 2) {  // 1.0 to 1.255 m, in mm
        const auto millimetres = static_cast<uint16_t>(1000 + at / 2 % 256);
        pixels[at] = static_cast<uint8_t>(millimetres);
        pixels[at + 1] = static_cast<uint8_t>(millimetres >> 8);
    }
    image.data(std::move(pixels));
    return image;
}

sensor_msgs::msg::dds_::CameraInfo_ camera_info() {
    sensor_msgs::msg::dds_::CameraInfo_ info;
    info.header().frame_id("camera_depth_optical_frame");
    info.height(480);
    info.width(640);
    info.distortion_model("plumb_bob");
    info.d(std::vector<double>(5));
    info.k({525, 0, 319.5, 0, 525, 239.5, 0, 0, 1});
    info.r({1, 0, 0, 0, 1, 0, 0, 0, 1});
    info.p({525, 0, 319.5, 0, 0, 525, 239.5, 0, 0, 0, 1, 0});
    return info;
}

sensor_msgs::msg::dds_::LaserScan_ laser_scan() {
    constexpr float pi = 3.14159265f;
    constexpr int beams = 720;
    sensor_msgs::msg::dds_::LaserScan_ scan;
    scan.header().frame_id("laser");
    scan.angle_min(-pi);
    scan.angle_max(pi);
    scan.angle_increment(2 * pi / (beams - 1));
    scan.scan_time(1.0f / 7);
    scan.range_min(0.15f);
    scan.range_max(12.0f);
    for (int beam = 0; beam < beams; beam++) scan.ranges().push_back(1.0f + 0.001f * beam);
    return scan;
}

// A depth camera at 30 Hz and a scanner at 7 Hz, each stamped as it is sent.
void drive(Peer& peer, const std::string& ros_namespace, double seconds, Profile profile) {
    auto image = depth_image();
    auto info = camera_info();
    auto scan = laser_scan();
    struct Stream {
        std::string topic;
        TypeSupport type;
        void* sample;
        builtin_interfaces::msg::dds_::Time_* stamp;
        double hz;
        DataWriter* writer = nullptr;
        long sent = 0;
    };
    using namespace sensor_msgs::msg::dds_;
    Stream streams[] = {
        {"/depth/image", TypeSupport(new Image_PubSubType()), &image, &image.header().stamp(), 30},
        {"/depth/camera_info", TypeSupport(new CameraInfo_PubSubType()), &info, &info.header().stamp(), 30},
        {"/scan", TypeSupport(new LaserScan_PubSubType()), &scan, &scan.header().stamp(), 7},
    };
    for (Stream& stream : streams)
        stream.writer = peer.writer(ros_namespace + stream.topic, stream.type, profile);
    tell("ready");
    for (Stream& stream : streams)
        while (!has_readers(stream.writer) && !standard_input().ended)
            std::this_thread::sleep_for(look_period);
    tell("matched");
    while (!standard_input().go && !standard_input().ended) std::this_thread::sleep_for(look_period);

    const auto start = std::chrono::steady_clock::now();
    const auto length = std::chrono::duration<double>(seconds);
    const auto due = [&](const Stream& stream) {
        return std::chrono::duration<double>(stream.sent / stream.hz);
    };
    while (!standard_input().ended) {
        Stream& next = *std::min_element(
            std::begin(streams), std::end(streams),
            [&](const Stream& a, const Stream& b) { return due(a) < due(b); });
        if (due(next) >= length) break;
        std::this_thread::sleep_until(start + due(next));
        *next.stamp = now();
        next.writer->write(next.sample);
        next.sent++;
    }
    tell("sent " + std::to_string(streams[0].sent) + " " + std::to_string(streams[1].sent) + " " +
         std::to_string(streams[2].sent));
    while (!standard_input().ended) std::this_thread::sleep_for(look_period);
}

}  // namespace

int main(int count, char** words) {
    const std::vector<std::string> arguments(words + 1, words + count);
    if (arguments.size() < 2) fail("usage: peer echo|offer|drive DOMAIN ...");
    const std::string& mode = arguments[0];
    Peer peer(std::atoi(arguments[1].c_str()));
    standard_input();
    if (mode == "echo" && arguments.size() == 5)
        echo(peer, arguments[2], profile(arguments[3], arguments[4]));
    else if (mode == "offer" && arguments.size() == 6)
        offer(peer, arguments[2], arguments[3], profile(arguments[4], arguments[5]));
    else if (mode == "drive" && arguments.size() == 5)
        drive(peer, arguments[2], std::atof(arguments[3].c_str()), profile(arguments[4], "volatile"));
    else
        fail("wrong arguments for " + mode);
}
