//! The traits of a ROS 2 message, and the macros that implement them.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A ROS 2 message: its struct serialises field by field in the order of its `.msg` file.
pub trait RosMessage: Serialize + DeserializeOwned + Clone + Send + Sync + 'static {
    /// The full name of the type, for instance `sensor_msgs/msg/LaserScan`.
    const TYPE_NAME: &'static str;
    /// The text of its `.msg` file, or its part of a `.srv` file.
    const DEFINITION: &'static str;
    /// The whole-number constants of the definition, in its order.
    const CONSTANTS: &'static [(&'static str, i64)] = &[];

    /// The definition followed by those of all messages within it, in the `ros2msg` form that rosbag2
    /// writes to a bag: each one headed by a line of 80 `=` and a line `MSG: package/Name`.
    #[must_use]
    fn schema() -> String {
        crate::schema::with_dependencies(Self::TYPE_NAME, Self::DEFINITION)
    }

    /// The hash of the type as ROS 2 has it since Iron, `RIHS01_` and 64 digits (REP-2016).
    #[must_use]
    fn type_hash() -> Option<String> {
        crate::type_hash::type_hash_of(Self::TYPE_NAME, &Self::schema())
    }
}

/// A ROS 2 service.
pub trait RosService {
    /// The client's request.
    type Request: RosMessage;
    /// The server's response.
    type Response: RosMessage;
    /// The full name of the type, for instance `std_srvs/srv/Trigger`.
    const TYPE_NAME: &'static str;
    /// The text of its `.srv` file.
    const DEFINITION: &'static str;

    /// The hash of the type, as [`RosMessage::type_hash`].
    #[must_use]
    fn type_hash() -> Option<String> {
        let schemas = [Self::Request::schema(), Self::Response::schema()];
        crate::type_hash::of_service(Self::TYPE_NAME, &schemas)
    }
}

/// The line of a `.srv` file between request and response.
const SERVICE_SEPARATOR: &[u8] = b"---\n";

/// The request's part of a `.srv` file.
pub(crate) const fn request_part(service: &'static str) -> &'static str {
    service.split_at(separator_at(service)).0
}

/// The response's part of a `.srv` file.
pub(crate) const fn response_part(service: &'static str) -> &'static str {
    let from_separator = service.split_at(separator_at(service)).1;
    from_separator.split_at(SERVICE_SEPARATOR.len()).1
}

/// Where the separator starts. Runs at compile time only, where running off the text is an error of
/// the build.
const fn separator_at(service: &'static str) -> usize {
    let text = service.as_bytes();
    let mut at = 0;
    loop {
        let mut matching = 0;
        while matching < SERVICE_SEPARATOR.len()
            && text[at + matching] == SERVICE_SEPARATOR[matching]
        {
            matching += 1;
        }
        if matching == SERVICE_SEPARATOR.len() {
            return at;
        }
        at += 1;
    }
}

/// Ties a struct to the `.msg` file of its name; constants are given with their documentation.
macro_rules! ros_message {
    ($name:ident, $package:literal) => {
        ros_message!($name, $package, {});
    };
    ($name:ident, $package:literal, {
        $($(#[$attribute:meta])* $constant:ident: $kind:ty = $value:literal,)*
    }) => {
        impl $name {
            $($(#[$attribute])* pub const $constant: $kind = $value;)*
        }

        impl $crate::RosMessage for $name {
            const TYPE_NAME: &'static str = concat!($package, "/msg/", stringify!($name));
            const DEFINITION: &'static str = include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/msg/",
                $package,
                "/",
                stringify!($name),
                ".msg"
            ));
            const CONSTANTS: &'static [(&'static str, i64)] =
                &[$((stringify!($constant), $value)),*];
        }
    };
}

/// Ties a service and its two structs to the `.srv` file of its name; constants of the request are given with their
/// documentation.
macro_rules! ros_service {
    ($name:ident, $request:ident, $response:ident, $package:literal) => {
        ros_service!($name, $request {}, $response, $package);
    };
    ($name:ident, $request:ident {
        $($(#[$attribute:meta])* $constant:ident: $kind:ty = $value:literal,)*
    }, $response:ident, $package:literal) => {
        impl $crate::RosService for $name {
            type Request = $request;
            type Response = $response;
            const TYPE_NAME: &'static str = concat!($package, "/srv/", stringify!($name));
            const DEFINITION: &'static str = include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/srv/",
                $package,
                "/",
                stringify!($name),
                ".srv"
            ));
        }

        impl $request {
            $($(#[$attribute])* pub const $constant: $kind = $value;)*
        }

        impl $crate::RosMessage for $request {
            const TYPE_NAME: &'static str =
                concat!($package, "/srv/", stringify!($name), "_Request");
            const DEFINITION: &'static str =
                $crate::message::request_part(<$name as $crate::RosService>::DEFINITION);
            const CONSTANTS: &'static [(&'static str, i64)] =
                &[$((stringify!($constant), $value)),*];
        }

        impl $crate::RosMessage for $response {
            const TYPE_NAME: &'static str =
                concat!($package, "/srv/", stringify!($name), "_Response");
            const DEFINITION: &'static str =
                $crate::message::response_part(<$name as $crate::RosService>::DEFINITION);
        }
    };
}
