/* A peer on Cyclone DDS for the tests: it decodes every message into the struct that `idlc` made of the
 * definition, and encodes it again from that struct. `README.md` beside it says what the modes do. */

#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <dds/dds.h>

#include "messages.h"

/* One line for each type, generated with the IDL. */
typedef struct {
    const char *name;
    const dds_topic_descriptor_t *descriptor;
} message_type;

static const message_type types[] = {
#define MESSAGE(package, name) {#package "/msg/" #name, &package##_msg_dds__##name##__desc},
#include "messages.def"
#undef MESSAGE
};
enum { type_count = sizeof types / sizeof *types };

/* Samples that a volatile endpoint keeps; a latched one keeps the last. */
enum { depth = 10 };
/* Between two looks at who has matched. */
static const dds_duration_t look_period = DDS_MSECS(10);

static void fail(const char *what, const char *which)
{
    fprintf(stderr, "cyclone peer: %s: %s\n", what, which);
    exit(2);
}

static dds_entity_t made(dds_entity_t entity, const char *what)
{
    if (entity < 0)
        fail(what, dds_strretcode(entity));
    return entity;
}

static dds_entity_t leaving;

/* Says good-bye, so that the others know at once. */
static void leave(void)
{
    dds_delete(leaving);
}

static void tell(const char *word, const char *about)
{
    printf("%s%s%s\n", word, *about ? " " : "", about);
    fflush(stdout);
}

/* The test closes standard input to end the peer, and so does a test that dies. */
static void *wait_for_end(void *guard)
{
    char bytes[64];
    while (fgets(bytes, sizeof bytes, stdin) != NULL)
        dds_set_guardcondition(*(dds_entity_t *)guard, true);
    exit(0);
}

static dds_qos_t *qos_of(const char *reliability, const char *durability)
{
    const bool latched = strcmp(durability, "transient_local") == 0;
    dds_qos_t *qos = dds_create_qos();
    dds_qset_reliability(
        qos,
        strcmp(reliability, "reliable") == 0 ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
        DDS_SECS(1));
    dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, latched ? 1 : depth);
    return qos;
}

static dds_entity_t
topic_of(dds_entity_t participant, const message_type *type, const char *name)
{
    return made(dds_create_topic(participant, type->descriptor, name, NULL, NULL), name);
}

static const message_type *type_called(const char *name)
{
    for (int index = 0; index < type_count; index++)
        if (strcmp(types[index].name, name) == 0)
            return &types[index];
    fail("no such type", name);
    return NULL;
}

/* Every message on NAMESPACE/there/TYPE is written to NAMESPACE/back/TYPE. */
static void
echo(dds_entity_t participant, const char *namespace, const char *reliability, const char *durability)
{
    dds_entity_t readers[type_count], writers[type_count];
    bool matched[type_count] = {false};
    dds_entity_t waitset = made(dds_create_waitset(participant), "waitset");
    dds_qos_t *qos = qos_of(reliability, durability);
    for (int index = 0; index < type_count; index++) {
        char name[256];
        snprintf(name, sizeof name, "rt%s/there/%s", namespace, types[index].name);
        readers[index] = made(
            dds_create_reader(participant, topic_of(participant, &types[index], name), qos, NULL), name);
        snprintf(name, sizeof name, "rt%s/back/%s", namespace, types[index].name);
        writers[index] = made(
            dds_create_writer(participant, topic_of(participant, &types[index], name), qos, NULL), name);
        dds_set_status_mask(readers[index], DDS_DATA_AVAILABLE_STATUS);
        dds_waitset_attach(waitset, readers[index], index);
    }
    dds_delete_qos(qos);
    tell("ready", "");
    for (;;) {
        dds_waitset_wait(waitset, NULL, 0, look_period);
        for (int index = 0; index < type_count; index++) {
            void *samples[1] = {NULL};
            dds_sample_info_t info[1];
            while (dds_take(readers[index], samples, info, 1, 1) > 0) {
                if (info[0].valid_data) {
                    const dds_return_t written = dds_write(writers[index], samples[0]);
                    if (written < 0)
                        fprintf(stderr, "%s: %s\n", types[index].name, dds_strretcode(written));
                }
                dds_return_loan(readers[index], samples, 1);
            }
            if (!matched[index] && dds_get_matched_publications(readers[index], NULL, 0) > 0 &&
                dds_get_matched_subscriptions(writers[index], NULL, 0) > 0) {
                matched[index] = true;
                tell("matched", types[index].name);
            }
        }
    }
}

/* Offers a topic, and sends a message of zeros on it ten times a second. */
static void
offer(dds_entity_t participant, const char *topic, const char *type_name, const char *reliability,
      const char *durability)
{
    const message_type *type = type_called(type_name);
    dds_qos_t *qos = qos_of(reliability, durability);
    char name[256];
    snprintf(name, sizeof name, "rt%s", topic);
    dds_entity_t writer =
        made(dds_create_writer(participant, topic_of(participant, type, name), qos, NULL), name);
    dds_delete_qos(qos);
    tell("ready", "");
    for (;;) {
        void *sample = dds_alloc(type->descriptor->m_size);
        memset(sample, 0, type->descriptor->m_size);
        dds_write(writer, sample);
        dds_free(sample);
        dds_sleepfor(DDS_MSECS(100));
    }
}

#define PIXELS_WIDE 640
#define PIXELS_HIGH 480
#define BEAMS 720

static builtin_interfaces_msg_dds__Time_ now(void)
{
    const dds_time_t nanoseconds = dds_time();
    const builtin_interfaces_msg_dds__Time_ stamp = {
        (int32_t)(nanoseconds / DDS_NSECS_IN_SEC), (uint32_t)(nanoseconds % DDS_NSECS_IN_SEC)};
    return stamp;
}

/* A depth camera at 30 Hz and a scanner at 7 Hz, each stamped as it is sent. */
static void
drive(dds_entity_t participant, const char *namespace, double seconds, const char *reliability,
      dds_entity_t go)
{
    static uint8_t pixels[PIXELS_WIDE * PIXELS_HIGH * 2];
    static float ranges[BEAMS];
    for (size_t at = 0; at < sizeof pixels; at += 2) { /* 1.0 to 1.255 m, in mm */
        const uint16_t millimetres = (uint16_t)(1000 + at / 2 % 256);
        memcpy(&pixels[at], &millimetres, 2);
    }
    for (int beam = 0; beam < BEAMS; beam++)
        ranges[beam] = 1.0f + 0.001f * (float)beam;
    sensor_msgs_msg_dds__Image_ image = {
        .header.frame_id = "camera_depth_optical_frame",
        .height = PIXELS_HIGH, .width = PIXELS_WIDE, .encoding = "16UC1", .step = PIXELS_WIDE * 2,
        .data = {._maximum = sizeof pixels, ._length = sizeof pixels, ._buffer = pixels}};
    double distortion[5] = {0};
    sensor_msgs_msg_dds__CameraInfo_ info = {
        .header.frame_id = "camera_depth_optical_frame",
        .height = PIXELS_HIGH, .width = PIXELS_WIDE, .distortion_model = "plumb_bob",
        .d = {._maximum = 5, ._length = 5, ._buffer = distortion},
        .k = {525, 0, 319.5, 0, 525, 239.5, 0, 0, 1}, .r = {1, 0, 0, 0, 1, 0, 0, 0, 1},
        .p = {525, 0, 319.5, 0, 0, 525, 239.5, 0, 0, 0, 1, 0}};
    const float pi = 3.14159265f;
    sensor_msgs_msg_dds__LaserScan_ scan = {
        .header.frame_id = "laser", .angle_min = -pi, .angle_max = pi,
        .angle_increment = 2 * pi / (BEAMS - 1), .scan_time = 1.0f / 7,
        .range_min = 0.15f, .range_max = 12.0f,
        .ranges = {._maximum = BEAMS, ._length = BEAMS, ._buffer = ranges}};

    struct {
        const char *type, *topic;
        void *sample;
        builtin_interfaces_msg_dds__Time_ *stamp;
        double hz;
        dds_entity_t writer;
        long sent;
    } streams[] = {
        {"sensor_msgs/msg/Image", "depth/image", &image, &image.header.stamp, 30, 0, 0},
        {"sensor_msgs/msg/CameraInfo", "depth/camera_info", &info, &info.header.stamp, 30, 0, 0},
        {"sensor_msgs/msg/LaserScan", "scan", &scan, &scan.header.stamp, 7, 0, 0},
    };
    enum { stream_count = sizeof streams / sizeof *streams };
    dds_qos_t *qos = qos_of(reliability, "volatile");
    for (int index = 0; index < stream_count; index++) {
        char name[256];
        snprintf(name, sizeof name, "rt%s/%s", namespace, streams[index].topic);
        dds_entity_t topic = topic_of(participant, type_called(streams[index].type), name);
        streams[index].writer = made(dds_create_writer(participant, topic, qos, NULL), name);
    }
    dds_delete_qos(qos);
    tell("ready", "");
    for (int index = 0; index < stream_count; index++)
        while (dds_get_matched_subscriptions(streams[index].writer, NULL, 0) < 1)
            dds_sleepfor(look_period);
    tell("matched", "");
    bool gone = false;
    while (!gone) {
        dds_sleepfor(look_period);
        dds_read_guardcondition(go, &gone);
    }
    const dds_time_t start = dds_time();
    for (;;) {
        int next = 0;
        dds_time_t due = DDS_NEVER;
        for (int index = 0; index < stream_count; index++) {
            const dds_time_t at = start + (dds_time_t)((double)streams[index].sent / streams[index].hz * 1e9);
            if (at < due) {
                due = at;
                next = index;
            }
        }
        if (due >= start + (dds_time_t)(seconds * 1e9))
            break;
        if (due > dds_time())
            dds_sleepfor(due - dds_time());
        *streams[next].stamp = now();
        dds_write(streams[next].writer, streams[next].sample);
        streams[next].sent++;
    }
    char counts[128];
    snprintf(counts, sizeof counts, "%ld %ld %ld", streams[0].sent, streams[1].sent, streams[2].sent);
    tell("sent", counts);
    for (;;)
        dds_sleepfor(DDS_SECS(1));
}

int main(int count, char **words)
{
    if (count < 3)
        fail("usage", "peer echo|offer|drive DOMAIN ...");
    const char *mode = words[1];
    dds_entity_t participant =
        made(dds_create_participant((dds_domainid_t)atoi(words[2]), NULL, NULL), "participant");
    dds_entity_t go = made(dds_create_guardcondition(participant), "guard condition");
    leaving = participant;
    atexit(leave);
    pthread_t end;
    pthread_create(&end, NULL, wait_for_end, &go);
    if (strcmp(mode, "echo") == 0 && count == 6)
        echo(participant, words[3], words[4], words[5]);
    else if (strcmp(mode, "offer") == 0 && count == 7)
        offer(participant, words[3], words[4], words[5], words[6]);
    else if (strcmp(mode, "drive") == 0 && count == 6)
        drive(participant, words[3], atof(words[4]), words[5], go);
    fail("arguments", mode);
}
