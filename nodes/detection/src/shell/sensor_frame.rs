//! One sensor for each topic: a message with another frame is of another sensor.

use geometry::Stamp;

/// A sensor that was not heard for so long has gone, or its driver was started anew with another frame.
const GONE_AFTER_S: f64 = 2.0;

/// The frame of the sensor that a topic is of.
#[derive(Default)]
pub(super) struct SensorFrame {
    last: Option<(String, Stamp)>,
}

/// The sensor has another frame than before.
#[derive(PartialEq, Debug)]
pub(super) struct Renamed {
    pub(super) from: String,
    pub(super) to: String,
}

/// Two sensors publish on one topic.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error(
    "its frame is {other}, and that of the messages before is {taken}: two sensors publish on one topic. Give each its own, and remap \
     the one that the node shall take"
)]
pub(super) struct OtherSensor {
    taken: String,
    other: String,
}

impl SensorFrame {
    /// Takes the frame of a message; with the change, where the sensor has another one from here on.
    ///
    /// # Errors
    /// When it is of another sensor.
    pub(super) fn take(
        &mut self,
        frame_id: &str,
        stamp: Stamp,
    ) -> Result<Option<Renamed>, OtherSensor> {
        let Some((taken, last)) = &mut self.last else {
            self.last = Some((frame_id.to_owned(), stamp));
            return Ok(None);
        };
        let to = frame_id.to_owned();
        if *taken == to {
            *last = stamp;
            return Ok(None);
        }
        // A clock that jumped is a start anew, too.
        if stamp.seconds_since(*last).abs() < GONE_AFTER_S {
            return Err(OtherSensor { taken: taken.clone(), other: to });
        }
        *last = stamp;
        Ok(Some(Renamed { from: std::mem::replace(taken, to.clone()), to }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: i32) -> Stamp {
        Stamp::from_secs_nanos(seconds, 0)
    }

    /// Regression: the scans of two scanners on one topic were taken for those of one, with the mounting of the first.
    #[test]
    fn a_second_sensor_is_not_taken_for_the_first() {
        let mut frame = SensorFrame::default();
        for second in 0..5 {
            assert_eq!(frame.take("front", at(second)), Ok(None));
            assert!(frame.take("rear", at(second)).is_err(), "second {second}");
        }
    }

    #[test]
    fn a_driver_with_another_frame_after_a_pause_is_followed() {
        let renamed =
            |from: &str, to: &str| Ok(Some(Renamed { from: from.to_owned(), to: to.to_owned() }));
        let mut frame = SensorFrame::default();
        assert_eq!(frame.take("laser", at(10)), Ok(None));
        assert_eq!(frame.take("laser_link", at(12)), renamed("laser", "laser_link"));
        assert_eq!(frame.take("laser_link", at(13)), Ok(None));
        // A recording that begins anew.
        assert_eq!(frame.take("laser", at(0)), renamed("laser_link", "laser"));
    }
}
