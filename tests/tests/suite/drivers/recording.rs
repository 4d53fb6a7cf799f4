//! A recording in memory, to be rewritten.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use bag_player::{BagWriter, OfferedQos};
use geometry::{CameraModel, Distortion, Stamp};
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::{RosMessage, convert};
use nalgebra::{Point2, Point3};

use super::rewrites::Codec;
use crate::bags::{made_once, messages_of, organised};

/// The scene, whose rig drives; the first five seconds, in which two persons cross, with images of 80 x 60 pixels.
const SCENE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../nodes/laboratory/simulator/scenes/sensors/usual.yaml");
const IMAGES: &str = "/camera/depth/image_raw";

/// What the sensors sent, each message with the moment when it was recorded.
#[derive(Clone)]
pub(super) struct Recording {
    scans: Vec<(Stamp, LaserScan)>,
    poses: Vec<(Stamp, PoseStamped)>,
    images: Vec<(Stamp, Image)>,
    infos: Vec<(Stamp, CameraInfo)>,
    /// Which object each pixel of an image shows, 0 for none.
    labels: Vec<(Stamp, Vec<u16>)>,
    image_topic: String,
    form: Form,
}

/// How depths are sent.
#[derive(Clone, Copy)]
enum Form {
    Images,
    Compressed(Codec),
    Clouds,
}

impl Recording {
    pub(super) fn simulated(folder: &Path) -> Self {
        static BAG: OnceLock<Vec<u8>> = OnceLock::new();
        let size = ["--depth-size", "80", "60", "--seconds", "5"];
        let bag = made_once(
            &BAG,
            folder.join("simulated.mcap"),
            &[&["simulate", SCENE], &size[..]].concat(),
        );
        let labels = messages_of::<Image>(&bag, "/truth/labels").into_iter();
        let labels = labels.map(|(_, message)| {
            let labels = convert::labels_from_message(&message).unwrap();
            (labels.stamp, labels.object_ids().to_vec())
        });
        Self {
            scans: messages_of(&bag, "/scan"),
            poses: messages_of(&bag, "/pose"),
            images: messages_of(&bag, IMAGES),
            infos: messages_of(&bag, "/camera/depth/camera_info"),
            labels: labels.collect(),
            image_topic: IMAGES.to_owned(),
            form: Form::Images,
        }
    }

    /// Which object each pixel of the image of a moment shows.
    pub(super) fn labels_at(&self, stamp: Stamp) -> &[u16] {
        let (_, labels) = self.labels.iter().find(|(at, _)| *at == stamp).unwrap();
        labels
    }

    pub(super) fn each_scan(&mut self, rewrite: impl Fn(&mut LaserScan)) {
        self.scans.iter_mut().for_each(|(_, scan)| rewrite(scan));
    }

    pub(super) fn each_image(&mut self, rewrite: impl Fn(&mut Image)) {
        self.images.iter_mut().for_each(|(_, image)| rewrite(image));
    }

    pub(super) fn each_info(&mut self, rewrite: impl Fn(&mut CameraInfo)) {
        self.infos.iter_mut().for_each(|(_, info)| rewrite(info));
    }

    pub(super) fn each_info_stamp(&mut self, moved: impl Fn(Stamp) -> Stamp) {
        self.infos.iter_mut().for_each(|(stamp, _)| *stamp = moved(*stamp));
    }

    pub(super) fn keep_images(&mut self, is_kept: impl Fn(usize) -> bool) {
        let mut index = 0..;
        self.images.retain(|_| index.next().is_some_and(&is_kept));
    }

    /// Images at 90 Hz of a camera that sends 30: each twice more, 11 and 22 ms later.
    pub(super) fn three_times_the_images(&mut self) {
        const PERIOD_S: f64 = 1.0 / 90.0;
        let copies = |stamp: Stamp| [0.0, 1.0, 2.0].map(|nth| stamp.plus_seconds(nth * PERIOD_S));
        let images = self.images.iter().flat_map(|(stamp, image)| {
            copies(*stamp).map(|stamp| {
                let mut image = image.clone();
                image.header.stamp = convert::time_from_stamp(stamp);
                (stamp, image)
            })
        });
        self.images = images.collect();
        let infos = self.infos.iter().flat_map(|(stamp, info)| {
            copies(*stamp).map(|stamp| {
                let mut info = info.clone();
                info.header.stamp = convert::time_from_stamp(stamp);
                (stamp, info)
            })
        });
        self.infos = infos.collect();
        let labels = self.labels.iter();
        self.labels = labels
            .flat_map(|(stamp, labels)| copies(*stamp).map(|stamp| (stamp, labels.clone())))
            .collect();
    }

    /// The images under another name, their calibration beside them.
    pub(super) fn view_topics(&mut self, images: &str) {
        images.clone_into(&mut self.image_topic);
    }

    pub(super) fn compress(&mut self, codec: Codec) {
        self.form = Form::Compressed(codec);
    }

    pub(super) fn clouds(&mut self) {
        self.form = Form::Clouds;
    }

    /// The same scene through another lens.
    pub(super) fn seen_through(&mut self, distortion: Distortion) {
        let pinhole = self.camera();
        let lens = CameraModel { distortion, ..pinhole };
        let source = |column: usize, row: usize| -> Option<usize> {
            let ray = lens.ray(&Point2::new(column as f64, row as f64))?;
            let pixel = pinhole.project(&Point3::new(ray.x, ray.y, 1.0))?;
            let [column, row] = [pixel.x, pixel.y].map(|place| place.round().max(0.0) as usize);
            Some(row * pinhole.width_px + column)
        };
        self.resample((pinhole.width_px, pinhole.height_px), source);
        self.each_info(|info| {
            let seen = convert::message_from_camera(&lens, Stamp::from_nanos(0), "");
            (info.distortion_model, info.d) = (seen.distortion_model, seen.d);
        });
    }

    /// The middle of the image alone, as a driver sends a region of interest: the calibration is that of the whole sensor.
    pub(super) fn middle_of_the_sensor(&mut self) {
        const BORDER_PX: usize = 4;
        let CameraModel { width_px: sensor_px, height_px, .. } = self.camera();
        let size_px = (sensor_px - 2 * BORDER_PX, height_px - 2 * BORDER_PX);
        self.resample(size_px, |column, row| {
            Some((row + BORDER_PX) * sensor_px + column + BORDER_PX)
        });
        self.each_info(|info| {
            (info.roi.x_offset, info.roi.y_offset) = (BORDER_PX as u32, BORDER_PX as u32);
            (info.roi.width, info.roi.height) = (size_px.0 as u32, size_px.1 as u32);
        });
    }

    /// Scans of several returns a beam alone.
    pub(super) fn several_echoes(&mut self) {
        self.scans.clear();
    }

    fn camera(&self) -> CameraModel {
        convert::camera_from_message(&self.infos[0].1).unwrap()
    }

    /// Takes the pixels of other images, 16UC1, and their labels by what `source` says; `None` shows nothing.
    fn resample(
        &mut self,
        (width_px, height_px): (usize, usize),
        source: impl Fn(usize, usize) -> Option<usize>,
    ) {
        let places = (0..height_px).flat_map(|row| (0..width_px).map(move |column| (column, row)));
        let sources: Vec<Option<usize>> = places.map(|(column, row)| source(column, row)).collect();
        self.each_image(|image| {
            let pixel = |source: &Option<usize>| {
                source.map_or([0; 2], |at| [image.data[2 * at], image.data[2 * at + 1]])
            };
            image.data = sources.iter().flat_map(pixel).collect();
            (image.width, image.height) = (width_px as u32, height_px as u32);
            image.step = 2 * image.width;
        });
        for (_, labels) in &mut self.labels {
            *labels = sources.iter().map(|source| source.map_or(0, |at| labels[at])).collect();
        }
    }

    pub(super) fn write(&self, path: &Path) -> PathBuf {
        let mut writer = BagWriter::create(path).unwrap();
        let parent = self.image_topic.rsplit_once('/').unwrap().0;
        messages(&mut writer, "/scan", self.scans.iter().cloned());
        messages(&mut writer, "/pose", self.poses.iter().cloned());
        messages(&mut writer, &format!("{parent}/camera_info"), self.infos.iter().cloned());
        let images = self.images.iter();
        match self.form {
            Form::Images => messages(&mut writer, &self.image_topic, images.cloned()),
            Form::Compressed(codec) => {
                let compressed = images.map(|(stamp, image)| -> (Stamp, CompressedImage) {
                    (*stamp, codec.compressed(image))
                });
                messages(&mut writer, &format!("{}/compressedDepth", self.image_topic), compressed);
            }
            Form::Clouds => {
                let camera = self.camera();
                let clouds = images.map(|(stamp, image)| -> (Stamp, PointCloud2) {
                    (*stamp, organised(&convert::depth_from_message(image).unwrap(), &camera))
                });
                messages(&mut writer, &format!("{parent}/points"), clouds);
            }
        }
        if self.scans.is_empty() {
            let echoes = "sensor_msgs/msg/MultiEchoLaserScan";
            let channel = writer.raw_channel("/echoes", echoes, "", "").unwrap();
            let stamp = self.poses[0].0;
            writer.write_raw(channel, stamp, stamp, &[0, 1, 0, 0]).unwrap();
        }
        writer.finish().unwrap();
        path.to_owned()
    }
}

fn messages<M: RosMessage>(
    writer: &mut BagWriter,
    topic: &str,
    messages: impl Iterator<Item = (Stamp, M)>,
) {
    let channel = writer.channel::<M>(topic, OfferedQos::reliable(10)).unwrap();
    for (stamp, message) in messages {
        writer.write(channel, stamp, &message).unwrap();
    }
}
