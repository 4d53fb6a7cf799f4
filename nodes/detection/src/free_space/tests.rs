//! The whole method in worlds of the plane, through the detector.

mod any_input;
mod corrected_map;
mod moving_beams;
mod moving_platform;
mod objects;
mod rear;
mod static_platform;
mod world;
