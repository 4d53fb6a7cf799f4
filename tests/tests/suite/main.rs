//! What only the whole can show: the program as a user starts it, processes on DDS, recorded data.
//! The modules stand in the order in which data flows.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a panic is a test's report, and its output belongs to it"
)]

mod bad_input;
mod bag_formats;
mod bags;
mod existing_files;
mod interrupted;
mod playing;
mod program;
mod python;
mod sensors;

mod codemap;
mod config_files;
mod dependencies;
mod documents;
mod drivers;
mod import;
mod import_lidar;
mod local_run;
mod occupancy_grid;
mod packages;
mod packaging;
mod parameter_table;
mod pose_sources;
mod reliability;
mod trajectory;
mod transforms;

mod apart;
mod bench;
mod coloured_map;
mod corrected_map;
mod dds_run;
mod doctor;
mod drawings;
mod ending;
mod filtered;
mod foreign;
mod foxglove;
mod killed_nodes;
mod live_view;
mod logs;
mod merged_maps;
mod mesh_files;
mod mounting;
mod network;
mod overload;
mod pipeline_settings;
mod recorded_graph;
mod restarted_map;
mod restarted_node;
mod scenes;
mod simulated_time;
mod stopped_process;
mod up;

mod recorded_camera;
mod recorded_kitchen;
mod rectified_images;
