"""Tells in JSON what a launch file of ROS 2 would start. The packages `launch` and `launch_ros` are in no registry, so
that a stand-in takes their place: it has the names and the arguments of what the launch files use, and refuses others.

    describe.py FILE [NAME:=VALUE]...
"""

import json
import os
import re
import runpy
import sys
import types
import xml.etree.ElementTree as xml
from pathlib import Path

told = {"arguments": {}, "nodes": [], "processes": [], "environment": {}, "included": []}
configurations = {}


def text(value):
    """The text of what may be a substitution, or a list of them."""
    if hasattr(value, "perform"):
        return value.perform(configurations)
    if isinstance(value, (list, tuple)):
        return "".join(text(one) for one in value)
    return str(value)


class LaunchConfiguration:
    def __init__(self, variable_name, *, default=None):
        self.name, self.default = variable_name, default

    def perform(self, context):
        if self.name in configurations:
            return configurations[self.name]
        if self.default is None:
            raise RuntimeError(f"launch configuration '{self.name}' does not exist")
        return text(self.default)


class PathJoinSubstitution:
    def __init__(self, substitutions):
        self.parts = substitutions

    def perform(self, context):
        return os.path.join(*[text(part) for part in self.parts])


class ParameterValue:
    def __init__(self, value, *, value_type=None):
        self.value, self.value_type = value, value_type


class DeclareLaunchArgument:
    def __init__(self, name, *, default_value=None, description=None, choices=None):
        self.name, self.default, self.choices, self.description = name, default_value, choices, description

    def visit(self):
        told["arguments"][self.name] = self.description
        if self.name not in configurations:
            if self.default is None:
                raise RuntimeError(f"the argument {self.name} must be given")
            configurations[self.name] = text(self.default)
        if self.choices and configurations[self.name] not in self.choices:
            raise RuntimeError(f"{self.name} is none of {self.choices}")


class OpaqueFunction:
    def __init__(self, *, function, args=None, kwargs=None):
        self.function, self.args, self.kwargs = function, args or (), kwargs or {}

    def visit(self):
        for entity in self.function(configurations, *self.args, **self.kwargs) or ():
            entity.visit()


class SetEnvironmentVariable:
    def __init__(self, name, value):
        self.name, self.value = name, value

    def visit(self):
        told["environment"][text(self.name)] = text(self.value)


class PythonLaunchDescriptionSource:
    def __init__(self, launch_file_path):
        self.path = launch_file_path


class IncludeLaunchDescription:
    def __init__(self, launch_description_source, *, launch_arguments=None):
        self.source, self.given = launch_description_source, launch_arguments or ()

    def visit(self):
        for name, value in self.given:
            configurations[text(name)] = text(value)
        launch(Path(text(self.source.path)))


class Shutdown:
    def __init__(self, *, reason=""):
        self.reason = reason

    def visit(self):
        pass


class ExecuteProcess:
    def __init__(self, *, cmd, name=None, output="log", on_exit=None, respawn=False):
        self.cmd = cmd

    def visit(self):
        told["processes"].append([text(part) for part in self.cmd])


class LogInfo:
    def __init__(self, *, msg):
        pass


class ShutdownProcess:
    def __init__(self, *, process_matcher):
        self.ends = process_matcher


class EmitEvent:
    def __init__(self, *, event):
        self.event = event


def matches_action(target_action):
    return lambda action: action is target_action


class TimerAction:
    def __init__(self, *, period, actions):
        self.actions = actions

    def visit(self):
        pass


class OnProcessExit:
    def __init__(self, *, target_action=None, on_exit=None):
        pass


class RegisterEventHandler:
    def __init__(self, event_handler):
        pass

    def visit(self):
        pass


class Node:
    def __init__(
        self, *, executable, package=None, name=None, namespace=None, exec_name=None, parameters=None, remappings=None,
        ros_arguments=None, arguments=None, output="log", on_exit=None, respawn=False, respawn_delay=None,
    ):
        # launch starts a node again and carries out its `on_exit` besides.
        if respawn and on_exit and not callable(on_exit):
            raise RuntimeError(f"{name} ends the others and is started again")
        self.respawn, self.on_exit = respawn, on_exit
        self.executable, self.package, self.name, self.namespace = executable, package, name, namespace
        self.parameters, self.remappings = parameters or [], remappings or []

    def stays_down_after(self, returncode):
        """Whether `on_exit` ends this node's process, which is waiting to be started again."""
        if not callable(self.on_exit):
            return False
        event = types.SimpleNamespace(action=self, process_name=text(self.name), returncode=returncode)
        events = [action.event for action in self.on_exit(event, configurations) or () if isinstance(action, EmitEvent)]
        return any(event.ends(self) for event in events)

    def visit(self):
        files, values = [], {}
        for parameter in self.parameters:
            if isinstance(parameter, dict):
                for key, value in parameter.items():
                    is_text = isinstance(value, ParameterValue) and value.value_type is str
                    plain = text(value.value if isinstance(value, ParameterValue) else value)
                    values[key] = json.dumps(plain) if is_text else plain
            else:
                files.append(text(parameter))
        told["nodes"].append({
            "executable": text(self.executable),
            "package": self.package and text(self.package),
            "name": text(self.name),
            "namespace": text(self.namespace),
            "respawn": self.respawn,
            "final_codes": [code for code in range(-15, 132) if self.stays_down_after(code)],
            "files": files,
            "values": values,
            "remappings": [[text(one), text(other)] for one, other in self.remappings],
        })


class LaunchDescription:
    def __init__(self, initial_entities=None):
        self.entities = initial_entities or []


STAND_IN = {
    "launch": [LaunchDescription],
    "launch.actions": [
        DeclareLaunchArgument, EmitEvent, ExecuteProcess, IncludeLaunchDescription, LogInfo, OpaqueFunction,
        RegisterEventHandler, SetEnvironmentVariable, Shutdown, TimerAction],
    "launch.event_handlers": [OnProcessExit],
    "launch.events": [matches_action],
    "launch.events.process": [ShutdownProcess],
    "launch.launch_description_sources": [PythonLaunchDescriptionSource],
    "launch.substitutions": [LaunchConfiguration, PathJoinSubstitution],
    "launch_ros": [],
    "launch_ros.actions": [Node],
    "launch_ros.parameter_descriptions": [ParameterValue],
}

# What the XML front end takes: each element with its attributes (those that must be there are marked).
ELEMENTS = {
    "launch": [],
    "arg": ["name!", "default", "description"],
    "let": ["name!", "value!"],
    "include": ["file!"],
    "executable": ["cmd!", "output", "name"],
    "set_env": ["name!", "value!"],
    "node": ["pkg", "exec!", "name", "namespace", "output", "args", "ros_args", "respawn", "respawn_delay"],
    "param": ["name", "value", "type", "from"],
    "remap": ["from!", "to!"],
}
CHILDREN = {"launch": set(ELEMENTS) - {"launch", "param", "remap"}, "node": {"param", "remap"}}


class Xml:
    """An XML launch file."""

    def __init__(self, path):
        self.folder = path.parent
        self.root = xml.parse(path).getroot()
        if self.root.tag != "launch":
            raise RuntimeError(f"<{self.root.tag}> is no launch file")
        self.check(self.root)

    def check(self, element):
        known = ELEMENTS[element.tag]
        names = {name.rstrip("!") for name in known}
        if unknown := set(element.attrib) - names:
            raise RuntimeError(f"<{element.tag}> has no {sorted(unknown)}")
        if missing := {name[:-1] for name in known if name.endswith("!")} - set(element.attrib):
            raise RuntimeError(f"<{element.tag}> needs {sorted(missing)}")
        for child in element:
            if child.tag not in CHILDREN.get(element.tag, ()):
                raise RuntimeError(f"<{child.tag}> has no place in <{element.tag}>")
            self.check(child)

    def text(self, value):
        def put(match):
            kind, _, about = match[1].partition(" ")
            if kind == "dirname":
                return str(self.folder)
            if kind == "var":
                return LaunchConfiguration(about).perform(configurations)
            raise RuntimeError(f"there is no $({kind})")

        return re.sub(r"\$\(([^()]*)\)", put, value)

    def visit(self):
        for element in self.root:
            get = {name: self.text(value) for name, value in element.attrib.items() if name != "default"}
            if element.tag == "arg":
                default = element.get("default")
                DeclareLaunchArgument(
                    get["name"], default_value=None if default is None else self.text(default),
                    description=get.get("description")).visit()
            elif element.tag == "let":
                configurations[get["name"]] = get["value"]
            elif element.tag == "include":
                launch(Path(get["file"]))
            elif element.tag == "executable":
                ExecuteProcess(cmd=get["cmd"].split()).visit()
            elif element.tag == "set_env":
                SetEnvironmentVariable(get["name"], get["value"]).visit()
            else:
                self.node(element, get)

    def node(self, element, get):
        parameters, remappings = [], []
        for child in element:
            value = {name: self.text(one) for name, one in child.attrib.items()}
            if child.tag == "remap":
                remappings.append((value["from"], value["to"]))
            elif "from" in value:
                parameters.append(value["from"])
            else:
                kind = str if value.get("type") == "str" else None
                parameters.append({value["name"]: ParameterValue(value["value"], value_type=kind)})
        Node(
            executable=get["exec"], package=get.get("pkg"), name=get["name"], namespace=get["namespace"],
            parameters=parameters, remappings=remappings, respawn=get.get("respawn") == "true").visit()


def launch(path):
    told["included"].append(path.name)
    if path.suffix == ".xml":
        Xml(path).visit()
        return
    for entity in runpy.run_path(str(path))["generate_launch_description"]().entities:
        entity.visit()


if __name__ == "__main__":
    for name, members in STAND_IN.items():
        module = types.ModuleType(name)
        vars(module).update({member.__name__: member for member in members})
        sys.modules[name] = module
    configurations.update(argument.split(":=", 1) for argument in sys.argv[2:])
    launch(Path(sys.argv[1]).resolve())
    print(json.dumps(told))
