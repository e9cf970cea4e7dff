"""Foxglove's messages for tests, as protobuf classes made of their public definitions."""

from __future__ import annotations

from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2


def foxglove_states() -> tuple[Any, bytes]:
    """The class of foxglove.JointStates, and its definition."""
    file = descriptor_pb2.FileDescriptorProto(name="states.proto", package="foxglove", syntax="proto3")
    file.dependency.append("google/protobuf/timestamp.proto")
    joint = file.message_type.add(name="JointState")
    field = descriptor_pb2.FieldDescriptorProto
    joint.field.add(name="name", number=1, type=field.TYPE_STRING, label=field.LABEL_OPTIONAL)
    for number, name in enumerate(("position", "velocity", "acceleration", "effort"), 2):
        joint.oneof_decl.add(name=f"_{name}")
        joint.field.add(
            name=name, number=number, type=field.TYPE_DOUBLE, label=field.LABEL_OPTIONAL,
            proto3_optional=True, oneof_index=number - 2,
        )  # fmt: skip
    outer = file.message_type.add(name="JointStates")
    stamp = ".google.protobuf.Timestamp"
    outer.field.add(name="timestamp", number=1, type=field.TYPE_MESSAGE, type_name=stamp, label=field.LABEL_OPTIONAL)
    outer.field.add(
        name="joints", number=2, type=field.TYPE_MESSAGE, type_name=".foxglove.JointState", label=field.LABEL_REPEATED
    )
    files = descriptor_pb2.FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    files.file.add().CopyFrom(file)
    pool = descriptor_pool.DescriptorPool()
    for part in files.file:
        pool.Add(part)
    return message_factory.GetMessageClass(
        pool.FindMessageTypeByName("foxglove.JointStates")
    ), files.SerializeToString()
