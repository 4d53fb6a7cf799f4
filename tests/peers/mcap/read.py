"""Tells in JSON what MCAP's own reader finds in a bag: of each topic its type, its schema, its messages and their times.

    read.py BAG
"""

import json
import sys

from mcap.reader import make_reader

with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    header, summary = reader.get_header(), reader.get_summary()
    topics = {}
    for schema, channel, message in reader.iter_messages():
        topic = topics.setdefault(channel.topic, {
            "type": schema.name,
            "schema_encoding": schema.encoding,
            "schema_bytes": len(schema.data),
            "encoding": channel.message_encoding,
            "qos": channel.metadata["offered_qos_profiles"],
            "count": 0,
            "first_ns": message.log_time,
            "bytes": 0,
        })
        topic["count"] += 1
        topic["last_ns"] = message.log_time
        topic["bytes"] += len(message.data)
    print(json.dumps({
        "profile": header.profile,
        "chunks": len(summary.chunk_indexes),
        "message_count": summary.statistics.message_count,
        "topics": topics,
    }))
