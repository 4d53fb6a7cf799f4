"""The suite over two hosts: what reduces the sensors' data beside the drivers, what maps elsewhere.

    ros2 launch launch-scripts/split.launch.py part:=sensors peer:=10.0.0.2 scan:=/laser/scan    (on the robot)
    ros2 launch launch-scripts/split.launch.py part:=map peer:=10.0.0.1                          (on the other host)

Between them goes the reduced cloud, some 380 kB a cycle. Takes the arguments of robot.launch.py as well.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction, SetEnvironmentVariable
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

# The nodes of each part.
PARTS = {'sensors': 'detection', 'map': 'segmentation reconstruction'}


def described_part(context):
    """Describes the nodes of the part that was asked for."""
    part = LaunchConfiguration('part').perform(context)
    if part not in PARTS:
        raise RuntimeError(f'part: there is no {part}; known are {", ".join(PARTS)}')
    peer = LaunchConfiguration('peer').perform(context)
    # Where no multicast reaches the other host, it is asked by its address.
    peers = [SetEnvironmentVariable('ROS_STATIC_PEERS', peer)] if peer else []
    source = PythonLaunchDescriptionSource(str(Path(__file__).resolve().parent / 'robot.launch.py'))
    return [*peers, IncludeLaunchDescription(source, launch_arguments=[('nodes', PARTS[part])])]


def generate_launch_description():
    """Describes the nodes of one host."""
    return LaunchDescription([
        DeclareLaunchArgument('part', choices=list(PARTS), description='sensors, beside the drivers; or map'),
        DeclareLaunchArgument(
            'peer', default_value='', description='the address of the other host; nothing where multicast reaches it'),
        OpaqueFunction(function=described_part),
    ])
