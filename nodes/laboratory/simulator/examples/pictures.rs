//! Writes a few colour and depth images of each scenario as PPM, for inspection, and prints the time per image:
//! `cargo run --release -p simulator --example pictures -- FOLDER [NAME]...`

#![expect(clippy::print_stdout, reason = "it says what it found")]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use estimation::ScopedThreads;
use simulator::{ColourCamera, OdometryRun, Sample, Scenario, SceneName};

/// Images per scenario.
const PICTURES: usize = 3;

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().unwrap_or_else(|| "pictures".to_owned());
    let names: Vec<String> = arguments.collect();
    std::fs::create_dir_all(&folder)?;
    for (name, scenario) in scenarios() {
        if names.is_empty() || names.contains(&name) {
            take(Path::new(&folder), &name, &scenario)?;
        }
    }
    Ok(())
}

fn scenarios() -> Vec<(String, Scenario)> {
    let coloured = |mut scenario: Scenario| {
        scenario.rig.colour_camera.get_or_insert_with(ColourCamera::default);
        scenario
    };
    let mut scenarios = vec![("demo".to_owned(), coloured(Scenario::demo()))];
    for scene in SceneName::ALL {
        scenarios.push((scene.to_string(), coloured(Scenario::empty(scene, 1))));
    }
    for run in OdometryRun::ALL {
        scenarios.push((run.name().to_owned(), Scenario::odometry(run, 1)));
    }
    scenarios
}

fn take(folder: &Path, name: &str, scenario: &Scenario) -> std::io::Result<()> {
    // A few images over the whole length.
    let mut scenario = scenario.clone();
    scenario.rig.depth_camera.rate_hz = PICTURES as f64 / scenario.duration_s;
    scenario.rig.depth_camera.first_image_s = scenario.duration_s / PICTURES as f64 / 2.0;
    let samples = match scenario.samples() {
        Ok(samples) => samples.with_executor(Arc::new(ScopedThreads::of_machine())),
        Err(error) => return Err(std::io::Error::other(error)),
    };
    let (begin, mut images) = (Instant::now(), 0_u32);
    let picture = |at: u32, kind: &str| folder.join(format!("{name}-{at}-{kind}.ppm"));
    for sample in samples {
        match sample {
            Sample::Colour(image) => {
                let header = format!("P6 {} {} 255\n", image.width_px, image.height_px);
                let bytes = [header.as_bytes(), &image.rgb].concat();
                std::fs::write(picture(images, "rgb"), bytes)?;
                images += 1;
            }
            Sample::Depth { image, .. } => {
                let (width_px, height_px) = (image.width_px(), image.height_px());
                let header = format!("P5 {width_px} {height_px} 255\n");
                let shades = (0..width_px * height_px).map(|index| {
                    let depth_m = image.depth_m(index % width_px, index / width_px);
                    depth_m.map_or(0, |depth_m| (255.0 - depth_m * 30.0) as u8)
                });
                let bytes: Vec<u8> = header.bytes().chain(shades).collect();
                std::fs::write(picture(images, "depth"), bytes)?;
            }
            _ => {}
        }
    }
    let taken_s = begin.elapsed().as_secs_f64();
    println!("{name}: {:.0} ms an image", taken_s / f64::from(images.max(1)) * 1e3);
    Ok(())
}
