"""The filter before another node of the graph: detection and segmentation, and that node with its inputs remapped to the
filtered topics.

    ros2 launch launch-scripts/filter.launch.py consumer:=slam_toolbox scan:=/laser/scan \
        depth_image:=/camera/depth/image_raw depth_camera_info:=/camera/depth/camera_info pose:=/odometry/pose

`consumer` is slam_toolbox, amcl, rtabmap, nvblox, octomap_server, voxel_layer (Nav2's costmap of the planner), or none; its own
parameters are those of `consumer_params`. docs/filter.md says what each needs besides.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction
from launch.events import matches_action
from launch.events.process import ShutdownProcess
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node

CONFIG = Path(__file__).resolve().parent.parent / 'config'
PACKAGE = 'stillmap'
RESPAWN_DELAY_S = 2.0
# With this a node ends whose arguments, parameters or settings cannot be used: at another start it would, too.
EXIT_UNUSABLE = 2

# The inputs: launch argument, topic of the nodes, meaning.
INPUTS = [
    ('scan', 'scan', 'LaserScan of the 2D scanner'),
    ('depth_image', 'depth/image', 'depth image of the camera, 16UC1 or 32FC1'),
    ('depth_camera_info', 'depth/camera_info', 'calibration of the depth camera'),
    ('rgb_image', 'rgb/image', 'raw image of the colour camera, for static_rgb'),
    ('rgb_camera_info', 'rgb/camera_info', 'calibration of the colour camera'),
    ('points', 'points', 'PointCloud2 of the camera, for rigs with `input: points`, or for static_points'),
    ('pose', 'pose', 'PoseStamped of the rig in the map'),
]
# Who takes the filtered topics: package, program, name, which of its topics become which, and parameters that it then needs.
CONSUMERS = {
    'slam_toolbox': ('slam_toolbox', 'async_slam_toolbox_node', 'slam_toolbox', [('/scan', 'static_scan')], {}),
    'amcl': ('nav2_amcl', 'amcl', 'amcl', [('scan', 'static_scan')], {}),
    # Images are best effort: qos 2.
    'rtabmap': (
        'rtabmap_slam', 'rtabmap', 'rtabmap',
        [('scan', 'static_scan'), ('rgb/image', 'static_rgb/image'), ('rgb/camera_info', 'static_rgb/camera_info'),
         ('depth/image', 'static_depth/image')], {'qos_image': 2, 'qos_camera_info': 2}),
    'nvblox': (
        'nvblox_ros', 'nvblox_node', 'nvblox_node',
        [('camera_0/depth/image', 'static_depth/image'), ('camera_0/depth/camera_info', 'static_depth/camera_info')],
        {'input_qos': 'SENSOR_DATA'}),
    'octomap_server': ('octomap_server', 'octomap_server_node', 'octomap_server', [('cloud_in', 'static_points')], {}),
    'voxel_layer': (
        'nav2_planner', 'planner_server', 'planner_server', [('/scan', 'static_scan'), ('/points', 'static_points')], {}),
}


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
    """Describes the two nodes and who takes their topics."""
    # An absolute path wins over the folder before it.
    rig = PathJoinSubstitution([str(CONFIG / 'rig'), LaunchConfiguration('rig')])
    fill = {'static_scan_fill': LaunchConfiguration('fill')}
    nodes = [
        Node(
            package=package(), executable=name, name=name, namespace=LaunchConfiguration('namespace'), output='screen',
            parameters=[str(CONFIG / 'pipeline.yaml'), str(CONFIG / f'{name}.yaml'), rig, *more],
            remappings=[(topic, LaunchConfiguration(argument)) for argument, topic, _ in INPUTS],
            respawn=True, respawn_delay=RESPAWN_DELAY_S, on_exit=stay_down)
        for name, more in [('detection', []), ('segmentation', [fill])]
    ]
    consumer = LaunchConfiguration('consumer').perform(context)
    if consumer != 'none':
        package_of, program, name, topics, needed = CONSUMERS[consumer]
        given = LaunchConfiguration('consumer_params').perform(context)
        nodes.append(Node(
            package=package_of, executable=program, name=name, namespace=LaunchConfiguration('namespace'), output='screen',
            parameters=[*([given] if given else []), needed] if needed or given else [],
            remappings=topics))
    return nodes


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
            'consumer', default_value='none', choices=['none', *CONSUMERS],
            description='the node to start behind the filter'),
        DeclareLaunchArgument(
            'consumer_params', default_value='', description='the absolute path of its parameter file, or nothing'),
        DeclareLaunchArgument(
            'fill', default_value='nan', choices=['nan', 'background'],
            description='what a beam of static_scan has that hit something moving'),
        *(DeclareLaunchArgument(argument, default_value=topic, description=meaning)
          for argument, topic, meaning in INPUTS),
        OpaqueFunction(function=described_nodes),
    ])
