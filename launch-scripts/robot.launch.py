"""The nodes beside a robot's drivers.

    ros2 launch launch-scripts/robot.launch.py scan:=/laser/scan depth_image:=/camera/depth/image_raw \
        depth_camera_info:=/camera/depth/camera_info pose:=/odometry/pose

Built by colcon, the programs are found by their package (`ros2 launch stillmap robot.launch.py`); else `detection`,
`segmentation`, `reconstruction` and what else is named must be on the PATH.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction, Shutdown
from launch.events import matches_action
from launch.events.process import ShutdownProcess
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

CONFIG = Path(__file__).resolve().parent.parent / 'config'
PACKAGE = 'stillmap'

# The inputs: launch argument, topic of the nodes, meaning.
INPUTS = [
    ('scan', 'scan', 'LaserScan of the 2D scanner'),
    ('depth_image', 'depth/image', 'depth image of the camera, 16UC1 or 32FC1'),
    ('depth_camera_info', 'depth/camera_info', 'calibration of the depth camera'),
    ('points', 'points', 'PointCloud2 of the camera, for rigs with `input: points`, or of the LiDAR, for lidar_odometry'),
    ('pose', 'pose', 'PoseStamped of the rig in the map'),
    ('rgb_image', 'rgb/image', 'colour image, for the node pose, and for detection with `colour: raw`'),
    ('rgb_camera_info', 'rgb/camera_info', 'calibration of the colour camera, for the same'),
]
NODES = ['detection', 'segmentation', 'reconstruction']
# A node that has fallen is started again after so long.
RESPAWN_DELAY_S = 2.0
# With this a node ends whose arguments, parameters or settings cannot be used: at another start it would, too.
EXIT_UNUSABLE = 2
# Those that the argument `nodes` may name besides.
MORE_NODES = ['pose', 'lidar_odometry']


def package():
    """The package that the programs are installed in; none where they are on the PATH."""
    try:
        from ament_index_python.packages import PackageNotFoundError, get_package_prefix
    except ImportError:
        return None
    try:
        get_package_prefix(PACKAGE)
    except PackageNotFoundError:
        return None
    return PACKAGE


def stay_down(event, _context):
    """Lets a node that cannot use what it was given stay down, instead of starting it again."""
    if event.returncode != EXIT_UNUSABLE:
        return None
    return [
        LogInfo(msg=f'{event.process_name}: it cannot use its arguments, as it says above, and is not started again'),
        EmitEvent(event=ShutdownProcess(process_matcher=matches_action(event.action))),
    ]


def described_nodes(context):
    """Describes the nodes that the argument `nodes` names."""
    names = LaunchConfiguration('nodes').perform(context).split()
    unknown = sorted(set(names) - set(NODES + MORE_NODES))
    if unknown:
        raise RuntimeError(f'nodes: there is no {unknown[0]}; known are {", ".join(NODES + MORE_NODES)}')
    # An absolute path wins over the folder before it.
    rig = PathJoinSubstitution([str(CONFIG / 'rig'), LaunchConfiguration('rig')])
    # Text even where it is empty or looks like a number.
    map_file = ParameterValue(LaunchConfiguration('map_file'), value_type=str)
    parameters = {'reconstruction': [{'map_file': map_file}]}
    respawn = LaunchConfiguration('respawn').perform(context) == 'true'
    return [
        Node(
            package=package(), executable=name.replace('_', '-'), name=name,
            namespace=LaunchConfiguration('namespace'), output='screen',
            parameters=[str(CONFIG / 'pipeline.yaml'), str(CONFIG / f'{name}.yaml'), rig, *parameters.get(name, [])],
            remappings=[(topic, LaunchConfiguration(argument)) for argument, topic, _ in INPUTS],
            respawn=respawn, respawn_delay=RESPAWN_DELAY_S,
            # Without one of them the others wait for ever.
            on_exit=stay_down if respawn else [Shutdown(reason=f'{name} has ended')])
        for name in names
    ]


def generate_launch_description():
    """Describes the nodes and their arguments."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'namespace', default_value='',
            description='namespace of the nodes, within that of the launch file which includes this one unless it is absolute'),
        DeclareLaunchArgument(
            'rig', default_value='rplidar_a1_kinect_v1.yaml',
            description='preset of config/rig, or the absolute path of a parameter file'),
        DeclareLaunchArgument(
            'map_file', default_value='',
            description='the file of the map, continued where it is there: a .ply, .pcd or .bt path, or nothing'),
        DeclareLaunchArgument(
            'respawn', default_value='true', choices=['true', 'false'],
            description='start a node again that has fallen, or else end the others with it'),
        DeclareLaunchArgument(
            'nodes', default_value=' '.join(NODES),
            description='the nodes to start, with spaces between; pose and lidar_odometry are two more'),
        *(DeclareLaunchArgument(argument, default_value=topic, description=meaning)
          for argument, topic, meaning in INPUTS),
        OpaqueFunction(function=described_nodes),
    ])
