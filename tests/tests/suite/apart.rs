//! Two copies of the suite that are not to meet: in two namespaces, or on two domains.

use std::time::Duration;

use free_domain::FreeDomain;
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::sensor_msgs::PointCloud2;
use node_shell::{Node, Qos, RosArguments, Subscription, Transport};
use tokio::time::timeout;

use crate::program::Running;
use crate::sensors::Sensors;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// So many cycles of the copy that has sensors are waited for: two seconds of them.
const CYCLES: usize = 20;

/// A copy of the suite, and somebody who hears it.
struct Copy {
    domain_id: u16,
    namespace: String,
    up: Running,
    ear: Node,
    clouds: Subscription<PointCloud2>,
    reports: Subscription<DiagnosticArray>,
}

impl Copy {
    fn start(domain_id: u16, namespace: &str) -> Self {
        let ear = node(domain_id, namespace, "ear");
        let rule = format!("__ns:={namespace}");
        let input = "detection:input:=points";
        Self {
            domain_id,
            namespace: namespace.to_owned(),
            clouds: ear.subscription("static_cloud", &Qos::reliable(200)).unwrap(),
            reports: ear.subscription("/diagnostics", &Qos::reliable(200)).unwrap(),
            ear,
            up: Running::start_on(domain_id, ["up", "--ros-args", "-r", &rule, "-p", input]),
        }
    }

    /// Waits until its detection reports what fits.
    async fn detection_says(&self, part: &str) {
        let name = format!("{}/detection", self.namespace);
        let heard = async {
            loop {
                let report = self.reports.next().await.message;
                if report.part(&name).is_some_and(|status| status.message.contains(part)) {
                    return;
                }
            }
        };
        timeout(PATIENCE, heard).await.unwrap_or_else(|_| panic!("{name} does not say {part}"));
    }

    /// Waits until it has mapped for a while.
    async fn maps(&self) {
        for _ in 0..CYCLES {
            timeout(PATIENCE, self.clouds.next()).await.expect("the copy with sensors maps");
        }
    }

    /// Nothing of another copy was heard.
    fn has_heard_nothing(&self) {
        assert!(self.clouds.try_next().is_none(), "{} maps without a sensor", self.namespace);
    }

    async fn end(self) {
        assert!(self.up.interrupt());
        drop((self.clouds, self.reports));
        self.ear.close().await;
    }
}

fn node(domain_id: u16, namespace: &str, name: &str) -> Node {
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    Node::start_on(Transport::on_domain(domain_id).unwrap(), name, &arguments).unwrap()
}

/// The first copy gets sensors; the second one must know of nobody.
async fn do_not_meet(with_sensors: Copy, without: Copy) {
    let Copy { domain_id, namespace, .. } = &with_sensors;
    let sensors = Sensors::start(node(*domain_id, namespace, "sensors"));
    with_sensors.maps().await;
    let waits = format!("waiting for {}/points", without.namespace);
    without.detection_says(&waits).await;
    without.has_heard_nothing();
    for copy in [&with_sensors, &without] {
        assert_eq!(copy.clouds.publisher_count(), 1, "{} has its own segmentation", copy.namespace);
    }
    sensors.end().await;
    with_sensors.end().await;
    without.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_copies_in_two_namespaces_do_not_meet() {
    let place = format!("/apart_{}", std::process::id());
    let domain = FreeDomain::new();
    let copy = |name: &str| Copy::start(domain.number(), &format!("{place}/{name}"));
    do_not_meet(copy("left"), copy("right")).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_copies_on_two_domains_do_not_meet() {
    let namespace = format!("/domains_{}", std::process::id());
    let domains = [FreeDomain::new(), FreeDomain::new()];
    let [with_sensors, without] =
        domains.each_ref().map(|domain| Copy::start(domain.number(), &namespace));
    do_not_meet(with_sensors, without).await;
}
