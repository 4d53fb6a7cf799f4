//! The cost of a cycle when the three nodes share a process without other subscribers: allocations, their bytes, and time.
//! `cargo bench -p laboratory --bench composed`, or `cargo test --bench composed` for the allocations alone.
#![allow(
    missing_docs,
    unsafe_code,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a panic is a benchmark's report, and an allocator is unsafe"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use detection::shell::{DetectionParameters, Stage as Detection};
use free_domain::FreeDomain;
use msgs::convert;
use node_shell::parameters::{self, Assignment};
use node_shell::{Host, Qos, RosArguments, Transport};
use reconstruction::shell::{ReconstructionParameters, Stage as Reconstruction};
use segmentation::shell::{SegmentationParameters, Stage as Segmentation};
use simulator::{Sample, Scenario};

/// The system's allocator with counters.
struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);
static BYTES: AtomicU64 = AtomicU64::new(0);

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        BYTES.fetch_add(layout.size() as u64, Ordering::Relaxed);
        // SAFETY: the caller's contract is that of the system's allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the same.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Warm-up cycles, in which tables grow.
const FIRST_CYCLES: usize = 20;
/// The length of the demo that is played.
const PLAYED_S: f64 = 16.0;

/// The cost of the cycles.
#[derive(Default)]
struct Cost {
    cycles: usize,
    allocations: u64,
    bytes: u64,
    times: Vec<Duration>,
}

fn loaded<P>(node: &str, method: &str) -> P
where
    P: geometry::parameter::Parameters + serde::Serialize + serde::de::DeserializeOwned + Default,
{
    let method = Assignment { name: "method".to_owned(), value: method.to_owned() };
    parameters::load(node, &[] as &[&std::path::Path], &[method]).unwrap()
}

fn cost_of(host: &Host, method: &str, samples: &[Sample]) -> Cost {
    let arguments = RosArguments::parse(["--ros-args", "-r", "__ns:=/composed"]).unwrap();
    let node = |name: &str| host.node(name, &arguments).unwrap();
    let (sensors, own) =
        (node("sensors"), ["detection", "segmentation", "reconstruction"].map(node));
    let qos = Qos::sensor(1);
    let scans = sensors.publisher("scan", &qos).unwrap();
    let images = sensors.publisher("depth/image", &qos).unwrap();
    let infos = sensors.publisher("depth/camera_info", &qos).unwrap();
    let poses = sensors.publisher("pose", &qos).unwrap();
    let mut detection =
        Detection::new(&own[0], &loaded::<DetectionParameters>("/detection", method)).unwrap();
    let mut segmentation =
        Segmentation::new(&own[1], &loaded::<SegmentationParameters>("/segmentation", method))
            .unwrap();
    let mut reconstruction = Reconstruction::new(
        &own[2],
        &loaded::<ReconstructionParameters>("/reconstruction", method),
    )
    .unwrap();
    let mut cost = Cost::default();
    let mut seen = 0;
    for sample in samples {
        match sample {
            Sample::Pose(pose) => poses.publish(convert::message_from_pose(pose)).unwrap(),
            Sample::CameraInfo { stamp, frame_id, camera } => {
                infos.publish(convert::message_from_camera(camera, *stamp, frame_id)).unwrap();
            }
            Sample::Depth { image, .. } => {
                images.publish(convert::message_from_depth(image)).unwrap();
            }
            Sample::Scan { scan, .. } => scans.publish(convert::message_from_scan(scan)).unwrap(),
            _ => continue,
        }
        let before = (ALLOCATIONS.load(Ordering::Relaxed), BYTES.load(Ordering::Relaxed));
        let start = Instant::now();
        detection.take_waiting();
        segmentation.take_waiting();
        reconstruction.take_waiting();
        let time = start.elapsed();
        let after = (ALLOCATIONS.load(Ordering::Relaxed), BYTES.load(Ordering::Relaxed));
        let voxels = reconstruction.map().len();
        let is_cycle = after.1 - before.1 > LEAST_BYTES_OF_A_CYCLE && voxels > 0;
        if is_cycle {
            seen += 1;
            if seen > FIRST_CYCLES {
                cost.cycles += 1;
                cost.allocations += after.0 - before.0;
                cost.bytes += after.1 - before.1;
                cost.times.push(time);
            }
        }
    }
    cost
}

/// Messages without a cycle take a few hundred bytes.
const LEAST_BYTES_OF_A_CYCLE: u64 = 50_000;

fn tell(name: &str, mut cost: Cost) {
    cost.times.sort_unstable();
    let cycles = cost.cycles as u64;
    println!(
        "{name}: {cycles} cycles, {} allocations and {:.1} KiB each, median {:.2} ms",
        cost.allocations / cycles,
        cost.bytes as f64 / cycles as f64 / 1024.0,
        cost.times[cost.times.len() / 2].as_secs_f64() * 1e3
    );
}

fn main() {
    let scenario = Scenario::demo().with_seed(1).with_depth_size(320, 240);
    let samples: Vec<Sample> = scenario
        .samples()
        .unwrap()
        .take_while(|sample| sample.stamp().seconds_since(scenario.start) < PLAYED_S)
        .collect();
    for method in ["rec_hv", "free_space"] {
        tell(&format!("{method}, on no network"), cost_of(&Host::in_process(), method, &samples));
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let domain = FreeDomain::new();
        let transport = Transport::on_domain(domain.number()).unwrap().loopback_only();
        let host = Host::on(transport).unwrap();
        for method in ["rec_hv", "free_space"] {
            tell(&format!("{method}, on DDS"), cost_of(&host, method, &samples));
        }
    });
}
