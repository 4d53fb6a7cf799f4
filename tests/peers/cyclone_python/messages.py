"""The messages' classes, made from the `.msg` files themselves, so that a test by field name does not
lean on the IDL that the other peers are built from."""

import re
from pathlib import Path

from cyclonedds.idl import make_idl_struct, types
from cyclonedds.idl.annotations import cdrv0, final

PRIMITIVES = {
    "bool": bool,
    "byte": types.uint8,
    "char": types.uint8,
    "int8": types.int8,
    "uint8": types.uint8,
    "int16": types.int16,
    "uint16": types.uint16,
    "int32": types.int32,
    "uint32": types.uint32,
    "int64": types.int64,
    "uint64": types.uint64,
    "float32": types.float32,
    "float64": types.float64,
    "string": str,
}
FIELD = re.compile(r"(?P<element>[\w/]+)(\[(?P<length>\d*|<=\d+)\])?\s+(?P<name>\w+)")
# What `rmw_cyclonedds` puts before a request and its response.
HEADER = "uint64 client\nint64 sequence\n"
# What ROS 2 sends for a message without fields.
PLACEHOLDER = "uint8 structure_needs_at_least_one_member"


class Message:
    """A message type: its class, and its fields as `(name, message or None, is_many)`."""

    def __init__(self, name, fields):
        self.name = name
        self.fields = fields
        self.type = None

    def to_json(self, value):
        return {
            name: plain(getattr(value, name), message, many) for name, message, many in self.fields
        }

    def from_json(self, value):
        unknown = set(value) - {name for name, _, _ in self.fields}
        if unknown:
            raise ValueError(f"{self.name} has no {sorted(unknown)}")
        return self.type(
            **{
                name: message_of(value[name], message, many) for name, message, many in self.fields
            }
        )


def plain(value, message, many):
    if many:
        return list(value) if message is None else [message.to_json(one) for one in value]
    return value if message is None else message.to_json(value)


def message_of(value, message, many):
    if message is None:
        return value
    return [message.from_json(one) for one in value] if many else message.from_json(value)


def read(folder):
    """Every message of the folder, by its full name."""
    texts = definitions(folder)
    messages = {}
    for name in texts:
        build(name, texts, messages)
    return messages


def service(folder, name):
    """The request and the response of a service, each with its header; the services' folder stands beside the messages'."""
    package, _, base = name.split("/")
    parts = (Path(folder).parent / "srv" / package / f"{base}.srv").read_text().split("---\n")
    texts, messages = definitions(folder), {}
    for kind, text in zip(("Request", "Response"), parts, strict=True):
        is_empty = not any(line.split("#")[0].strip() for line in text.splitlines())
        texts[f"{name}_{kind}"] = HEADER + (PLACEHOLDER if is_empty else text)
    return [build(f"{name}_{kind}", texts, messages) for kind in ("Request", "Response")]


def definitions(folder):
    return {
        f"{path.parent.name}/msg/{path.stem}": path.read_text() for path in sorted(Path(folder).glob("*/*.msg"))
    }


def build(name, texts, messages):
    if name in messages:
        return messages[name]
    package, folder, base = name.split("/")
    lines = [line.split("#")[0].strip() for line in texts[name].splitlines()]
    # A bound has an equals sign, too, and changes nothing on the wire.
    lines = [line for line in lines if line and "=" not in line.replace("<=", "")] or [PLACEHOLDER]
    fields, annotations = [], {}
    for line in lines:
        element, length, field = FIELD.match(line).group("element", "length", "name")
        if element in PRIMITIVES:
            inner, kind = None, PRIMITIVES[element]
        else:
            inner_package, _, inner_base = element.rpartition("/")
            inner = build(f"{inner_package or package}/msg/{inner_base}", texts, messages)
            kind = inner.type
        if length and length.isdigit():
            kind = types.array[kind, int(length)]
        elif length is not None:
            kind = types.sequence[kind]
        fields.append((field, inner, length is not None))
        annotations[field] = kind
    message = Message(name, fields)
    made = make_idl_struct(f"{base}_", f"{package}.{folder}.dds_.{base}_", annotations)
    message.type = cdrv0(final(made))
    messages[name] = message
    return message
