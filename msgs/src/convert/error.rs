//! Why a message is not the geometry that it claims to be.

use geometry::{
    CameraModelError, DepthSizeError, DistortionError, LabelSizeError, MapPathError, ScanError,
};

use super::CompressedImageError;

/// A message could not become geometry. Lengths, offsets and counts are those that the message states.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum ConvertError {
    /// A path is invalid.
    #[error("Path: {0}")]
    MapPath(#[from] MapPathError),
    /// A scan says nothing of any place.
    #[error("LaserScan: {0}")]
    Scan(#[from] ScanError),
    /// A cycle was made by a method that is not known.
    #[error("CycleSetup: {method:?} is no method; rec_hv and free_space are")]
    Method {
        /// Its name.
        method: String,
    },
    /// The box around the robot is none.
    #[error("CycleSetup: {0}")]
    RobotBox(Box<geometry::ParameterError>),
    /// A cycle has more than one depth image.
    #[error("depth has {frames} images; a cycle has one, or none")]
    DepthFrames {
        /// How many.
        frames: usize,
    },
    /// A marker of a mesh is no list of triangles of a block.
    #[error(
        "MarkerArray: the marker {id} of {ns:?} with {points} points and {colours} colours is no block of a mesh"
    )]
    MeshMarker {
        /// Its namespace.
        ns: String,
        /// Its number.
        id: i32,
        /// Its points.
        points: usize,
        /// Its colours.
        colours: usize,
    },
    /// A depth image and its camera are not of each other.
    #[error("DepthFrame: {0}")]
    DepthFrame(#[from] geometry::DepthFrameError),
    /// The mask is not one of the depth image.
    #[error("SegmentedCloud: {0}")]
    MaskedDepth(#[from] geometry::MaskSizeError),
    /// A cycle has more than one colour image.
    #[error("DepthFrame: colour has {images} images; a depth image has one, or none")]
    ColourImages {
        /// How many.
        images: usize,
    },
    /// Colours are not as many as the pixels.
    #[error("colours: {0}")]
    Colours(#[from] geometry::ColourSizeError),
    /// A depth image was not taken with the cycle's cloud.
    #[error(
        "DepthFrame: it has the stamp {depth_stamp_ns} ns, and the cycle's cloud {cloud_stamp_ns} ns"
    )]
    DepthStamp {
        /// Of the image.
        depth_stamp_ns: i64,
        /// Of the cloud.
        cloud_stamp_ns: i64,
    },
    /// A mask is not one of its image.
    #[error("moving_pixels has {bytes} bytes; an image of {pixels} pixels has {expected}")]
    MovingPixels {
        /// Its length.
        bytes: usize,
        /// Of the image.
        pixels: usize,
        /// What these take.
        expected: usize,
    },
    /// A cloud without one of its coordinates.
    #[error("PointCloud2: there is no field {field}, only [{present}]")]
    MissingField {
        /// The coordinate.
        field: &'static str,
        /// The names of the fields, the first of them.
        present: String,
    },
    /// A cloud that has a coordinate twice.
    #[error("PointCloud2: there are {times} fields {field}; which one is meant?")]
    RepeatedField {
        /// The coordinate.
        field: &'static str,
        /// How often it is there.
        times: usize,
    },
    /// A coordinate of unknown datatype.
    #[error(
        "PointCloud2: field {field} has datatype {datatype}; 1 (INT8) .. 8 (FLOAT64) are known"
    )]
    FieldDatatype {
        /// The coordinate.
        field: &'static str,
        /// Its datatype.
        datatype: u8,
    },
    /// A coordinate of several elements.
    #[error("PointCloud2: field {field} has {count} elements; a coordinate has one")]
    FieldCount {
        /// The coordinate.
        field: &'static str,
        /// Its elements.
        count: u32,
    },
    /// A coordinate that is not within the point.
    #[error(
        "PointCloud2: field {field} takes {size_bytes} bytes from offset {offset}, beyond the \
         point_step {point_step}"
    )]
    FieldOutsidePoint {
        /// The coordinate.
        field: &'static str,
        /// Where it starts.
        offset: u32,
        /// Its size.
        size_bytes: usize,
        /// Bytes of a point.
        point_step: u32,
    },
    /// The rows of a cloud or image overlap.
    #[error(
        "{message}: a row of {width} takes {row_bytes} bytes, but the next one starts after {step}"
    )]
    RowStep {
        /// The type of the message.
        message: &'static str,
        /// Points or pixels in a row.
        width: u32,
        /// Their size.
        row_bytes: u64,
        /// `row_step` of a cloud, `step` of an image.
        step: u32,
    },
    /// There is less data than rows.
    #[error(
        "{message}: {height} rows of {step} bytes are {needed_bytes}, but data has {data_bytes}; \
         the message was cut, or its sizes are wrong"
    )]
    DataTooShort {
        /// The type of the message.
        message: &'static str,
        /// Rows.
        height: u32,
        /// Bytes from a row to the next.
        step: u64,
        /// The size of the rows.
        needed_bytes: u128,
        /// The bytes there are.
        data_bytes: usize,
    },
    /// An image of another encoding.
    #[error("Image: encoding {encoding:?} is no {wanted}")]
    Encoding {
        /// The encoding, the start of it.
        encoding: String,
        /// The kind needed, with its encodings.
        wanted: &'static str,
    },
    /// A compressed image is not what it claims to be, or an image cannot be compressed.
    #[error(transparent)]
    Compressed(#[from] CompressedImageError),
    /// The pixels do not make up the image.
    #[error(transparent)]
    DepthSize(#[from] DepthSizeError),
    /// The labels do not make up the image.
    #[error(transparent)]
    LabelSize(#[from] LabelSizeError),
    /// A camera that was never calibrated.
    #[error(
        "CameraInfo: k is all zero: the camera is not calibrated; give its driver a calibration"
    )]
    Uncalibrated,
    /// An intrinsic matrix that is not that of a pinhole camera.
    #[error("CameraInfo: k[{index}] is {value}, where an intrinsic matrix has {expected}")]
    IntrinsicMatrix {
        /// Which element.
        index: usize,
        /// Its value.
        value: f64,
        /// The value needed.
        expected: f64,
    },
    /// The lens is not known.
    #[error("CameraInfo: {0}")]
    Distortion(#[from] DistortionError),
    /// The region of interest is not within the sensor.
    #[error(
        "CameraInfo: the roi, {width} x {height} px from ({x_offset}, {y_offset}), is not within \
         the {sensor_width} x {sensor_height} px of the sensor"
    )]
    RegionOutside {
        /// First column.
        x_offset: u32,
        /// First row.
        y_offset: u32,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Columns of the sensor.
        sensor_width: u32,
        /// Rows of the sensor.
        sensor_height: u32,
    },
    /// The numbers describe no camera.
    #[error("CameraInfo: {0}")]
    Camera(CameraModelError),
    /// An inertial unit has no gyroscope.
    #[error(
        "Imu: angular_velocity_covariance[0] is -1: the unit does not measure its angular velocity"
    )]
    NoAngularVelocity,
    /// An angular velocity that is none.
    #[error(
        "Imu: the angular velocity ({x_rad_per_s}, {y_rad_per_s}, {z_rad_per_s}) rad/s is not finite"
    )]
    AngularVelocity {
        /// About x.
        x_rad_per_s: f64,
        /// About y.
        y_rad_per_s: f64,
        /// About z.
        z_rad_per_s: f64,
    },
    /// A position that is no place.
    #[error("pose: the position ({x_m}, {y_m}, {z_m}) is not finite")]
    Position {
        /// Along x.
        x_m: f64,
        /// Along y.
        y_m: f64,
        /// Along z.
        z_m: f64,
    },
    /// A quaternion that is no rotation.
    #[error("pose: the quaternion ({x}, {y}, {z}, {w}) is no rotation; its length must be 1")]
    Quaternion {
        /// Imaginary part along x.
        x: f64,
        /// Imaginary part along y.
        y: f64,
        /// Imaginary part along z.
        z: f64,
        /// Real part.
        w: f64,
    },
    /// A zone without an inside.
    #[error(
        "zone {index}: azimuths {azimuth_min_rad} .. {azimuth_max_rad} rad are no wedge; the lower \
         lies within -pi .. pi, the upper not below it and at most one turn above"
    )]
    ZoneBounds {
        /// Which zone.
        index: usize,
        /// Its right-hand bound.
        azimuth_min_rad: f64,
        /// Its left-hand bound.
        azimuth_max_rad: f64,
    },
    /// A zone's deviation is invalid.
    #[error("zone {index}: peak_std_dev_m {peak_std_dev_m} is no deviation")]
    ZonePeak {
        /// Which zone.
        index: usize,
        /// Its largest deviation.
        peak_std_dev_m: f32,
    },
    /// A zone's distances are none.
    #[error(
        "zone {index}: returns from {nearest_m} to {farthest_m} m; both must be finite, and in this order"
    )]
    ZoneReturns {
        /// Which zone.
        index: usize,
        /// The distance of the nearest return.
        nearest_m: f32,
        /// The distance of the farthest return.
        farthest_m: f32,
    },
    /// The cloud of a cycle is not the cycle's own.
    #[error(
        "ReducedCloud: the cloud is of {cloud_stamp_ns} ns in frame {cloud_frame_id:?}, the cycle \
         of {cycle_stamp_ns} ns in frame {cycle_frame_id:?}; both must be the same"
    )]
    ForeignCloud {
        /// Stamp of the cloud.
        cloud_stamp_ns: i64,
        /// Frame of the cloud, the start of its name.
        cloud_frame_id: String,
        /// Stamp of the cycle.
        cycle_stamp_ns: i64,
        /// Frame of the cycle, the start of its name.
        cycle_frame_id: String,
    },
    /// A mask is not one of its message.
    #[error("{message}: a mask of {entries} entries for {records} points or pixels")]
    Mask {
        /// The type of the message.
        message: &'static str,
        /// Entries of the mask.
        entries: usize,
        /// Points or pixels of the message.
        records: usize,
    },
    /// A coordinate that cannot be NaN.
    #[error("PointCloud2: field {field} holds whole numbers, and a point that is taken out is NaN")]
    NotANumber {
        /// The coordinate.
        field: &'static str,
    },
    /// The rays of a scan are not whole.
    #[error("scan_rays has {numbers} numbers, six a ray, and scan_ray_flags {flags} entries")]
    ScanRays {
        /// How many numbers.
        numbers: usize,
        /// How many flags.
        flags: usize,
    },
    /// A pose that a cycle has once at most is there several times.
    #[error("ReducedCloud: map_from_continuous has {poses} poses: one, or none")]
    SeveralPoses {
        /// How many.
        poses: usize,
    },
    /// The beams that move and the ranges behind them are not as many.
    #[error("ReducedCloud: background_ranges has {ranges} entries for {beams} moving_beams")]
    MovingBeams {
        /// How many beams.
        beams: usize,
        /// How many ranges.
        ranges: usize,
    },
    /// The counts of a reduced cloud are not those of its points.
    #[error("ReducedCloud: voxel_points has {counts} entries for a cloud of {means} points")]
    VoxelPoints {
        /// How many counts there are.
        counts: usize,
        /// How many points there are.
        means: usize,
    },
    /// More points than this machine can count.
    #[error("ReducedCloud: {points} points before the reduction are more than there can be")]
    PointCount {
        /// How many points there were.
        points: u64,
    },
}

/// The start of a text that came from outside, short enough for an error.
pub(super) fn excerpt(text: &str) -> String {
    const LONGEST: usize = 60;
    match text.char_indices().nth(LONGEST) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}...", text.get(..end).unwrap_or_default()),
    }
}
