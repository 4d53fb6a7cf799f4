//! The choices among the node's parameters.

geometry::choices! {
    /// Where the scans come from.
    pub enum LidarInput {
        /// Clouds of any driver.
        Points = "points",
        /// Packets of velodyne_driver.
        VelodynePackets = "velodyne_packets",
        /// Packets from the scanner itself.
        Udp = "udp",
    }
}

geometry::choices! {
    /// The unit of the times of a cloud's points.
    pub enum TimeUnitChoice {
        /// The one with which the times of a cloud span a revolution.
        Auto = "auto",
        /// Seconds.
        S = "s",
        /// Milliseconds.
        Ms = "ms",
        /// Microseconds.
        Us = "us",
        /// Nanoseconds.
        Ns = "ns",
    }
}

geometry::choices! {
    /// The scanner that sends the packets.
    pub enum ModelChoice {
        /// The one that the packets name.
        Auto = "auto",
        /// Velodyne HDL-32E.
        Hdl32e = "hdl32e",
        /// Velodyne VLP-16.
        Vlp16 = "vlp16",
        /// Velodyne Puck Hi-Res.
        PuckHiRes = "puck_hi_res",
        /// Velodyne VLP-32C.
        Vlp32c = "vlp32c",
        /// Velodyne HDL-64E.
        Hdl64e = "hdl64e",
    }
}

geometry::choices! {
    /// Which of two returns of a beam is used.
    pub enum EchoChoice {
        /// The strongest one.
        Strongest = "strongest",
        /// The last one.
        Last = "last",
    }
}

geometry::choices! {
    /// Which points take part.
    pub enum FilterChoice {
        /// All points.
        None = "none",
        /// Those of some rays.
        Rays = "rays",
        /// Those that are not as bright as the road: the filter of the road thesis.
        RoadIntensity = "road_intensity",
        /// Those that do not lie on the ground.
        Ground = "ground",
    }
}
