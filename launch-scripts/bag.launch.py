"""The three nodes on a recorded bag: plays it, lets the last cycles through, and ends.

    ros2 launch launch-scripts/bag.launch.py bag:=room.mcap map_file:=map.ply

A map that is in the file is continued: give another bag another file. Takes the arguments of robot.launch.py as well; its topics are here those of the bag. The programs
`stillmap`, `detection`, `segmentation` and `reconstruction` must be on the PATH.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription, RegisterEventHandler,
    SetEnvironmentVariable, Shutdown, TimerAction)
from launch.event_handlers import OnProcessExit
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

# A bag's topics are absolute, whatever the namespace of the nodes.
INPUTS = [
    ('scan', '/scan'),
    ('depth_image', '/depth/image'),
    ('depth_camera_info', '/depth/camera_info'),
    ('points', '/points'),
    ('pose', '/pose'),
]

# detection gives up on a scan after 0.5 s; its cycle then passes two more nodes.
LAST_CYCLES_S = 3.0


def generate_launch_description():
    """Describes the nodes, the player and the end."""
    player = ExecuteProcess(
        cmd=['stillmap', 'play', LaunchConfiguration('bag'), '--rate', LaunchConfiguration('rate'),
             '--wait-for', LaunchConfiguration('scan')],
        output='screen')
    end = TimerAction(period=LAST_CYCLES_S, actions=[Shutdown(reason='the bag has been played')])
    return LaunchDescription([
        DeclareLaunchArgument('bag', description='the bag: an .mcap file or a rosbag2 directory'),
        DeclareLaunchArgument('rate', default_value='1', description='seconds of the bag per second'),
        *(DeclareLaunchArgument(argument, default_value=topic, description=f'the topic in place of {topic}')
          for argument, topic in INPUTS),
        RegisterEventHandler(OnProcessExit(target_action=player, on_exit=[end])),
        # Each cycle of a bag counts, where live the newest do.
        SetEnvironmentVariable('STILLMAP_MAX_WAITING_CYCLES', '50'),
        # Half a bag in the map is worse than none.
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(str(Path(__file__).resolve().parent / 'robot.launch.py')),
            launch_arguments=[('respawn', 'false')]),
        player,
    ])
