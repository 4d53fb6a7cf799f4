"""The three nodes beside a robot's drivers.

    ros2 launch launch-scripts/robot.launch.py scan:=/laser/scan depth_image:=/camera/depth/image_raw \
        depth_camera_info:=/camera/depth/camera_info pose:=/odometry/pose

The programs `detection`, `segmentation` and `reconstruction` must be on the PATH.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

CONFIG = Path(__file__).resolve().parent.parent / 'config'

# The inputs of detection: launch argument, topic of the node, meaning.
INPUTS = [
    ('scan', 'scan', 'LaserScan of the 2D scanner'),
    ('depth_image', 'depth/image', 'depth image of the camera, 16UC1 or 32FC1'),
    ('depth_camera_info', 'depth/camera_info', 'calibration of the depth camera'),
    ('points', 'points', 'PointCloud2 of the camera, for rigs with `input: points`'),
    ('pose', 'pose', 'PoseStamped of the rig in the map'),
]


def generate_launch_description():
    """Describes the nodes and their arguments."""
    arguments = [
        DeclareLaunchArgument('namespace', default_value='/', description='namespace of the nodes, absolute'),
        DeclareLaunchArgument(
            'rig', default_value='rplidar_a1_kinect_v1.yaml',
            description='preset of config/rig, or the absolute path of a parameter file'),
        DeclareLaunchArgument(
            'save_map_on_exit', default_value='',
            description='where the map is saved at the end: a .ply or .pcd path, or nothing'),
    ] + [
        DeclareLaunchArgument(argument, default_value=topic, description=meaning)
        for argument, topic, meaning in INPUTS
    ]
    # An absolute path wins over the folder before it.
    rig = PathJoinSubstitution([str(CONFIG / 'rig'), LaunchConfiguration('rig')])

    def node(name, remappings=(), parameters=()):
        return Node(
            executable=name, name=name, namespace=LaunchConfiguration('namespace'), output='screen',
            parameters=[str(CONFIG / f'{name}.yaml'), rig, *parameters], remappings=list(remappings),
            # Without one of them the others wait for ever.
            on_exit=[Shutdown(reason=f'{name} has ended')])

    # Text even where it is empty or looks like a number.
    map_path = ParameterValue(LaunchConfiguration('save_map_on_exit'), value_type=str)
    return LaunchDescription(arguments + [
        node('detection', remappings=[
            (topic, LaunchConfiguration(argument)) for argument, topic, _ in INPUTS]),
        node('segmentation'),
        node('reconstruction', parameters=[{'save_map_on_exit': map_path}]),
    ])
