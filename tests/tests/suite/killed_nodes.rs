//! Each node in turn is killed, with no chance to say good-bye, while the graph runs, and comes back.

use std::time::{Duration, Instant};

use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::sensor_msgs::CompressedImage;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, Qos, RosArguments, Subscription};
use tokio::time::timeout;

use crate::network::end::BEFORE_THE_LEASE;
use crate::program::Running;
use crate::sensors::Sensors;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// So many of its cycles show that a node goes on.
const CYCLES: usize = 10;

/// A node, what has to be given to it, and which nodes lack what when it is away.
struct Place {
    name: &'static str,
    parameters: &'static [&'static str],
    missed: Option<(&'static str, &'static str)>,
    /// The nodes that stand still without it, which have their places behind it.
    behind: &'static [&'static str],
}

const PLACES: [Place; 6] = [
    Place {
        name: "detection",
        parameters: &["-p", "input:=points"],
        missed: Some(("segmentation", "reduced_cloud")),
        behind: &["segmentation", "reconstruction"],
    },
    Place {
        name: "segmentation",
        parameters: &[],
        missed: Some(("reconstruction", "segmented_cloud")),
        behind: &["reconstruction"],
    },
    Place { name: "reconstruction", parameters: &[], missed: None, behind: &[] },
    Place { name: "pose", parameters: &[], missed: None, behind: &[] },
    Place {
        name: "lidar_odometry",
        // The pose is that of the sensors.
        parameters: &["-r", "pose:=lidar/pose", "-r", "odom:=lidar/odom"],
        missed: None,
        behind: &[],
    },
    Place { name: "compression", parameters: &[], missed: None, behind: &[] },
];

/// What shows that a node works.
enum Sign {
    Reports(Subscription<StageReport>),
    Images(Subscription<CompressedImage>),
}

impl Sign {
    fn of(ear: &Node, name: &str) -> Self {
        let qos = Qos::reliable(200);
        match name {
            "compression" => Self::Images(
                ear.subscription("depth/image/compressedDepth", &Qos::sensor(20)).unwrap(),
            ),
            _ => Self::Reports(ear.subscription(&format!("{name}/report"), &qos).unwrap()),
        }
    }

    async fn next(&self) {
        match self {
            Self::Reports(reports) => drop(reports.next().await),
            Self::Images(images) => drop(images.next().await),
        }
    }

    fn forget(&self) {
        match self {
            Self::Reports(reports) => while reports.try_next().is_some() {},
            Self::Images(images) => while images.try_next().is_some() {},
        }
    }
}

/// A node that runs, and the sign of it.
struct Member {
    place: &'static Place,
    process: Option<Running>,
    sign: Sign,
}

impl Member {
    fn start(&mut self, namespace: &str) {
        let rule = format!("__ns:={namespace}");
        let program = self.place.name.replace('_', "-");
        let line = ["node", &program, "--ros-args", "-r", &rule];
        self.process = Some(Running::start(line.iter().chain(self.place.parameters)));
    }

    async fn works(&mut self, cycles: usize, when: &str) {
        let mut done = 0;
        let sign = async {
            while done < cycles {
                self.sign.next().await;
                done += 1;
            }
        };
        let in_time = timeout(PATIENCE, sign).await.is_ok();
        let name = self.place.name;
        let is_up = self.process.as_mut().is_some_and(Running::is_up);
        assert!(in_time, "{when}: {name} shows {done} of {cycles} cycles; it is up: {is_up}");
    }
}

/// Waits until a node reports that it lacks a topic, and returns how it says so.
async fn is_missed(
    reports: &Subscription<DiagnosticArray>,
    namespace: &str,
    (by, topic): (&str, &str),
) -> String {
    let (name, topic) = (format!("{namespace}/{by}"), format!("{namespace}/{topic}"));
    let ways = [format!("waiting for {topic}"), format!("nothing on {topic}")];
    let heard = async {
        loop {
            for status in &reports.next().await.message.status {
                let says = |way: &String| status.message.contains(way.as_str());
                if status.name == name && ways.iter().any(says) {
                    return status.message.clone();
                }
            }
        }
    };
    timeout(PATIENCE, heard).await.unwrap_or_else(|_| panic!("{name} does not miss {topic}"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_node_may_be_killed_while_the_graph_runs() {
    let namespace = format!("/killed_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let ear = Node::start("ear", &arguments).unwrap();
    let reports = ear.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(200)).unwrap();
    let sensors = Sensors::start(Node::start("sensors", &arguments).unwrap());
    let mut members: Vec<Member> = PLACES
        .iter()
        .map(|place| Member { place, process: None, sign: Sign::of(&ear, place.name) })
        .collect();
    for member in &mut members {
        member.start(&namespace);
    }
    for member in &mut members {
        member.works(CYCLES, "at the start").await;
    }

    for victim in 0..members.len() {
        let place = members[victim].place;
        let killed = Instant::now();
        members[victim].process.take().unwrap().kill();
        while reports.try_next().is_some() {}
        if let Some(missed) = place.missed {
            let says = is_missed(&reports, &namespace, missed).await;
            println!("{} away: after {:?} {} says: {says}", place.name, killed.elapsed(), missed.0);
            assert!(killed.elapsed() < BEFORE_THE_LEASE, "{says}");
        }
        for member in &mut members {
            let is_behind = place.behind.contains(&member.place.name);
            let Some(process) = &mut member.process else { continue };
            assert!(process.is_up(), "{} ended with {}", member.place.name, place.name);
            member.sign.forget();
            if !is_behind {
                member.works(CYCLES, &format!("{} away", place.name)).await;
            }
        }

        let returned = Instant::now();
        members[victim].sign.forget();
        members[victim].start(&namespace);
        for member in &mut members {
            let name = member.place.name;
            if name == place.name || place.behind.contains(&name) {
                member.works(1, &format!("{} back", place.name)).await;
                println!("{} back: {name} works after {:?}", place.name, returned.elapsed());
            }
        }
        let returned = returned.elapsed();
        assert!(returned < BEFORE_THE_LEASE, "{}: {returned:?}", place.name);
    }

    sensors.end().await;
    for member in &mut members {
        assert!(member.process.take().unwrap().interrupt(), "{}", member.place.name);
    }
    drop((members, reports));
    ear.close().await;
}
